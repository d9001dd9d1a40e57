"""Paired intervals: they cover the truth on errors that are alike in time, and equal models are seldom told apart."""

import importlib.util
import sys

import numpy as np
import pytest
from places import ROOT

from undertow.measurements.statistics.blocks import block_length, paired_difference, paired_ratio

RNG = np.random.default_rng(7)
SPEC = importlib.util.spec_from_file_location("paired_benchmark", ROOT / "benchmarks" / "paired.py")
assert SPEC is not None
assert SPEC.loader is not None
STUDY = sys.modules[SPEC.name] = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(STUDY)
Case, process, simulate = STUDY.Case, STUDY.process, STUDY.simulate


@pytest.mark.parametrize(
    "case",
    [Case(36.0, 1.0), Case(135.0, 0.3), Case(135.0, 3.0), Case(45.0, 1.0, 1.0, 10.0), Case(36.0, 0.3, 0.7)],
    ids=lambda case: f"{case.seconds:g} s, memory {case.memory:g} s, ratio {case.ratio:g}, horizon {case.horizon:g} s",
)
def test_intervals_cover_and_equal_models_are_seldom_told_apart(case):
    done = simulate(case, 400, seed=1)
    assert done.told == 1.0
    assert 0.92 <= done.covers <= 0.995  # 95 %, within what 400 trials scatter and what is promised
    if case.ratio == 1.0:
        assert done.claims <= 0.08
    else:
        assert done.claims > 0.9


def test_rows_taken_for_independent_would_call_noise_a_win():
    wins = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        common, one, other = (process(rng, 360, 1.0) for _ in range(3))
        squares = np.square([common + one, common + other])
        half = 1.96 * np.std(squares[0] - squares[1]) / np.sqrt(360)
        wins += abs(float(np.mean(squares[0] - squares[1]))) > half
    assert wins > 0.3 * 200


def test_a_model_against_itself_does_not_differ():
    squares = RNG.normal(size=500) ** 2
    done = paired_difference(squares, squares)
    assert (done.difference, done.relative, done.ci95) == (0.0, 0.0, (0.0, 0.0))
    assert done.verdict == "no difference"


def test_a_sure_difference_below_one_per_cent_is_none():
    squares = RNG.normal(size=2000) ** 2
    assert paired_difference(squares * 0.995**2, squares).verdict == "no difference"
    assert paired_difference(squares * 0.98**2, squares).verdict == "better"
    assert paired_difference(squares / 0.98**2, squares).verdict == "worse"


def test_the_difference_is_in_the_unit_of_the_error():
    squares = 4.0 * RNG.normal(size=3000) ** 2
    other = squares * RNG.uniform(0.2, 0.3, 3000)
    done = paired_difference(other, squares)
    assert done.difference == pytest.approx(np.sqrt(other.mean()) - np.sqrt(squares.mean()), rel=1e-12)
    assert done.relative == pytest.approx(-0.5, abs=0.01)
    assert done.ci95 is not None
    low, high = done.ci95
    assert low < done.difference < high < 0.0
    assert paired_ratio(np.stack([other] * 3, axis=1), np.stack([squares] * 3, axis=1)).relative == pytest.approx(
        done.relative, rel=1e-12
    )


def test_too_few_rollouts_tell_nothing():
    squares = RNG.uniform(1.0, 2.0, size=39)
    done = paired_difference(0.01 * squares, squares, shortest=20)
    assert (done.ci95, done.verdict, done.blocks) == (None, "too short to tell", 1)
    assert paired_difference(0.01 * squares[:-1], squares[:-1], shortest=19).verdict == "better"


def test_one_long_spell_is_no_proof():
    better = np.ones(600)
    better[:200] = 0.2  # better in one stretch, and nobody knows whether there will be another
    assert paired_difference(better, np.ones(600)).verdict == "no difference"


def test_errors_of_nothing_are_no_trouble():
    nothing = np.zeros(300)
    assert paired_difference(nothing, nothing).verdict == "no difference"
    assert paired_difference(nothing, np.ones(300)).verdict == "better"


def test_blocks_grow_with_the_memory_of_the_errors():
    lengths = [block_length(process(np.random.default_rng(3), 3000, memory) ** 2) for memory in (0.0, 0.3, 1.0, 3.0)]
    assert lengths == sorted(lengths)
    assert lengths[0] <= 5
    assert lengths[-1] >= 40
