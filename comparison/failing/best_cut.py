"""Where a regression tree cuts: the threshold that leaves the least squared error about the means of its two sides."""

import numpy as np

from .rows import Array

_APART = 1e-7
"""Two values that are nearer than this are one: single precision, in which trees are usually grown."""
_EQUAL = 1e-9
"""Share of what a cut tells within which two are alike, and the first is taken: a quantity that is nowhere negative and
its modulus part the rows alike, and rounding is not to choose between them."""


def best_cut(columns: Array, target: Array, least: int) -> tuple[int, float] | None:
    """The column and the threshold by which rows are best parted (Breiman et al. 1984, section 8.4).

    Parameters
    ----------
    columns : (n, k) quantities
    target : (n,) what the means of both sides should tell
    least : fewest rows on a side

    Returns
    -------
    Column and threshold, half-way between two values; None where there are too few rows, or nothing is to be parted.

    >>> best_cut(np.array([[0.0, 5.0], [1.0, 5.0], [2.0, 5.0], [3.0, 6.0]]), np.array([1.0, 1.0, 9.0, 9.0]), 1)
    (0, 1.5)
    """
    n = target.size
    if n < 2 * least or not np.ptp(target):
        return None
    order = np.argsort(columns, axis=0, kind="stable")
    values, below = np.take_along_axis(columns, order, axis=0), np.cumsum(target[order], axis=0)[:-1]
    count = np.arange(1, n)[:, None]
    told = below**2 / count + (target.sum() - below) ** 2 / (n - count)
    parted = (np.diff(values, axis=0) > _APART) & (count >= least) & (n - count >= least)
    if not parted.any():
        return None
    told = np.where(parted, told, -np.inf)
    column, row = np.argwhere((1.0 - _EQUAL) * told.max() <= told.T)[0]
    return int(column), float(0.5 * (values[row, column] + values[row + 1, column]))
