"""Means and medians about each row of a series."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...physics.frames import Array


def running_mean(values: Array, rows: int) -> Array:
    """The mean of so many rows about each one of `values` (n, ...), the ends mirrored; of an even number one before.

    >>> running_mean(np.array([0.0, 3.0, 6.0]), 3).tolist()
    [1.0, 3.0, 5.0]
    """
    around = [(rows // 2, rows - 1 - rows // 2), *[(0, 0)] * (values.ndim - 1)]
    total = np.cumsum(np.pad(values, around, mode="symmetric"), axis=0)
    total[rows:] -= total[:-rows].copy()
    return np.asarray(total[rows - 1 :] / rows)


def running_median(values: Array, rows: int) -> Array:
    """The median of an odd number of rows about each one of `values` (n, ...), the ends held.

    >>> running_median(np.array([0.0, 9.0, 1.0, 2.0]), 3).tolist()
    [0.0, 1.0, 2.0, 2.0]
    """
    around = [(rows // 2, rows // 2), *[(0, 0)] * (values.ndim - 1)]
    windows = sliding_window_view(np.pad(values, around, mode="edge"), rows, axis=0)
    return np.asarray(np.median(windows, axis=-1))
