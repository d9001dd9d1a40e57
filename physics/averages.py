"""Averages of a sampled series on an even time base: commands without losing their area, readings and their noise."""

import numpy as np
from numpy.typing import NDArray

from .frames import Array

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
    """By how much third differences on a grid understate the square of white noise on readings that came to it.

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
