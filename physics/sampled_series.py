"""Series on an even time base: averages, means over bins, delays, first-order lags and switching commands."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .motion import Array

_THIRD = (20.0, -30.0, 12.0, -2.0)
"""Variance of third differences, by the autocovariances of a record."""
_MOST = 4.0
"""Ratio beyond which the noise of readings is not known from differences between them."""


def area_average(time: Array, value: Array, grid: Array, step: float, *, hold: bool = True) -> Array:
    """Take the exact mean of a sampled series over the step centred on each stamp of `grid`.

    Parameters
    ----------
    time : (m,) increasing [s]
    value : (m,) or (m, k) the samples; before the first and after the last the series is taken as constant
    grid : (n,) [s]
    step : [s]
    hold : True for the step function that keeps each value until the next sample, False for straight lines between

    Returns
    -------
    (n,) or (n, k) in the unit of `value`

    Examples
    --------
    A command that jumps from 0 to 1 a quarter of a step before a stamp has filled three quarters of that step.

    >>> area_average(np.array([0.0, 0.75]), np.array([0.0, 1.0]), np.array([0.0, 1.0]), 1.0)
    array([0.  , 0.75])
    """
    series, steps = value.T, np.diff(time)
    # Integrating the deviation from the first value loses fewer digits.
    deviation = series - series[..., :1]
    before, after = deviation[..., :-1], deviation[..., 1:]
    areas = np.zeros(series.shape)
    areas[..., 1:] = np.cumsum((before if hold else 0.5 * (before + after)) * steps, axis=-1)
    slopes = np.zeros(series.shape)
    if not hold:
        slopes[..., :-1] = (after - before) / steps

    def integral(instants: Array) -> Array:
        last = _in_force(time, instants)
        since = np.maximum(instants - time[last], 0.0)
        return areas[..., last] + deviation[..., last] * since + 0.5 * slopes[..., last] * since**2

    low, high = grid - 0.5 * step, grid + 0.5 * step
    average = series[..., :1] + (integral(high) - integral(low)) / step
    # A mean lies among its samples; rounding alone would take it past them (35 N became 35.000000000009 N).
    average = np.clip(average, series.min(axis=-1, keepdims=True), series.max(axis=-1, keepdims=True))
    if hold:
        first = _in_force(time, low)
        average = np.where(first == _in_force(time, high), series[..., first], average)
    return average.T


def understated_noise(time: Array, grid: Array) -> float:
    """Factor by which third differences on a grid understate the square of white noise on readings that came to it.

    Between two readings lies a part of each, so that neighbours on the grid share noise: of the autocovariances R0 to
    R3, an average over many rows meets R0 + 2 (R1 + R2 + R3), third differences (20 R0 - 30 R1 + 12 R2 - 2 R3) / 20.

    Parameters
    ----------
    time : (m,) increasing, of the readings, between which lines are drawn [s]
    grid : (n,) [s]

    Returns
    -------
    ratio of the two, at most 4, from where rows are more line than reading; 1 for readings on the grid

    Examples
    --------
    >>> even = np.arange(100.0)
    >>> understated_noise(even, even[10:-10]), round(understated_noise(even, even[10:-10] + 0.1), 2)
    (1.0, 1.46)
    """
    if time.size < 2 or grid.size <= len(_THIRD):
        return 1.0
    first = np.clip(np.searchsorted(time, grid, "right") - 1, 0, time.size - 2)
    later = np.clip((grid - time[first]) / (time[first + 1] - time[first]), 0.0, 1.0)
    parts = ((first, 1.0 - later), (first + 1, later))
    shared = [
        sum(
            float(np.mean(one[: one.size - lag] * other[lag:] * (here[: here.size - lag] == there[lag:])))
            for here, one in parts
            for there, other in parts
        )
        for lag in range(len(_THIRD))
    ]
    met = shared[0] + 2.0 * sum(shared[1:])
    told = float(np.dot(_THIRD, shared)) / _THIRD[0]
    return min(met / max(told, 1e-9), _MOST)


def _in_force(time: Array, instants: Array) -> NDArray[np.intp]:
    """Index of the last sample at or before each instant, the first sample for instants before it."""
    return np.clip(np.searchsorted(time, instants, "right") - 1, 0, time.size - 1)


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


def explained_share(values: Array, series: Array) -> float:
    """Share of the variance of `series` (n,) that its means over parts of the range of `values` (n,) take.

    0 where the values do not differ.
    """
    low, high = np.quantile(values, (0.005, 0.995))
    if not high > low:
        return 0.0
    middles, means = binned_means(values, series)
    part = np.abs(values[:, None] - middles).argmin(axis=1)
    return 1.0 - float(np.square(series - means[part]).mean()) / max(float(series.var()), 1e-300)


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
        result = force.copy()
        result[..., self.rows] = (1.0 - self.share) * force[..., self.rows - 1] + self.share * force[..., self.rows + 1]
        return result


def switches(command: Array) -> Switches:
    """Find where a command (n,) switches, of which the rows hold means, in any unit."""
    change = np.abs(command[1:] - command[:-1])
    same = change <= _SAME * change.max(initial=0.0)
    rows = 2 + np.flatnonzero(same[:-3] & ~same[1:-2] & ~same[2:-1] & same[3:])
    gap = command[rows + 1] - command[rows - 1]
    share = np.divide(command[rows] - command[rows - 1], gap, out=np.zeros(rows.size), where=gap != 0.0)
    within = (share > 0.0) & (share < 1.0)  # else something else happened in that row
    return Switches(rows[within], share[within])


def shift(series: Array, delay: float, time_step: float) -> Array:
    """Delay a series by `delay` [s], any real number of samples; the ends hold their value.

    Parameters
    ----------
    series : (n,) on an even time base
    delay : [s], negative for earlier
    time_step : [s]
    """
    if delay == 0.0:
        return series
    index = np.arange(series.size, dtype=float)
    return np.interp(index - delay / time_step, index, series)


def first_order_lag(series: Array, time_constant: float, time_step: float, start: float | None = None) -> Array:
    """Response of `T y' = x - y` to a series that is linear between samples, from a start, or at rest (y = x there).

    Exact (first-order hold): y[k+1] = a y[k] + b0 x[k] + b1 x[k+1], a = exp(-h/T).

    Parameters
    ----------
    series : x (n,) on an even time base
    time_constant : T [s]
    time_step : h [s]
    start : y before the first row; None for rest
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
    """True when a lag is long enough to be seen in steps of this length."""
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
