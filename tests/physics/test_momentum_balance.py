"""The momentum balance that the page typesets is the force equation, term by term, and that of the matrices."""

import numpy as np
import pytest

from undertow.physics.forces import ForceEquation, apparent_wind, relative_velocity
from undertow.physics.momentum_balance import (
    balances,
    coriolis_matrix,
    damping_matrix,
    factor_symbols,
    mass_matrix,
    thruster_matrix,
)
from undertow.physics.vehicle import load_vehicle

FULL = {
    "x_g": 0.1,
    "Y_rdot": 0.4,
    "X_u": -3.0,
    "X_uu": -2.0,
    "Y_v": -4.0,
    "Y_vv": -5.0,
    "N_r": -1.0,
    "N_rr": -2.0,
    "N_ur": -0.7,
    "Y_r": 0.3,
    "N_v": 0.2,
    "N_uv": 1.1,
    "Y_ur": 0.9,
    "X_vr": 0.8,
    "current_north": 0.3,
    "current_east": -0.2,
    "wind_force_north": 2.0,
    "wind_force_east": -1.0,
    "wind_x": 0.5,
    "wind_y": 0.6,
    "wind_n": 0.07,
    "memory_sway": 3.0,
    "memory_yaw": 0.5,
    "memory_time": 2.0,
    "yaw_trim": 0.4,
    "yaw:u|r|": -0.6,
}


def by_matrices(vehicle, relative, heading, thrust, memory, air) -> np.ndarray:
    """B T - C nu_r - D nu_r + wind + memory + trim, from the matrices; `air` is relative to the water."""
    nu = np.stack(relative, axis=-1)
    works = coriolis_matrix(vehicle, nu) + damping_matrix(vehicle, nu)
    force = thruster_matrix(vehicle) @ thrust - (works @ nu[..., None])[..., 0].T
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    p = vehicle.values
    force[:2] += np.einsum("ijn,j->in", turn, [p["wind_force_north"], p["wind_force_east"]])
    blows = np.einsum("ijn,jn->in", turn, air) - nu.T[:2]
    speed = np.linalg.norm(blows, axis=0)
    force += [p["wind_x"] * blows[0] * speed, p["wind_y"] * blows[1] * speed, p["wind_n"] * blows[0] * blows[1]]
    force[1:] -= [p["memory_sway"] * memory[0], p["memory_yaw"] * memory[1]]
    force[2] += p["yaw_trim"]
    return force


@pytest.mark.parametrize("changes", [{}, FULL], ids=["as shipped", "every term"])
@pytest.mark.parametrize("name", ["blueboat", "cybership2", "otter"])
def test_both_sides_are_those_of_the_force_equation(name, changes):
    vehicle = load_vehicle(name).with_values(changes)
    rng = np.random.default_rng(3)
    n, count = 50, len(vehicle.thrusters)
    heading, velocity, thrust = rng.uniform(-3, 3, n), rng.normal(size=(3, n)), rng.normal(0.0, 20.0, (count, n))
    memory, air = rng.normal(size=(2, n)), rng.normal(0.0, 5.0, (2, n))
    u, v, r = relative_velocity(vehicle, heading, tuple(velocity))
    moving = np.array([[vehicle.value("current_north")], [vehicle.value("current_east")]])
    equation = ForceEquation(vehicle)
    force = equation.force((u, v, r), heading, thrust, None, tuple(memory), tuple(air))
    rate = np.linalg.solve(mass_matrix(vehicle), np.array(force))
    np.testing.assert_allclose(force, by_matrices(vehicle, (u, v, r), heading, thrust, memory, air - moving), rtol=1e-9)
    blown = apparent_wind(heading, (velocity[0], velocity[1]), tuple(air))
    state = {"u": u, "v": v, "r": r, "|u|": abs(u), "|v|": abs(v), "|r|": abs(r)}
    state |= dict(zip(("u_dot", "v_dot", "r_dot"), rate, strict=True))
    state |= {f"T:{t.name}": push for t, push in zip(vehicle.thrusters, thrust, strict=True)}
    state |= {"cos psi": np.cos(heading), "sin psi": np.sin(heading), "q_v": memory[0], "q_r": memory[1]}
    state |= {"u_a": blown[0], "v_a": blown[1], "|V_a|": np.hypot(*blown)}
    for line, expected in zip(balances(vehicle), force, strict=True):
        told = sum(term.value(state) for term in line.force)
        np.testing.assert_allclose(told, expected, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(sum(term.value(state) for term in line.inertia), expected, rtol=1e-8, atol=1e-8)


def test_no_number_of_the_vehicle_is_left_out():
    thruster = {"thrust_scale": 0.9, "lag": 0.3, "dead_zone": 0.05, "gain_ahead_100": 1.2, "port_scale": 0.8}
    vehicle = load_vehicle("blueboat").with_values(FULL | thruster)
    written = {symbol for line in balances(vehicle) for term in (*line.inertia, *line.force) for symbol in term.symbols}
    beside = set(factor_symbols(vehicle))
    assert set(FULL) - {"current_north", "current_east", "memory_time"} <= written
    assert beside == {*thruster, "current_north", "current_east", "memory_time"}
    assert not written & beside


@pytest.mark.parametrize("late", [0, 1], ids=["first", "second"])
def test_what_any_thruster_has_alone_acts_beside_the_terms(late: int):
    vehicle = load_vehicle("blueboat")
    changed = [t.model_copy(update={"lag": 0.4 * (k == late)}) for k, t in enumerate(vehicle.thrusters)]
    assert factor_symbols(vehicle) == ()
    assert factor_symbols(vehicle.model_copy(update={"thrusters": tuple(changed)})) == ("lag",)


def test_terms_that_are_zero_are_left_out():
    vehicle = load_vehicle("blueboat").with_values({"x_g": 0.0, "Y_rdot": 0.0})
    assert all(term.coefficient for line in balances(vehicle) for term in (*line.inertia, *line.force))
    assert factor_symbols(vehicle) == ()
