"""Series of commands and forces in time: delayed, lagged, and put between two levels where a command switches."""

from typing import NamedTuple

import numpy as np

from .frames import Array

_BLOCK = 32
"""Rows of a recursion that are one product of matrices: a minute of log is few of them, and little arithmetic."""
_SINCE = np.arange(_BLOCK) - np.arange(_BLOCK)[:, None]
"""By how many rows one row of a block comes after another."""
_SAME = 1e-9
"""Share of the largest change of a command that is rounding of its mean over a row."""


class Switches(NamedTuple):
    """Rows in which a command switches from one held level to another, and the share of each that the second has.

    A level is held where two rows and more have it.
    """

    rows: np.ndarray
    share: Array

    def between(self, force: Array) -> Array:
        """Forces (..., n) of commands as if each had lasted, those of switches put between those of their levels.

        Such a row has the mean of both, as its command has, wherever in the row the switch was.
        """
        if not self.rows.size:
            return force
        found = force.copy()
        found[..., self.rows] = (1.0 - self.share) * force[..., self.rows - 1] + self.share * force[..., self.rows + 1]
        return found


def switches(command: Array) -> Switches:
    """Where a command (n,) switches, of which the rows hold means, in any unit."""
    change = np.abs(command[1:] - command[:-1])
    same = change <= _SAME * change.max(initial=0.0)
    rows = 2 + np.flatnonzero(same[:-3] & ~same[1:-2] & ~same[2:-1] & same[3:])
    gap = command[rows + 1] - command[rows - 1]
    share = np.divide(command[rows] - command[rows - 1], gap, out=np.zeros(rows.size), where=gap != 0.0)
    within = (share > 0.0) & (share < 1.0)  # else something else happened in that row
    return Switches(rows[within], share[within])


def shift(series: Array, delay: float, time_step: float) -> Array:
    """Delay a series by `delay` [s], any real number of samples; the ends hold their value."""
    if delay == 0.0:
        return series
    index = np.arange(series.size, dtype=float)
    return np.interp(index - delay / time_step, index, series)


def first_order_lag(series: Array, time_constant: float, time_step: float, start: float | None = None) -> Array:
    """Response of `T y' = x - y` to a series that is linear between samples, from a start, or at rest (y = x there).

    Exact (first-order hold): y[k+1] = a y[k] + b0 x[k] + b1 x[k+1], a = exp(-h/T).
    """
    if not lags(time_constant, time_step):
        return series
    a, b0, b1 = lag_weights(time_constant, time_step)
    driven = b1 * series
    driven[1:] += b0 * series[:-1]
    driven[0] = series[0] if start is None else start
    return recursion(a, driven)


def lag_weights(time_constant: float, time_step: float) -> tuple[float, float, float]:
    """Weights (a, b0, b1) of `first_order_lag`: of the response before, and of the command before and now."""
    ratio = time_step / time_constant
    a = float(np.exp(-ratio))
    slope = (1.0 - a) / ratio
    return a, slope - a, 1.0 - slope


def lags(time_constant: float, time_step: float) -> bool:
    """Whether a lag is long enough to be seen in steps of this length."""
    return time_constant > 0.0 and time_constant >= 1e-6 * time_step


def recursion(share: float, driven: Array) -> Array:
    """y[k] = share y[k-1] + x[k] along a series x (n,), from nothing before it.

    Blocks of it are products with powers of the share; what each hands to the next is such a recursion again. SciPy
    solves the triangular band in one call, and takes longer to load than all lags of an answer take.
    """
    blocks = -(-driven.size // _BLOCK)
    rows = np.zeros((blocks, _BLOCK))
    rows.reshape(-1)[: driven.size] = driven
    powers = share ** np.arange(_BLOCK + 1)
    found = rows @ np.where(_SINCE >= 0, powers[_SINCE], 0.0)
    if blocks > 1:
        found[1:] += recursion(share**_BLOCK, found[:-1, -1])[:, None] * powers[1:]
    return np.asarray(found.reshape(-1)[: driven.size])
