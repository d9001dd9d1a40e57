"""Averages of a sampled series over time steps: how commands reach an even time base without losing their area."""

import numpy as np
from numpy.typing import NDArray

from .frames import Array


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


def _in_force(time: Array, instants: Array) -> NDArray[np.intp]:
    """Index of the last sample at or before each instant, the first sample for instants before it."""
    return np.clip(np.searchsorted(time, instants, "right") - 1, 0, time.size - 1)
