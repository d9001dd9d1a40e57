"""From a claim to its odds: what speaks for a name raises them, a doubt lowers them, the file's own value rules."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from undertow.discovery.effect_findings import LIKELY, MISSING, Claim, Reason, Worth
from undertow.discovery.judgement import (
    REASONS,
    SHARE,
    SUPPORT,
    Logistic,
    calibrated,
    features,
    largest_doubt,
    odds,
    probability,
    share,
    verdict,
)

DOUBTS = (
    "file_value",
    "substitute",
    "at_limit",
    "out_of_step",
    "unexplained",
    "remains",
    "accused",
    "companions",
)
"""The tests of a claim by the names under which their sizes stand in it."""
CLEAR = Claim(
    gain=300.0,
    identity=200.0,
    rival="surge_trim",
    worth=Worth(force=0.6, rollout=0.6),
    null_excluded=True,
    tests={"file_value": 0.05, "substitute": -300.0},
)
"""A name for which everything speaks."""
TESTS = tuple(list(Reason)[list(Reason).index(Reason.FILE_VALUE) : list(Reason).index(Reason.WEAK) + 1])
EVEN = Logistic(0.0, {name: 1.0 if name in SUPPORT else -1.0 for name in REASONS})
"""Odds in which every feature counts."""

SETTINGS = settings(max_examples=100, deadline=None, derandomize=True, database=None)
sizes = some.dictionaries(some.sampled_from(DOUBTS), some.floats(0.0, 1e3), max_size=8)
made = some.builds(
    Claim,
    gain=some.floats(-50.0, 1e4),
    identity=some.floats(-200.0, 200.0),
    worth=some.builds(Worth, force=some.floats(0.0, 1.0), rollout=some.none() | some.floats(-1.0, 1.0)),
    null_excluded=some.booleans(),
    tests=sizes,
)


@SETTINGS
@given(claim=made, more=some.floats(0.0, 1e3), what=some.sampled_from(("gain", "identity")))
def test_what_speaks_for_a_name_never_lowers_its_odds(claim: Claim, more: float, what: str):
    better = claim.but(**{what: getattr(claim, what) + more})
    assert probability(better) >= probability(claim)
    assert EVEN.probability(features(better)) >= EVEN.probability(features(claim))


@SETTINGS
@given(claim=made, more=some.floats(0.0, 1.0))
def test_what_a_name_removes_of_the_error_never_lowers_its_odds(claim: Claim, more: float):
    force, rollout = claim.worth.force, claim.worth.rollout
    better = claim.but(worth=Worth(force=force + more, rollout=None if rollout is None else rollout + more))
    assert probability(better) >= probability(claim)
    assert EVEN.probability(features(better)) >= EVEN.probability(features(claim))


@SETTINGS
@given(claim=made, name=some.sampled_from(DOUBTS), more=some.floats(0.0, 1e3))
def test_no_doubt_ever_raises_the_odds(claim: Claim, name: str, more: float):
    usual = 1.0 if name == "file_value" else 0.0  # of a name without an interval, its end lies at the file's value
    worse = claim.but(tests={**claim.tests, name: claim.tests.get(name, usual) + more})
    assert probability(worse) <= probability(claim)
    assert EVEN.probability(features(worse)) <= EVEN.probability(features(claim))


@pytest.mark.parametrize("name", DOUBTS)
def test_every_test_of_a_claim_is_heard(name: str):
    """Each size moves a feature, and by it the odds in which all count."""
    doubted = CLEAR.but(tests={**CLEAR.tests, name: 1.0})
    assert features(doubted) != features(CLEAR)
    assert EVEN.probability(features(doubted)) < EVEN.probability(features(CLEAR))


@SETTINGS
@given(claim=made, chance=some.floats(0.0, 1.0))
def test_what_the_file_could_hold_is_neither_missing_nor_likely(claim: Claim, chance: float):
    inside = claim.but(null_excluded=False)
    assert verdict(inside, chance) == "possible"
    assert largest_doubt(inside) is Reason.FILE_VALUE


@pytest.mark.parametrize(
    ("chance", "word"),
    [
        (1.0, "missing"),
        (MISSING, "missing"),
        (0.94, "likely"),
        (LIKELY, "likely"),
        (0.79, "possible"),
        (0.0, "possible"),
    ],
)
def test_the_word_follows_the_probability(chance: float, word: str):
    assert verdict(CLEAR, chance) == word


def test_a_test_reaches_the_odds_under_its_own_doubt():
    assert set(TESTS) <= set(REASONS.values())
    assert set(REASONS.values()) <= set(TESTS), "what makes no claim is no doubt about one"


def test_the_fitted_odds_know_their_features_and_no_weight_has_the_wrong_sign():
    fitted = odds()
    for judge in (fitted.forces, fitted.rollouts):
        assert set(judge.weights) <= set(features(CLEAR)) - {SHARE} == set(REASONS)
        assert judge.weights
        for name, weight in judge.weights.items():
            assert weight >= 0.0 if name in SUPPORT else weight <= 0.0, name
    assert 0.0 < fitted.unselected < fitted.nearly < 0.5


def test_a_name_is_judged_by_the_model_of_its_judge():
    rolled = CLEAR.but(tests={**CLEAR.tests, "rolls": 1.0})
    assert odds().of(CLEAR) is odds().forces
    assert odds().of(rolled) is odds().rollouts
    said = odds().rollouts.probability(features(rolled))
    assert probability(rolled) == calibrated(said, odds().calibration) != probability(CLEAR)


def test_two_that_do_as_well_have_half_of_their_calibrated_probability_each():
    alone, tied = (CLEAR.but(identity=0.0, tests={**CLEAR.tests, "look_alikes": count}) for count in (0.0, 1.0))
    assert share(tied) == 0.5
    assert probability(tied) == pytest.approx(0.5 * probability(alone))
    assert 0.4 < probability(tied) < 0.5


@given(some.tuples(some.floats(-5.0, 5.0), some.floats(0.0, 5.0), some.floats(0.0, 5.0)))
def test_a_calibration_keeps_the_order_of_names(calibration: tuple[float, float, float]):
    chances = np.linspace(0.0, 1.0, 101)
    told = calibrated(chances, calibration)
    assert np.all(np.diff(told) >= 0.0)
    assert np.all((told >= 0.0) & (told <= 1.0))


def test_a_calibration_of_nothing_changes_nothing_and_another_is_that_of_its_equation():
    chances = np.array([0.01, 0.3, 0.5, 0.99])
    assert calibrated(chances, (0.0, 1.0, 1.0)) == pytest.approx(chances)
    shift, low, high = -1.0, 0.5, 1.5
    told = 1.0 / (1.0 + (1.0 - chances) ** high / (np.exp(shift) * chances**low))
    assert calibrated(chances, (shift, low, high)) == pytest.approx(told)


def test_what_everything_speaks_for_is_missing_and_a_stand_in_is_not():
    assert verdict(CLEAR, probability(CLEAR)) == "missing"
    stand_in = CLEAR.but(
        identity=-20.0,
        tests={"file_value": 0.3, "substitute": 300.0, "unexplained": 0.8, "remains": 0.8},
    )
    assert probability(stand_in) < LIKELY
    nothing = Claim(gain=0.0, identity=0.0, worth=Worth(force=0.0), null_excluded=False)
    assert probability(nothing) < probability(CLEAR)


@pytest.mark.parametrize("name", [name for name in REASONS if name not in SUPPORT])
def test_the_largest_doubt_is_the_one_that_costs_most(name: str):
    plenty = features(CLEAR)
    assert EVEN.largest_doubt({**plenty, name: 50.0}) is REASONS[name]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("identity", -6.0, Reason.LOOK_ALIKES),
        ("gain", -30.0, Reason.WEAK),
        ("worth", -30.0, Reason.WEAK),
        ("clear", -20.0, Reason.FILE_VALUE),
    ],
)
def test_little_that_speaks_for_a_name_is_a_doubt_too(name: str, value: float, reason: Reason):
    assert EVEN.largest_doubt({**features(CLEAR), name: value}) is reason


def test_two_halves_of_a_doubt_count_together():
    """Force and rollouts that are left are one doubt: larger than one in between."""
    told = {**features(CLEAR), "unexplained": 3.0, "remains": 3.0, "substitute": 4.0}
    assert EVEN.largest_doubt(told) is Reason.LASTING_REST
    assert EVEN.largest_doubt({**told, "remains": 0.0}) is Reason.SUBSTITUTE


def test_where_rollouts_were_not_asked_the_worth_in_force_stands_for_theirs():
    both, forces = (features(CLEAR.but(worth=Worth(force=0.3, rollout=there))) for there in (0.3, None))
    assert both == forces


def test_odds_without_a_feature_are_those_of_the_intercept():
    alone = Logistic(0.0, {})
    assert alone.probability(features(CLEAR)) == 0.5
    assert alone.largest_doubt(features(CLEAR)) is Reason.WEAK
    assert replace(alone, intercept=1e9).probability({}) == pytest.approx(1.0)
    assert replace(alone, intercept=-1e9).probability({}) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("word", "reason"),
    [
        ("doubtful_value", Reason.FILE_VALUE),
        ("worse_unseen", Reason.WEAK),
        ("mostly_doubted", Reason.LASTING_REST),
        ("not_in_most_folds", Reason.WEAK),
    ],
)
def test_words_of_earlier_files_are_read(word: str, reason: Reason):
    assert Reason(word) is reason
    with pytest.raises(ValueError, match="nonsense"):
        Reason("nonsense")
