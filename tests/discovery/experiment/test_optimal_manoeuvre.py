"""The shortest manoeuvre that tells two effects apart: within its bounds, sooner than the library, and honest."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.candidates.candidate import candidates, measurable
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.weighing import CERTAINLY
from undertow.discovery.experiment import optimal_manoeuvre
from undertow.discovery.experiment.optimal_manoeuvre import (
    ENOUGH,
    LEAST_SECONDS,
    Bounds,
    Driven,
    Limit,
    find_shortest,
    separation_probability,
    within_bounds,
)
from undertow.discovery.experiment.separation import OpenQuestion, Rehearsed, open_question
from undertow.discovery.identifiability.rehearsal import plausible_amounts, rehearse
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.discovery.search.scoring import TELL_APART
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.manoeuvres import REST, TRIALS, Trial, drive, hold, in_words, thruster_commands
from undertow.physics.worlds.world import NOISE, Orders, World

HULL = load_vehicle("blueboat_paper")
TRUE = apply_effects(HULL, {"surge_quadratic_damping": (-6.0,)})
PAIR = ("surge_quadratic_damping", "surge_linear_damping")


@pytest.fixture(scope="module")
def steady() -> World:
    """Straight at one speed: of two kinds of drag nobody can say which."""
    commands = thruster_commands(HULL, *hold((60.0, 0.45, 0.0)).T)
    return World(TRUE, duration=59.9, seed=4, orders=Orders(commands, 0.3))


@pytest.fixture(scope="module")
def question(steady: World) -> OpenQuestion:
    motion = steady.run(NOISE["field"]).motion(0.05)
    pool = [c for c in candidates(HULL, measurable([motion])) if c.key in (*PAIR, "thrust_scale", "wake_memory")]
    search = Search(WeakForm([motion], WeakSettings()), HULL, pool, SearchSettings())
    state = search.evaluate(TRUE, PAIR[:1])
    plausible = plausible_amounts(search, rehearse(search, HULL, ()))
    return open_question(search, state, PAIR, plausible)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few generations show as much as many."""
    monkeypatch.setattr(optimal_manoeuvre, "_GENERATIONS", 6)
    monkeypatch.setattr(optimal_manoeuvre, "_POPULATION", 24)


def test_both_models_may_be_true_and_each_parts_from_the_other(question: OpenQuestion):
    assert [key for key, _ in question.truths] == list(PAIR)
    first, second = (state.vehicle for _, state in question.truths)
    assert first.value("X_u") == HULL.value("X_u") != second.value("X_u")
    assert second.value("X_uu") == HULL.value("X_uu") != first.value("X_uu")
    found = question.rehearse(TRIALS)
    assert found.gain.min() > 0.0
    run = drive(first, TRIALS, question.heading)[0][0]
    assert found.reach[0] >= np.hypot(*(run.position - run.position[0]).T).max()


@pytest.mark.usefixtures("quick")
def test_it_settles_the_question_within_bounds_and_sooner_than_the_library(question: OpenQuestion):
    bounds = Bounds(speed=2.5, space=12.0, thrust=0.8, seconds=60.0)
    found = find_shortest(question, bounds, seed=1)
    best = found.best
    assert found.tells
    assert min(best.gains) >= ENOUGH
    assert best.probability > 0.95
    assert LEAST_SECONDS <= best.seconds <= bounds.seconds
    assert best.seconds < found.fixed.seconds
    assert best.reach <= 0.9 * bounds.space
    assert best.speed <= 0.9 * bounds.speed
    coasting = [replace(best.trial, steps=(*best.trial.steps, (REST, 0.0, 0.0)))]
    ways = [drive(state.vehicle, coasting, question.heading)[0][0].position for _, state in question.truths]
    assert best.reach >= max(np.hypot(*(way - way[0]).T).max() for way in ways) - 1e-9
    assert all(abs(common) + abs(turn) <= bounds.thrust + 1e-9 for _, common, turn in best.trial.steps)
    again = find_shortest(question, bounds, seed=1)
    assert again.best.trial.steps == best.trial.steps


@pytest.mark.usefixtures("quick")
def test_what_it_promises_it_keeps(steady: World, question: OpenQuestion):
    """The true boat drives it, and discovery then names the true effect."""
    log = steady.run(NOISE["field"]).motion(0.05)
    before = find_missing([log], HULL).findings
    assert PAIR[0] not in before.missing
    best = find_shortest(question, Bounds(), seed=2).best
    levels = hold((5.0, 0.0, 0.0), *best.trial.steps, (5.0, 0.0, 0.0))
    commands = thruster_commands(HULL, *levels.T)
    driven = World(TRUE, duration=0.1 * (len(commands) - 1), seed=9, orders=Orders(commands, 0.3))
    after = find_missing([log, driven.run(NOISE["field"]).motion(0.05)], HULL).findings
    assert after.missing == PAIR[:1]


@pytest.mark.usefixtures("quick")
def test_where_a_limit_forbids_it_that_limit_is_named(question: OpenQuestion):
    found = find_shortest(question, Bounds(space=0.02), seed=0)
    assert not found.tells
    assert found.best.probability < 0.5
    assert Limit.SPACE in found.binding
    assert Limit.SECONDS not in found.binding


class FewCanTell:
    """Two models: every manoeuvre tells the first, and of the second only an optimised one of 30 s and longer."""

    truths = (("first", None), ("second", None))

    def rehearse(self, trials: Sequence[Trial]) -> Rehearsed:
        able = [t.name == "optimised" and t.seconds >= 30.0 for t in trials]
        gain = np.array([np.full(len(trials), 2.0 * ENOUGH), np.where(able, ENOUGH, 0.1)])
        return Rehearsed(gain, np.ones(len(trials)), np.ones(len(trials)))


@pytest.mark.usefixtures("quick")
def test_hopeless_is_what_nothing_that_was_tried_would_tell():
    found = find_shortest(FewCanTell(), Bounds())  # type: ignore[arg-type]
    assert found.best.seconds < 30.0
    assert found.best.gains[1] < TELL_APART
    assert not found.hopeless
    assert find_shortest(FewCanTell(), Bounds(seconds=20.0)).hopeless == ("second",)  # type: ignore[arg-type]


def test_its_probability_is_that_of_a_normal_ratio():
    assert separation_probability(CERTAINLY) == pytest.approx(0.5)
    assert separation_probability(0.0) == 0.0
    rng = np.random.default_rng(0)
    drawn = rng.normal(ENOUGH, np.sqrt(2.0 * ENOUGH), 200_000)
    assert separation_probability(ENOUGH) == pytest.approx((drawn > CERTAINLY).mean(), abs=2e-3)
    assert Driven(TRIALS[0], (CERTAINLY, 0.0), 0.0, 0.0).probability == pytest.approx(0.25)


def test_steps_are_rounded_within_thrust_and_time():
    rng, bounds = np.random.default_rng(3), Bounds(thrust=0.47, seconds=21.0)
    for _ in range(300):
        drawn = [(s, c, t) for s, c, t in rng.uniform((0.0, -2.0, -2.0), (30.0, 2.0, 2.0), (6, 3)).tolist()]
        steps = within_bounds(drawn, bounds)
        assert sum(step[0] for step in steps) <= bounds.seconds
        for seconds, common, turn in steps:
            assert abs(common) + abs(turn) <= bounds.thrust
            assert (2.0 * seconds) % 1.0 == 0.0
            assert 20.0 * common == pytest.approx(round(20.0 * common))
            assert 20.0 * turn == pytest.approx(round(20.0 * turn))
        assert all(a[1:] != b[1:] for a, b in pairwise(steps))


def test_the_words_say_what_the_steps_are():
    steps = ((4.0, 0.6, -0.25), (2.5, 0.0, 0.0), (3.0, -0.4, 0.0))
    assert Trial("test", in_words(steps), steps).text == (
        "60 % ahead with 25 % differential thrust to port for 4 s, no thrust for 2.5 s, 40 % astern for 3 s (10 s in "
        "all)"
    )


def test_an_effect_that_the_log_does_not_show_is_supposed_to_be_of_a_plausible_size(question: OpenQuestion):
    state = replace(question.truths[0][1])
    alone = open_question(question.search, state, ["surge_linear_damping"], question.plausible)
    assert alone.supposed
    assert not question.supposed
    (other,) = alone.look_alikes
    assert other.value("X_u") != state.vehicle.value("X_u")
    assert alone.rehearse(TRIALS[:2]).gain.min() > 0.0


def test_unknown_effects_are_refused(question: OpenQuestion):
    state = question.truths[0][1]
    with pytest.raises(RequestError, match="did you mean 'surge_linear_damping'"):
        open_question(question.search, state, ["surge_linear_dampin"], question.plausible)
    with pytest.raises(RequestError, match="expected different effects"):
        open_question(question.search, state, ["surge_linear_damping"] * 2, question.plausible)
