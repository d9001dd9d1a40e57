"""Are two channels in step? The delay between two records of the same quantity."""

import numpy as np

from ..physics.file_records import Number, Record
from ..physics.frames import Array
from .statistics.peak import turning_point
from .statistics.zero_phase import band_pass

LEAST_CORRELATION = 0.7
"""Correlation from which two records tell of the same motion, or, negative, of opposite ones: half of the variance of
one is that of the other."""
_BAND = (0.05, 1.0)
"""Motion slower or faster than this [Hz] is left out of the comparison: below is drift, above is noise of
derivatives."""
_AT_ONCE = 1 << 18
"""Values that are filtered at once: 2 MB, of which the filter makes some five copies."""


class Alignment(Record):
    """How far one record of a quantity is behind another.

    Attributes
    ----------
    first, second : the two records, in words
    offset : how much later the second one shows the same thing [s]; None when the log cannot tell
    correlation : of the two records at that offset; None when one of them never changes
    sentence : the same for a person
    """

    first: str
    second: str
    offset: Number | None = None
    correlation: Number | None = None
    sentence: str


def align(first: str, second: str, values: tuple[Array, Array], step: float, reach: float = 1.0) -> Alignment:
    """Compare two records (n,) of one quantity on the same even time base.

    Parameters
    ----------
    first, second : what the records are, in words
    values : the two records, in the same unit: speeds or turning rates
    step : of the time base [s]
    reach : largest delay looked for [s]

    Returns
    -------
    Alignment
        The offset is where the cross-correlation peaks, between samples by a parabola through three lags.
    """
    # A heading's noise, differentiated, hides the peak; integrated records found a delay of 0.1 s to 3 ms where rates
    # erred by 50 ms. The band-pass takes away what integration made drift, and moves neither record against the other.
    a, b = (drift_free(series, step) for series in values)
    most = min(round(reach / step), a.size // 4)
    if most < 1 or min(a.std(), b.std()) < 1e-9:
        sentence = f"{first} or {second} never changes; nothing to compare."
        return Alignment(first=first, second=second, sentence=sentence)
    lags = np.arange(-most, most + 1)
    peak = np.array([_correlation(a, b, int(lag)) for lag in lags])
    best = int(np.argmax(peak))
    top = float(peak[best])
    if top < LEAST_CORRELATION or best in (0, lags.size - 1):
        sentence = f"{first} and {second} do not follow each other (correlation {top:.2f}): noise, or other axes."
        if peak.min() < -max(LEAST_CORRELATION, top):
            top = float(peak.min())
            sentence = f"{second} has the opposite sign of {first} (correlation {top:.2f}); check the axes."
        return Alignment(first=first, second=second, correlation=top, sentence=sentence)
    shift = turning_point(float(peak[best - 1]), top, float(peak[best + 1]))
    offset = float((lags[best] + shift) * step)
    sentence = f"{second} is {abs(offset):.3f} s {'later' if offset > 0 else 'earlier'} than {first}."
    if abs(offset) < 0.2 * step:
        sentence = f"{first} and {second} are in step."
    return Alignment(first=first, second=second, offset=offset, correlation=top, sentence=sentence)


def drift_free(rate: Array, step: float) -> Array:
    """Integrate rates (n, ...) sampled every `step` [s], and keep 0.05 to 1 Hz of them, without moving them in time."""
    total = np.zeros(rate.shape)
    np.cumsum(0.5 * step * (rate[1:] + rate[:-1]), axis=0, out=total[1:])
    return band_passed(total, step, (_BAND[0], min(_BAND[1], 0.4 / step)))


def band_passed(values: Array, step: float, band: tuple[float, float]) -> Array:
    """Keep a band [Hz] of records (n, ...) sampled every `step` [s], without moving them in time."""
    padding = min(values.shape[0] - 1, round(5.0 / step))
    found = np.empty(values.shape)
    # Long records one after the other: the filter makes several copies of what it is given.
    columns, mean = values.reshape(values.shape[0], -1), np.atleast_1d(values.mean(axis=0))
    passed, width = found.reshape(columns.shape), max(1, _AT_ONCE // values.shape[0])
    for begin in range(0, columns.shape[1], width):
        few = slice(begin, begin + width)
        passed[:, few] = band_pass(columns[:, few] - mean[few], step, band, 2, padding)
    return found


def _correlation(a: Array, b: Array, lag: int) -> float:
    """Correlation of a(t) with b(t + lag)."""
    left = a[max(0, -lag) : a.size - max(0, lag)]
    right = b[max(0, lag) : b.size - max(0, -lag)]
    left, right = left - left.mean(), right - right.mean()
    power = float(np.sqrt((left @ left) * (right @ right)))
    return float(left @ right) / power if power > 0 else 0.0
