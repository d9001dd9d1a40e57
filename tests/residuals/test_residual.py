"""Residuals and scores against closed forms and against models whose errors are known."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.measurements.preparation.prepare import WEAK, DataSet, Recipe
from undertow.measurements.preparation.resampling import low_pass, smooth
from undertow.physics.integration import simulate_motion
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.scores import acceleration_score, evaluate, residual, rollout_scores, speed_noise

HULL = load_vehicle("blueboat")
MODEL = VehicleModel(HULL, "truth")


@pytest.fixture(scope="module")
def world() -> Motion:
    """A minute of noise-free motion, simulated on the very grid of the scores."""
    start = simulate_world(HULL, {}, duration=60.0, noise="clean", seed=2).motion(0.1)
    return simulate_motion(HULL, start)


def raw(motion: Motion) -> DataSet:
    return DataSet((motion,), (), WEAK)


def test_the_true_model_rolls_out_without_error(world: Motion):
    scores = rollout_scores(MODEL, raw(world))
    assert set(scores) == {"2", "10", "30"}
    for score in scores.values():
        assert score.velocity.max() < 1e-12
        assert score.position < 1e-11
        assert score.diverged == 0


def test_every_start_with_room_counts_once(world: Motion):
    rows = world.time.size
    for name, seconds in (("2", 2.0), ("10", 10.0), ("30", 30.0)):
        room = rows - round(seconds / world.time_step)
        assert rollout_scores(MODEL, raw(world))[name].starts == len(range(0, room, 5))


def test_horizons_longer_than_every_motion_are_left_out(world: Motion):
    assert set(rollout_scores(MODEL, raw(world.slice(0, 150)))) == {"2", "10"}


def test_a_constant_force_too_much_shows_with_its_size(world: Motion):
    wrong = VehicleModel(HULL.with_values({"yaw_trim": 2.0}), "wrong")
    found = residual(wrong.vehicle, world, raw(world))
    assert np.median(found.force[:, 2]) == pytest.approx(-2.0, abs=0.02)
    expected = (np.linalg.inv(mass_matrix(HULL)) @ [0.0, 0.0, 2.0])[2]
    assert acceleration_score(wrong, raw(world)).rmse[2] == pytest.approx(expected, rel=0.1)


def test_r2_is_one_for_a_perfect_model_and_nan_with_nothing_to_explain(world: Motion):
    assert acceleration_score(MODEL, raw(world)).r2 == pytest.approx(1.0, abs=2e-2)
    zero = np.zeros(200)
    pair = np.zeros((200, 2))
    still = Motion(0.1 * np.arange(200, dtype=float), pair, zero, np.zeros((200, 3)), pair, world.thrusters)
    score = acceleration_score(MODEL, raw(still))
    assert np.isnan(score.r2).all()
    assert score.rmse == pytest.approx(0.0)


def test_the_definitions_are_the_usual_ones(world: Motion):
    score = acceleration_score(VehicleModel(HULL.with_values({"X_u": -30.0}), "draggy"), raw(world))
    measured = np.gradient(world.velocity, 0.1, axis=0, edge_order=2)
    modelled = VehicleModel(HULL.with_values({"X_u": -30.0}), "draggy").acceleration(world)
    error = measured - modelled
    assert score.rmse == pytest.approx(np.sqrt((error**2).mean(axis=0)))
    assert score.mae == pytest.approx(np.abs(error).mean(axis=0))
    assert score.r2 == pytest.approx(1.0 - (error**2).mean(axis=0) / measured.var(axis=0))


def test_both_sides_pass_the_same_filter(world: Motion):
    recipe = Recipe(rate=10.0, cutoff=1.2)
    filtered = DataSet((smooth(world, 1.2),), (), recipe, (world,))
    unfair = acceleration_score(MODEL, DataSet(filtered.motions, (), WEAK)).rmse
    assert (acceleration_score(MODEL, filtered).rmse < 0.8 * unfair).all()


@pytest.mark.parametrize("cutoff", [None, 1.2])
def test_the_noise_on_the_judged_speeds_is_told_without_the_true_ones(world: Motion, cutoff: float | None):
    """Third differences of 600 rows know the square of noise to a tenth."""
    size, rng = np.array([0.02, 0.05, 0.01]), np.random.default_rng(3)
    noisy = replace(world, velocity=world.velocity + size * rng.standard_normal(world.velocity.shape))
    white = rng.standard_normal(20_000)
    left = white.var() if cutoff is None else low_pass(white, world.time_step, cutoff).var()
    data = DataSet((noisy if cutoff is None else smooth(noisy, cutoff),), (), replace(WEAK, cutoff=cutoff), (noisy,))
    assert speed_noise(data) == pytest.approx(left * size**2, rel=0.2)


def test_divergence_is_counted_by_horizon(world: Motion):
    slow_runaway = VehicleModel(HULL.with_values({"X_u": 60.0, "X_uu": 0.0}), "runaway")
    scores = rollout_scores(slow_runaway, raw(world))
    assert scores["2"].diverged == 0
    assert scores["10"].diverged <= scores["30"].diverged
    assert scores["30"].diverged > 0


def test_a_runaway_rollout_is_counted_and_stays_finite(world: Motion):
    runaway = VehicleModel(HULL.with_values({"X_u": 400.0}), "runaway")
    score = rollout_scores(runaway, raw(world))["10"]
    assert score.diverged > 0
    assert np.isfinite(score.velocity).all()


def test_what_noise_of_a_start_makes_of_a_prediction_is_that_of_the_equation():
    """A surge speed that is off decays with the drag: exp(-t / T) of it is left, of its square a known part."""
    lost = 4.0  # N s/m
    hull = HULL.with_values({"X_u": -lost, "X_uu": 0.0, "Y_v": -lost, "Y_vv": 0.0, "N_rr": 0.0})
    rows = 3000
    size, rng = 0.02, np.random.default_rng(5)
    speeds = np.column_stack([size * rng.standard_normal(rows), np.zeros((rows, 2))])
    time, still = 0.1 * np.arange(rows, dtype=float), np.zeros((rows, 2))
    motion = Motion(time, still, np.zeros(rows), speeds, still, tuple(t.name for t in hull.thrusters))
    made = evaluate(VehicleModel(hull, "drag"), raw(motion), (10.0,)).rollouts["10"].started
    noise = speed_noise(raw(motion))[0]
    faster = 2.0 * lost / mass_matrix(hull)[0, 0]
    assert made[0] == pytest.approx(noise * (1.0 - np.exp(-10.0 * faster)) / (10.0 * faster), rel=0.2)
    assert made[1:3] == pytest.approx(0.0, abs=1e-6)
    sure = replace(motion, velocity=np.zeros((rows, 3)))
    assert not evaluate(VehicleModel(hull, "drag"), raw(sure), (10.0,)).rollouts["10"].started.any()
