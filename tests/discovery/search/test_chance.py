"""Rehearsals of nothing: chance is told as it is, for noise of any colour, on forces; on rollouts as a rank."""

import numpy as np
import pytest

from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.discover import find_missing
from undertow.discovery.search.floating import Search
from undertow.discovery.search.surrogates import SURROGATES, Chance, SurrogateTest
from undertow.measurements.statistics.processors import single_threaded
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


@single_threaded
def rehearsed(seed: int, effects: dict, *, active: tuple[str, ...] = (), rolls: bool = False, seconds: float = 200.0):
    """Rehearsals about the model with some effects, fitted to a log with field noise."""
    world = simulate_world(HULL, effects, programme="rich", duration=seconds, noise="field", seed=seed)
    basis = choose_balance([world.motion(0.05)], HULL, DiscoverySettings())
    basis = basis.with_rollouts("asked for") if rolls else basis
    search = Search(basis.balance(), HULL, basis.pool, basis.settings.search)
    state = search.evaluate(HULL, active)
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    now = {key: linear.options[key][0] for key in state.active}
    return SurrogateTest(search, linear, scores, now, 0)


def test_on_nothing_the_best_effect_is_one_of_the_rehearsed():
    """Shares of logs in which chance is told as rare are about these shares: that is what a chance is.

    Of rollouts it is told as a rank alone: beside what a compass may deviate by, one in four is among the best 5 %.
    """
    logs = [rehearsed(seed, {}, seconds=120.0) for seed in range(40, 52)]
    chances = np.array([log.best()[1].better / SURROGATES for log in logs])
    assert (chances < 0.05).mean() <= 0.25
    assert np.median(chances) > 0.1
    assert chances.max() > 0.5


@pytest.mark.parametrize("rolls", [False, True])
def test_what_is_there_is_never_met_by_chance(rolls):
    drag = {"surge_quadratic_damping": -8.0}
    found = rehearsed(3, drag, active=("surge_quadratic_damping",), rolls=rolls).chance("surge_quadratic_damping")
    assert found == Chance(better=0, of=SURROGATES, of_noise=not rolls)
    assert ("1 in 1,000" in found.in_words) != rolls


def test_what_is_not_there_is_met_by_chance():
    found = rehearsed(4, {}, active=("sway_lift",)).chance("sway_lift")
    assert found.better > 20


def test_an_effect_with_a_shape_is_rehearsed_with_it():
    found = rehearsed(5, {"input_delay": 0.4}, active=("input_delay",)).chance("input_delay")
    assert found.none
    assert rehearsed(5, {}, active=("input_delay",)).chance("input_delay").better > 20


def test_noise_with_a_colour_is_rehearsed_with_it():
    """What drifts for minutes meets a constant moment by chance: white copies of it never would."""
    rehearsals = rehearsed(6, {}, active=("yaw_trim",))
    white = rehearsals.chance("yaw_trim")
    places = rehearsals._columns.shape[0]
    slow = np.cumsum(np.random.default_rng(1).standard_normal(places))
    drift = (slow - slow.mean()) / slow.std() * 10.0 * np.abs(rehearsals._columns[:, 2, -1]).std()
    rehearsals._columns[:, 2, -1] += drift.astype(np.float32)
    rehearsals._gram[2] = rehearsals._columns[:, 2].T.astype(float) @ rehearsals._columns[:, 2]
    assert white.better > 0
    assert rehearsals.chance("yaw_trim").better > 20


def test_a_constant_force_is_no_noise():
    """Of the rest without it, copies have the noise alone: its mean is the force itself."""
    assert rehearsed(9, {"sway_trim": -3.0}, active=("sway_trim",), seconds=120.0).chance("sway_trim").none
    assert rehearsed(9, {}, active=("sway_trim",), seconds=120.0).chance("sway_trim").better > 20


def test_the_same_seed_rehearses_the_same():
    one, two = (rehearsed(7, {}, active=("sway_lift",)).chance("sway_lift") for _ in range(2))
    assert one == two


def test_findings_say_how_rare_it_is():
    world = simulate_world(HULL, {"surge_quadratic_damping": -8.0}, duration=150.0, noise="field", seed=8)
    findings = find_missing([world.motion(0.05)], HULL).findings
    (found,) = [effect for effect in findings.candidates if effect.verdict == "missing"]
    assert found.chance == Chance(better=0, of=SURROGATES)
    assert "1 in 1,000" in found.sentence
    assert findings.to_dict()["candidates"][0]["chance"] == {"better": 0, "of": 999}
