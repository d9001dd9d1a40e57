"""What of the white noise on a motion a filter leaves, beside noise that is drawn."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.measurements.preparation.resampling import low_pass
from undertow.measurements.statistics.signals import drawn_noise, filtered_noise, sensor_noise
from undertow.physics.motion import Array
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

STEP = 0.1
LEVEL = np.array([0.02, 0.03, 0.01])


def smoothed(rows: Array) -> Array:
    return low_pass(rows, STEP, 1.2)


def test_what_a_filter_leaves_is_what_it_leaves_of_drawn_noise():
    plain = simulate_world(load_vehicle("blueboat"), {}, duration=120.0, noise="clean", seed=3).motion(STEP)
    motion = replace(plain, derived=(False, True, False))
    rng = np.random.default_rng(1)
    drawn = np.mean([smoothed(one) ** 2 for one in drawn_noise(motion, LEVEL, rng, 40)], axis=(0, 1))
    left = filtered_noise(motion, LEVEL, smoothed)
    assert left == pytest.approx(drawn, rel=0.05)
    white = filtered_noise(plain, LEVEL, smoothed)
    assert white[1] > 1.5 * left[1]  # a derivative has little that is slow


def test_records_that_are_rarer_than_rows_have_slower_noise_and_more_is_left_of_it():
    """Positions of a log of 5 Hz, differenced at its own pace and laid onto rows of 10 Hz."""
    still = replace(simulate_world(load_vehicle("blueboat"), {}, duration=400.0, noise="clean", seed=3).motion(STEP))
    rows = np.arange(still.time.size)
    places = np.random.default_rng(2).standard_normal((rows[::2].size, 2)) * 0.012
    speeds = np.column_stack([np.interp(rows, rows[::2], np.gradient(own, 2 * STEP)) for own in places.T])
    derived = (True, True, False)
    noisy = replace(
        still,
        velocity=np.column_stack([speeds, 0.3 * np.sin(STEP * rows)]),
        derived=derived,
        record_step=(2 * STEP, 2 * STEP, 0.0),
        past=None,
    )
    alone = replace(noisy, record_step=(0.0, 0.0, 0.0))
    assert sensor_noise([noisy])[2] == sensor_noise([alone])[2], "a gyro that has its own pace"
    told = filtered_noise(noisy, sensor_noise([noisy]), smoothed)[:2]
    assert told == pytest.approx((smoothed(speeds) ** 2).mean(axis=0), rel=0.2)
    understated = replace(noisy, record_step=(0.0, 0.0, 0.0))
    assert (filtered_noise(understated, sensor_noise([understated]), smoothed)[:2] < 0.3 * told).all()
