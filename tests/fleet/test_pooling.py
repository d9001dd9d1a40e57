"""Pooling: what boats share, what each has of its own, and which one differs."""

import numpy as np
import pytest
from scipy.stats import t as student

from undertow.fleet.boat_days import odd, pool


def test_without_noise_the_mean_has_the_interval_of_students_t():
    values = np.array([0.9, 1.0, 1.05, 1.2, 0.95])
    found = pool(values, np.full(5, 1e-5))
    half = student.isf(0.025, 4) * values.std(ddof=1) / np.sqrt(5)
    assert found.mean == pytest.approx(values.mean(), abs=1e-6)
    assert found.mean_interval == pytest.approx((values.mean() - half, values.mean() + half), rel=0.02)
    assert found.own == pytest.approx(values, abs=1e-6)


def test_boats_that_do_not_differ_are_drawn_together_and_gain_by_it():
    alone = 1.0 + 0.1 * np.random.default_rng(3).standard_normal(12)
    found = pool(alone, np.full(12, 0.1))
    widths = np.diff(found.own_interval, axis=1)[:, 0]
    assert widths.mean() < 0.85 * 2.0 * 1.96 * 0.1
    assert np.ptp(found.own) < 0.6 * np.ptp(alone)


def test_a_boat_that_says_nothing_is_not_known_and_does_not_differ():
    found = pool(np.array([1.0, 1.1, np.nan]), np.array([0.02, 0.02, np.inf]))
    assert np.isnan(found.own[2])
    assert found.chance[2] == 1.0


def test_only_the_boat_that_differs_is_told():
    values = np.append(1.0 + 0.03 * np.random.default_rng(1).standard_normal(11), 1.6)
    chances = np.column_stack([pool(values, np.full(12, 0.01)).chance, np.full(12, 0.4)])
    assert np.argwhere(odd(chances)).tolist() == [[11, 0]]
