"""Averages over time steps: against sums on a fine grid, and where rounding would show."""

import numpy as np
import pytest

from undertow.physics.sampled_series import area_average, understated_noise


@pytest.mark.parametrize("hold", [True, False])
def test_area_average_is_the_mean_of_the_series(hold: bool) -> None:
    rng = np.random.default_rng(0)
    time = np.sort(rng.uniform(0, 10, 40))
    value = rng.normal(size=(40, 2))
    grid = np.linspace(-0.5, 10.5, 23)
    fine = (np.arange(200_000) + 0.5) * (12.0 / 200_000) - 1.0
    if hold:
        series = value[np.clip(np.searchsorted(time, fine, side="right") - 1, 0, None)]
    else:
        series = np.column_stack([np.interp(fine, time, column) for column in value.T])
    averages = area_average(time, value, grid, 0.4, hold=hold)
    for t, mean in zip(grid, averages, strict=True):
        np.testing.assert_allclose(mean, series[np.abs(fine - t) < 0.2].mean(axis=0), atol=1e-3)
    np.testing.assert_array_equal(area_average(time, value[:, 0], grid, 0.4, hold=hold), averages[:, 0])
    np.testing.assert_allclose(area_average(time, value, np.array([-3.0, 13.0]), 0.4, hold=hold), value[[0, -1]])


def test_area_average_keeps_constants_the_range_and_the_area_of_a_pulse() -> None:
    grid = 0.1 * np.arange(50, dtype=float)
    assert (area_average(np.array([0.0, 1.0]), np.array([1500.0, 1500.0]), grid, 0.1) == 1500.0).all()
    pulse = area_average(np.array([0.0, 2.013, 2.047]), np.array([0.0, 1.0, 0.0]), grid, 0.1)
    assert pulse.sum() * 0.1 == pytest.approx(0.034)
    time = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.09, 20_000))
    saturated = np.where(np.arange(time.size) % 200 < 100, 35.0, -0.1)
    average = area_average(time, saturated, 0.05 * np.arange(20_000, dtype=float), 0.05)
    assert (average.min(), average.max()) == (-0.1, 35.0)


@pytest.mark.parametrize(("jitter", "shift"), [(0.0, 0.0), (0.08, 0.0), (0.3, 0.2), (0.0, 0.3)])
def test_noise_of_readings_is_told_from_differences_on_the_grid(jitter: float, shift: float):
    rng = np.random.default_rng(1)
    time = np.arange(400_000.0) + np.clip(jitter * rng.standard_normal(400_000), -0.45, 0.45)
    grid = np.arange(10.0, 399_990.0) + shift
    rows = np.interp(grid, time, rng.standard_normal(time.size))
    told = np.var(np.diff(rows, 3)) / 20.0
    met = rows.var() + 2.0 * sum(np.mean(rows[:-lag] * rows[lag:]) for lag in (1, 2, 3))
    assert told * understated_noise(time, grid) == pytest.approx(met, rel=0.02)
    assert jitter + shift == 0.0 or told < 0.9 * met


def test_readings_faster_than_the_grid_share_no_noise():
    time, grid = np.arange(0.0, 100.0, 0.2), np.arange(2.0, 98.0) + 0.1
    assert understated_noise(time, grid) == pytest.approx(1.0)
