"""The margin of a network's acceleration: as large as what it did not learn says, and wider beyond its training."""

import numpy as np
import pytest

from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.interval import Interval, calibrated, least_known, widening


def errors(rows: int, seed: int, times: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Sizes and errors of rows: in surge these grow with the second size, in sway with nothing."""
    rng = np.random.default_rng(seed)
    found = np.column_stack([np.ones(rows), rng.uniform(0.0, 5.0, (rows, 2))])
    scale = np.column_stack([0.1 + found[:, 1], np.full(rows, 0.3), 0.01 + 0.1 * found[:, 2]])
    return found, times * scale * rng.standard_normal((rows, 3))


def test_margins_grow_with_what_the_errors_grow_with() -> None:
    told = np.array(calibrated(*errors(4000, 0, times=0.5), *errors(2000, 1)))
    found, error = errors(20000, 2)
    margin = found @ told.T
    for small in (found[:, 1] < 1.0, found[:, 1] > 4.0):
        assert (np.abs(error) <= margin)[small].mean(axis=0) == pytest.approx(0.955, abs=0.03)
    assert told[1, 1:] * 5.0 == pytest.approx([0.0, 0.0], abs=0.1), "sway errs alike at all sizes"


def test_few_rows_that_disagree_make_margins_wider() -> None:
    found, error = errors(400, 3)
    calm = np.array(calibrated(found, error, found, error))
    patchy = error * np.repeat([0.2, 1.8], 200)[:, None]
    assert (np.array(calibrated(found, error, found, patchy)) > 1.6 * calm)[:, 0].all()


def test_rows_beside_others_beyond_the_training_are_as_little_known() -> None:
    motion = simulate_world(load_vehicle("blueboat"), {}, duration=10.0, seed=1).motion(0.1)
    beyond = np.zeros(motion.time.size)
    beyond[50] = 2.0
    weight, distance = least_known(motion, 1.0 - 0.5 * beyond, beyond)
    assert np.flatnonzero(distance).tolist() == list(range(45, 56)), "half a second to either side"
    assert set(distance) == {0.0, 2.0}
    assert (weight == 1.0 - 0.5 * distance).all()


def test_beyond_the_training_the_vehicles_margin_takes_over_and_widens() -> None:
    one, two = ((0.1, 0.0),) * 3, ((0.3, 0.0),) * 3
    interval = Interval(level=0.95, learnt=one, alone=two, wider=(1.0, 1.0, 2.0))
    margin = interval.margin(np.ones((3, 2)), np.repeat([[1.0], [0.5], [0.0]], 3, axis=1), np.array([0.0, 0.25, 1.0]))
    assert margin[:, 0] == pytest.approx([0.1, 0.2 * 1.25, 0.3 * 2.0])
    assert margin[:, 2] == pytest.approx([0.1, 0.2 * 1.25 * 2.0, 0.3 * 2.0 * 2.0])
    assert widening(np.full((50, 3), 0.4), np.full((50, 3), 0.2)).tolist() == [2.0, 2.0, 2.0]
    assert widening(np.full((50, 3), 0.1), np.full((50, 3), 0.2)).tolist() == [1.0, 1.0, 1.0]
