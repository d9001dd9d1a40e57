"""Summands that are worked out once add up to what the force equation gives along the rows, whatever moves."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.base import Remembered
from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.physics.forces import modelled_acceleration, modelled_force, relative_velocity
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Hull, load_vehicle
from undertow.physics.worlds.hidden_effects import with_hull
from undertow.physics.worlds.world import simulate_world

HULL = with_hull(load_vehicle("blueboat"), np.random.default_rng(1))
MOVES = {
    "nothing": {},
    "hull": {"X_uu": -4.0, "N_ur": -0.5, "Y_ur": 2.0, "X_udot": -5.0, "x_g": 0.1, "surge:u^2|r|": 0.7},
    "across": {"cross_flow": 0.9, "fouling_rate": 0.1, "current_north": 0.2},
    "water": {"current_north": 0.3, "current_east": -0.2, "X_uu": -4.0},
    "wake": {"memory_sway": 8.0, "memory_yaw": 2.0, "memory_time": 1.5, "current_east": 0.1},
    "wind": {"wind_x": 0.4, "wind_y": 0.8, "wind_n": 0.1, "wind_force_north": 2.0, "yaw_trim": 0.3},
    "thrusters": {
        "port_scale": 0.8,
        "thrust_scale": 0.9,
        "reverse_scale": 0.6,
        "advance_loss": 1.5,
        "gain_ahead_33": 2.0,
    },
    "shapes": {"lag": 0.4, "delay": 0.25, "dead_zone": 0.1, "thrust_exponent": 1.3, "advance_loss": 0.5},
}


@pytest.fixture(scope="module")
def log() -> Motion:
    return simulate_world(HULL, {"steady_current": (0.2, -0.1)}, duration=40.0, noise="field", seed=3).motion()


@pytest.fixture(scope="module")
def windy(log: Motion) -> Motion:
    return replace(log, air=np.column_stack([np.full(log.time.size, 3.0), np.linspace(-2.0, 2.0, log.time.size)]))


@pytest.fixture(scope="module")
def weak(windy: Motion) -> WeakForm:
    return WeakForm([windy], WeakSettings())


@pytest.mark.parametrize("changes", MOVES.values(), ids=MOVES)
def test_the_balance_is_that_of_the_force_equation(weak: WeakForm, windy: Motion, changes: dict[str, float]):
    vehicle = HULL.with_values(changes)
    relative = np.stack(relative_velocity(vehicle, windy.heading, tuple(windy.velocity.T)), axis=-1)
    expected = weak.derivative([relative @ mass_matrix(vehicle)]) - weak.average([modelled_force(vehicle, windy)])
    np.testing.assert_allclose(weak.residual(vehicle), expected, rtol=1e-9, atol=1e-9)


def test_two_hulls_are_not_taken_for_one_another(weak: WeakForm, windy: Motion):
    """Products are remembered by what they depend on, and the force across a hull depends on its size."""
    one = HULL.with_values({"cross_flow": 0.9})
    other = one.model_copy(update={"hull": Hull(length=3.0, draught=0.3)})
    both = [weak.residual(vehicle) for vehicle in (one, other, one)]
    np.testing.assert_array_equal(both[0], both[2])
    forces = [modelled_force(vehicle, windy) for vehicle in (one, other)]
    np.testing.assert_allclose(both[0] - both[1], weak.average([forces[1] - forces[0]]), rtol=1e-8, atol=1e-9)


def test_the_order_in_which_models_are_asked_does_not_matter(weak: WeakForm):
    models = [HULL.with_values(changes) for changes in MOVES.values()]
    first = [weak.noisy_residuals(model) for model in models]
    again = [weak.noisy_residuals(model) for model in reversed(models)]
    assert all(np.array_equal(a, b) for a, b in zip(first, reversed(again), strict=True))
    assert first[0].shape[0] == 3  # the log, and two noisier copies
    assert np.abs(first[0][1:] - first[0][0]).max() > 0.0


@pytest.mark.parametrize("changes", [MOVES["hull"], MOVES["water"] | MOVES["wake"]], ids=["hull", "water and wake"])
def test_a_claim_stands_in_the_place_of_the_measurement(log: Motion, changes: dict[str, float]):
    vehicle = HULL.with_values(changes)
    claim = modelled_acceleration(vehicle, log)
    claims = WeakForm([log], WeakSettings(), [claim])
    np.testing.assert_allclose(claims.residual(vehicle), 0.0, atol=1e-9)
    expected = claims.average([(claim - modelled_acceleration(HULL, log)) @ mass_matrix(HULL)])
    np.testing.assert_allclose(claims.residual(HULL), expected, rtol=1e-9, atol=1e-9)


def test_the_response_of_a_thruster_is_in_proportion_to_its_gain_and_its_loss():
    thruster = HULL.with_values(MOVES["shapes"] | MOVES["thrusters"]).thrusters[0]
    command = np.linspace(-30.0, 35.0, 200)
    force, load = thruster.response(command, 0.05)
    unit_force, unit_load = thruster.unit.response(command, 0.05)
    np.testing.assert_allclose(force, thruster.gain * unit_force, rtol=1e-12)
    np.testing.assert_allclose(load, thruster.advance_loss * unit_load, rtol=1e-12)
    other = thruster.model_copy(update={"scale": 1.4, "advance_loss": 3.0})
    assert other.shape == thruster.shape
    assert thruster.model_copy(update={"lag": 0.5}).shape != thruster.shape


def test_what_is_remembered_is_bounded_in_bytes():
    kept: Remembered[np.ndarray] = Remembered(1000)
    asked: list[str] = []

    def ask(key: str, size: int = 50) -> None:
        def compute() -> np.ndarray:
            asked.append(key)
            return np.zeros(size)

        kept.of(key, compute)

    for key in "abac":  # 400 bytes each: two have room, and the one asked for longest ago goes
        ask(key)
    ask("a")
    ask("b")
    assert asked == ["a", "b", "c", "b"]
    ask("large", 1000)
    ask("large", 1000)
    assert asked[4:] == ["large"]
