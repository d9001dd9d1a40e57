"""How much of a series another one tells, seen through its means over parts of the other's range."""

import numpy as np

from .frames import Array

BINS = 14
"""Parts of a range: few enough for rows in each of a log of minutes, enough to bend a line like a square."""


def binned_means(values: Array, series: Array, least: int = 1) -> tuple[Array, Array]:
    """Middles of the parts of the range of `values` (n,), and means of `series` (n,) there.

    The outermost parts hold all that is beyond the range of all but one row in a hundred.

    Parameters
    ----------
    least : rows that a part must have to be given
    """
    low, high = np.quantile(values, (0.005, 0.995))
    edges = np.linspace(low, high if high > low else low + 1.0, BINS + 1)
    part = np.clip(np.searchsorted(edges, values) - 1, 0, BINS - 1)
    count = np.bincount(part, minlength=BINS)
    enough = count >= least
    return 0.5 * (edges[1:] + edges[:-1])[enough], np.bincount(part, series, BINS)[enough] / count[enough]


def told_by(values: Array, series: Array) -> float:
    """Share of the variance of `series` (n,) that its means over parts of the range of `values` (n,) take.

    0 where the values do not differ.
    """
    low, high = np.quantile(values, (0.005, 0.995))
    if not high > low:
        return 0.0
    middles, means = binned_means(values, series)
    part = np.abs(values[:, None] - middles).argmin(axis=1)
    return 1.0 - float(np.square(series - means[part]).mean()) / max(float(series.var()), 1e-300)
