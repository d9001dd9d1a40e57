"""Simulated motion against closed forms: terminal speeds, coast-down, turning, free bodies, current, memory."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from undertow.physics.forces import ForceEquation, modelled_acceleration, modelled_force
from undertow.physics.integration import simulate_motion
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Motion, body_to_earth, earth_to_body
from undertow.physics.vehicle import Vehicle, vehicle_from_dict

STEP = 0.02
MASS_AHEAD, MASS_SIDEWAYS, INERTIA, ARM = 25.0, 40.0, 6.0, 0.5


def boat(**sections: Any) -> Vehicle:
    """m11 = 25 kg, m22 = 40 kg, m33 = 6 kg m^2, two thrusters of +-100 N half a metre to each side; nothing else."""
    curve = {"kind": "table", "command": [-100.0, 100.0], "force": [-100.0, 100.0]}
    sides = [
        {"name": name, "x": -0.4, "y": y, "command": "newton", "curve": curve} for name, y in (("p", -ARM), ("s", ARM))
    ]
    base = {"mass": 20.0, "inertia_z": 4.0, "thrusters": sides}
    return vehicle_from_dict(
        base | {"added_mass": {"X_udot": -5.0, "Y_vdot": -20.0, "N_rdot": -2.0}} | sections, "boat"
    )


def sail(
    vehicle: Vehicle, port: float = 0.0, stbd: float = 0.0, start: tuple[float, ...] = (0, 0, 0), seconds: float = 10.0
) -> Motion:
    """Motion under constant thruster forces [N] from a velocity, heading 0.7 rad."""
    n = round(seconds / STEP) + 1
    velocity = np.tile(np.array(start, dtype=float), (n, 1))
    motion = Motion(
        STEP * np.arange(n, dtype=float),
        np.zeros((n, 2)),
        np.full(n, 0.7),
        velocity,
        np.tile([port, stbd], (n, 1)),
        ("p", "s"),
    )
    return simulate_motion(vehicle, motion)


def test_speed_under_constant_thrust_with_linear_drag() -> None:
    motion = sail(boat(damping={"X_u": -10.0}), 20.0, 20.0, seconds=30.0)
    np.testing.assert_allclose(
        motion.velocity[:, 0], 4.0 * (1.0 - np.exp(-10.0 / MASS_AHEAD * motion.time)), rtol=1e-7, atol=1e-9
    )
    assert motion.velocity[-1, 0] == pytest.approx(40.0 / 10.0, rel=1e-4)


def test_speed_under_constant_thrust_with_quadratic_drag() -> None:
    motion = sail(boat(damping={"X_uu": -10.0}), 20.0, 20.0)
    terminal = np.sqrt(40.0 / 10.0)
    expected = terminal * np.tanh(40.0 * motion.time / (MASS_AHEAD * terminal))
    np.testing.assert_allclose(motion.velocity[:, 0], expected, rtol=1e-6, atol=1e-9)


def test_coast_down_with_linear_drag_is_exponential() -> None:
    motion = sail(boat(damping={"X_u": -10.0}), start=(2.0, 0, 0))
    np.testing.assert_allclose(motion.velocity[:, 0], 2.0 * np.exp(-10.0 / MASS_AHEAD * motion.time), rtol=1e-8)


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_coast_down_with_quadratic_drag_is_hyperbolic(speed: float) -> None:
    motion = sail(boat(damping={"X_uu": -10.0}), start=(speed, 0, 0))
    rate = 10.0 * abs(speed) / MASS_AHEAD
    np.testing.assert_allclose(motion.velocity[:, 0], speed / (1.0 + rate * motion.time), rtol=1e-6)


def test_steady_turning_rate_under_differential_thrust() -> None:
    motion = sail(boat(damping={"N_r": -8.0, "X_u": -10.0, "Y_v": -30.0}), 12.0, -12.0)
    steady = 2.0 * ARM * 12.0 / 8.0
    expected = steady * (1.0 - np.exp(-8.0 / INERTIA * motion.time))
    np.testing.assert_allclose(motion.velocity[:, 2], expected, rtol=1e-6, atol=1e-9)
    assert motion.velocity[-1, 2] > 0, "more thrust to port turns to starboard"
    np.testing.assert_allclose(
        motion.heading, 0.7 + steady * (motion.time - (1 - np.exp(-8 / 6 * motion.time)) * 6 / 8)
    )


def test_steady_turn_with_quadratic_yaw_damping() -> None:
    motion = sail(boat(damping={"N_rr": -8.0}), 12.0, -12.0, seconds=20.0)
    assert motion.velocity[-1, 2] == pytest.approx(np.sqrt(2.0 * ARM * 12.0 / 8.0), rel=1e-9)


def test_yaw_trim_turns_the_boat() -> None:
    motion = sail(boat(damping={"N_r": -8.0}, environment={"yaw_trim": 2.0}), seconds=20.0)
    assert motion.velocity[-1, 2] == pytest.approx(0.25, rel=1e-9)


def test_advance_loss_lowers_the_terminal_speed() -> None:
    vehicle = boat(damping={"X_u": -10.0}).with_values({"advance_loss": 5.0})
    motion = sail(vehicle, 20.0, 20.0, seconds=40.0)
    assert motion.velocity[-1, 0] == pytest.approx(40.0 / (10.0 + 2 * 5.0 * 0.2), rel=1e-6)


def test_added_mass_slows_the_start() -> None:
    vehicle = boat().with_values({"X_udot": -30.0})
    assert sail(vehicle, 25.0, 25.0).velocity[1, 0] == pytest.approx(50.0 / 50.0 * STEP)


def test_free_rigid_body_moves_its_centre_of_gravity_straight() -> None:
    """No added mass, no force: Newton says the centre of gravity keeps its earth velocity, whatever the origin does."""
    x_g = 0.3
    motion = sail(boat(x_g=x_g, added_mass={}), start=(1.5, -0.4, 0.8), seconds=12.0)
    north, east = body_to_earth(motion.heading, x_g, 0.0)
    cg = motion.position + np.column_stack([north, east])
    line = np.linspace(cg[0], cg[-1], len(cg))
    np.testing.assert_allclose(cg, line, atol=1e-7)
    np.testing.assert_allclose(motion.velocity[:, 2], 0.8, rtol=1e-8)
    assert np.ptp(motion.velocity[:, 0]) > 1.0, "the origin itself circles"


def test_energy_is_kept_without_damping_and_thrust() -> None:
    vehicle = boat(x_g=0.2)
    motion = sail(vehicle, start=(1.5, -0.6, 0.9))
    energy = 0.5 * np.einsum("ni,ij,nj->n", motion.velocity, mass_matrix(vehicle), motion.velocity)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-6)
    assert np.ptp(motion.velocity, axis=0).min() > 0.1, "the Munk moment exchanges energy between the axes"


CURRENT = {"current_north": 0.4, "current_east": -0.3}


def drift(heading: float) -> tuple[float, float, float]:
    ahead, starboard = earth_to_body(np.array(heading), CURRENT["current_north"], CURRENT["current_east"])
    return float(ahead), float(starboard), 0.0


def test_boat_that_drifts_with_the_current_feels_no_force() -> None:
    damping = {"X_u": -10.0, "X_uu": -4.0, "Y_v": -30.0, "Y_vv": -50.0, "N_r": -8.0, "N_ur": -3.0, "N_v": 4.0}
    vehicle = boat(x_g=0.1, damping=damping, coupling={"N_uv": 9.0, "Y_ur": -5.0, "X_vr": 3.0}, environment=CURRENT)
    motion = sail(vehicle, start=drift(0.7))
    np.testing.assert_allclose(modelled_force(vehicle, motion), 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.velocity - motion.velocity[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.position[-1], [4.0, -3.0], atol=1e-9)


def test_boat_that_spins_in_the_current_still_drifts_straight() -> None:
    vehicle = boat(damping={"X_u": -10.0, "Y_v": -30.0}, environment=CURRENT)
    ahead, starboard, _ = drift(0.7)
    motion = sail(vehicle, start=(ahead, starboard, 1.1))
    np.testing.assert_allclose(motion.position, motion.time[:, None] * [0.4, -0.3], atol=1e-7)
    np.testing.assert_allclose(motion.velocity[:, 2], 1.1, rtol=1e-9)


def test_turning_current_derivative_against_finite_differences() -> None:
    vehicle = boat(environment=CURRENT)
    heading, rate, h = 1.2, 0.6, 1e-5
    velocity = (np.array(0.8), np.array(0.1), np.array(rate))
    ahead, starboard = earth_to_body(np.array(heading), 0.4, -0.3)
    relative = (velocity[0] - ahead, velocity[1] - starboard, velocity[2])
    zero = (np.array(0.0), np.array(0.0), np.array(0.0))
    turned = ForceEquation(vehicle).acceleration(zero, relative, velocity, np.array(heading))
    after, before = (
        earth_to_body(np.array(heading + rate * h), 0.4, -0.3),
        earth_to_body(np.array(heading - rate * h), 0.4, -0.3),
    )
    expected = [(float(a) - float(b)) / (2 * h) for a, b in zip(after, before, strict=True)]
    np.testing.assert_allclose([turned[0], turned[1]], expected, rtol=1e-8)
    assert turned[2] == 0.0


def test_mean_wind_is_fixed_in_the_earth() -> None:
    vehicle = boat(environment={"wind_force_north": 10.0, "wind_force_east": 0.0})
    n = 3
    east = Motion(
        0.1 * np.arange(n, dtype=float),
        np.zeros((n, 2)),
        np.full(n, np.pi / 2),
        np.zeros((n, 3)),
        np.zeros((n, 2)),
        ("p", "s"),
    )
    np.testing.assert_allclose(modelled_force(vehicle, east), np.tile([0.0, -10.0, 0.0], (n, 1)), atol=1e-14)
    np.testing.assert_allclose(modelled_acceleration(vehicle, east)[:, 1], -10.0 / MASS_SIDEWAYS)


@pytest.mark.parametrize(
    ("axis", "symbol", "damping", "inertia"),
    [(1, "memory_sway", "Y_v", MASS_SIDEWAYS), (2, "memory_yaw", "N_r", INERTIA)],
)
def test_wake_memory_decay_against_the_matrix_exponential(axis: int, symbol: str, damping: str, inertia: float) -> None:
    """m nu' = -d nu - k q, T q' = nu - q, with q = nu at the start."""
    vehicle = boat(damping={damping: -12.0}, memory={symbol: 20.0, "memory_time": 1.5})
    start = [0.0, 0.0, 0.0]
    start[axis] = 0.5
    motion = sail(vehicle, start=tuple(start))
    system = np.array([[-12.0 / inertia, -20.0 / inertia], [1 / 1.5, -1 / 1.5]])
    expected = [(expm(system * t) @ [0.5, 0.5])[0] for t in motion.time[::50]]
    np.testing.assert_allclose(motion.velocity[::50, axis], expected, rtol=1e-6, atol=1e-9)
