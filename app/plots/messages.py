"""Numbers on their way to and from the browser: short enough to send at once, checked when they come back."""

import math
from collections.abc import Mapping

import numpy as np

from ...physics.frames import Array

Named = tuple[str, float, float]
"""A log by its name, with its begin and end on the axis of time [s]."""
DIGITS = 5
"""Significant digits of the greatest value of an array: a tenth of a pixel on a screen of 4,000."""
TICK = 4
"""Decimals of a time [s]: no log is sampled faster than 10 kHz."""


def rounded(values: Array) -> Array:
    """Values to five significant digits of the greatest, for the JSON of a message; NaN and infinity become null there.

    Examples
    --------
    >>> rounded(np.array([1234.5678, 0.123456, np.nan]))
    array([1.2346e+03, 1.0000e-01,        nan])
    """
    known = np.abs(values[np.isfinite(values)])
    most = float(known.max()) if known.size else 0.0
    if most == 0.0:
        return np.asarray(values, dtype=np.float64)
    return np.round(values, DIGITS - 1 - math.floor(math.log10(most)))


def rounded_times(times: Array) -> Array:
    """Times [s] to a tenth of a millisecond, for the JSON of a message."""
    return np.round(times, TICK)


def sent_number(args: Mapping[str, object], name: str) -> float | None:
    """A finite number that the browser sent; None where there is none, for nobody knows what a browser sends."""
    value = args.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)
