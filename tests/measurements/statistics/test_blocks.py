"""Errors that count blocks, and draws of whole blocks."""

import numpy as np
import pytest

from undertow.measurements.statistics.blocks import (
    block_draws,
    block_scores,
    robust_squares,
    sandwich,
    share_of_draws,
    spread,
)
from undertow.measurements.statistics.signals import noise_of_differences, turning_point

RNG = np.random.default_rng(4)


def test_the_sandwich_of_a_mean_is_the_error_of_the_means_of_blocks():
    block = np.repeat(np.arange(50), 8)
    errors = RNG.normal(size=50)[block]
    errors -= errors.mean()
    column = np.ones((400, 1))
    covariance = sandwich(np.array([[1.0 / 400.0]]), block_scores(column, errors, block))
    assert covariance[0, 0] == pytest.approx(errors[::8].var(ddof=1) / 50.0)


def test_neighbours_that_err_alike_add_to_the_sandwich():
    scores, one = np.array([[1.0], [1.0], [-1.0], [-1.0]]), np.ones((1, 1))
    alone = sandwich(one, scores, spare=4)
    beside = sandwich(one, scores, spare=4, neighbours=np.array([True, False, True]))
    assert (alone[0, 0], beside[0, 0]) == (4.0, 6.0)


def test_every_resample_draws_as_many_blocks_as_there_are():
    drawn = block_draws(7, 30, 5)
    assert drawn.shape == (30, 7)
    assert (drawn.sum(axis=1) == 7).all()
    assert np.array_equal(drawn, block_draws(7, 30, 5))
    assert not np.array_equal(drawn, block_draws(7, 30, 6))


def test_no_share_of_draws_is_certain():
    assert (share_of_draws(np.zeros(9, dtype=bool)), share_of_draws(np.ones(9, dtype=bool))) == (0.05, 0.95)


def test_a_curve_turns_where_its_parabola_does():
    place = 0.3
    assert turning_point(*(-((x - place) ** 2) for x in (-1.0, 0.0, 1.0))) == pytest.approx(place)
    assert turning_point(1.0, 2.0, 3.0) == 0.0


@pytest.mark.parametrize("order", [2, 3])
def test_white_noise_is_told_from_differences_of_any_order(order: int):
    smooth = np.linspace(0.0, 1.0, 4000) ** 2
    noisy = smooth + 0.02 * RNG.normal(size=smooth.size)
    assert noise_of_differences(np.diff(noisy, order), order) == pytest.approx(0.02, rel=0.1)


def test_false_rows_do_not_sway_a_robust_fit():
    column = RNG.normal(size=(500, 1))
    target = 2.0 * column[:, 0] + 0.1 * RNG.normal(size=500)
    target[::25] = 40.0
    found, weight, _ = robust_squares(column, target)
    assert found[0] == pytest.approx(2.0, abs=0.05)
    assert weight[0] < 0.02 < weight[1]
    assert float(spread(target - column[:, 0] * 2.0)) == pytest.approx(0.1, rel=0.2)
