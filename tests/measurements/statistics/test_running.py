"""Means and medians about each row against SciPy's filters."""

import numpy as np
import pytest
from scipy.ndimage import median_filter, uniform_filter1d

from undertow.measurements.statistics.signals import running_mean, running_median

SERIES = np.random.default_rng(3).normal(size=(100, 3))


@pytest.mark.parametrize("rows", [1, 2, 7, 20, 150])
def test_the_mean_is_that_of_scipy(rows: int):
    np.testing.assert_allclose(running_mean(SERIES, rows), uniform_filter1d(SERIES, rows, axis=0), atol=1e-13)
    np.testing.assert_allclose(running_mean(SERIES[:, 0], rows), uniform_filter1d(SERIES[:, 0], rows), atol=1e-13)


@pytest.mark.parametrize("rows", [1, 5, 11])
def test_the_median_is_that_of_scipy(rows: int):
    assert np.array_equal(running_median(SERIES, rows), median_filter(SERIES, size=(rows, 1), mode="nearest"))
