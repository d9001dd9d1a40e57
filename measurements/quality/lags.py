"""How late one record is after what drives it: the delay at which a linear model leaves least, and how sure that is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array
from ..clock import band_passed, drift_free
from ..statistics.blocks import CI
from ..statistics.quantiles import student
from ..statistics.signals import turning_point
from .faults import BLOCK, FEWEST, Size, size_of

_FAR = (-5.0, 5.0)
"""Delays between records of one quantity that are tried [s]: clocks that were set by hand are seconds apart."""
FOLLOWS = 0.6
"""Share of a record that another of the same quantity must explain before its delay means anything."""
QUICK = (0.2, 2.0)
"""The band in which a boat answers its thrusters and drag has no say [Hz]."""


@dataclass(frozen=True, slots=True)
class Response:
    """One stretch of a record and of what drives it, on an even time base.

    Attributes
    ----------
    rate : (n,) the record, as a rate (a turning rate, an acceleration)
    drivers : (n, d) what comes earlier or later, as rates
    besides : (n, b) what else is in the record at the same instant, as rates
    """

    rate: Array
    drivers: Array
    besides: Array


@dataclass(frozen=True, slots=True)
class Lag:
    """A delay.

    Attributes
    ----------
    seconds, error : how much later the record is than its drivers, and the standard error of that [s], larger where
        few stretches tell it (Student's t)
    explained : share of the record's power that the drivers and the rest explain at that delay
    slope : of the record over the first driver
    stretches : of 10 s that tell it
    size : what the delay explains of the record, beside none
    """

    seconds: float
    error: float
    explained: float
    slope: float
    stretches: int
    size: Size

    @property
    def ci95(self) -> tuple[float, float]:
        """The 95 % interval [s]."""
        return self.seconds - CI * self.error, self.seconds + CI * self.error


def quick(rate: Array, step: float) -> Array:
    """Keep 0.2 to 2 Hz of records (n, ...) sampled every `step` [s], without moving them in time."""
    return band_passed(rate, step, (QUICK[0], min(QUICK[1], 0.4 / step)))


def lag_of(
    responses: Sequence[Response],
    step: float,
    smoothed: Callable[[Array, float], Array] = drift_free,
    reach: tuple[float, float] = (-0.6, 1.0),
) -> Lag | None:
    """Find the delay of a record after its drivers.

    Each record is smoothed and fitted by the delayed drivers and the rest at every delay within `reach` [s]; a parabola
    through the three best tells it between samples, a jackknife over stretches of 10 s its error.

    Returns
    -------
    Lag or None
        None where there are fewer than four stretches, nothing moves, or the best delay is the longest or shortest.
    """
    lags = np.arange(round(reach[0] / step), round(reach[1] / step) + 1, dtype=np.int64)
    margin = int(np.abs(lags).max())
    block = round(BLOCK / step)
    grams: list[Array] = []
    for one in responses:
        if one.rate.size < 2 * margin + block // 2:
            continue
        smooth = np.column_stack([one.drivers, one.besides, one.rate])
        if not np.isfinite(smooth).all():
            continue
        smooth = smoothed(smooth, step)
        grams.append(_grams(smooth, one.drivers.shape[1], lags, margin, block))
    if sum(gram.shape[0] for gram in grams) < FEWEST:
        return None
    every = np.concatenate(grams) if len(grams) > 1 else grams[0]
    total = every.sum(axis=0)
    size = np.sqrt(np.diagonal(total.mean(axis=0)))
    if size[-1] < 1e-9 or not (size[:-1] > 0.0).any():
        return None
    whole = _best(total, lags, step)
    if whole is None:
        return None
    seconds, left, slope = whole
    without = [_best(total - gram, lags, step) for gram in every]
    known = np.array([one[0] for one in without if one is not None])
    if known.size < len(without):
        return None
    count = known.size
    error = float(np.sqrt((count - 1) / count * ((known - known.mean()) ** 2).sum()))
    few = student(count - 1, 0.975) / CI
    return Lag(seconds, few * error, 1.0 - left, slope, count, _size(every, lags, round(seconds / step)))


def lag_anywhere(responses: Sequence[Response], step: float) -> Lag | None:
    """The delay of a record, looked for nearby first, so that short stretches count, and then far away."""
    near = lag_of(responses, step)
    if near is not None and near.explained >= FOLLOWS:
        return near
    return lag_of(responses, step, reach=_FAR) or near


def _grams(smooth: Array, drivers: int, lags: NDArray[np.int64], margin: int, block: int) -> Array:
    """Normal matrices (stretches, lags, p, p) of one record, drivers first and the record last."""
    rows = smooth.shape[0] - 2 * margin
    count = max(1, round(rows / block))
    edges = np.linspace(0, rows, count + 1).astype(int)
    found = np.empty((count, lags.size, smooth.shape[1], smooth.shape[1]))
    for b in range(count):
        first, last = margin + edges[b], margin + edges[b + 1]
        part = smooth[first:last].copy()
        for k, lag in enumerate(lags):
            part[:, :drivers] = smooth[first - lag : last - lag, :drivers]
            found[b, k] = part.T @ part
    return found


def _size(grams: Array, lags: NDArray[np.int64], lag: int) -> Size:
    """What a delay explains, beside none, in each stretch, of normal matrices (stretches, lags, p, p)."""

    def errors(wanted: int) -> Array:
        each = grams[:, int(np.argmin(np.abs(lags - wanted)))]
        total = each.sum(axis=0)
        c = np.append(-np.linalg.pinv(total[:-1, :-1], rcond=1e-9, hermitian=True) @ total[:-1, -1], 1.0)
        return np.einsum("i,bij,j->b", c, each, c)

    return size_of(errors(0), errors(lag), grams[:, 0, -1, -1], np.arange(grams.shape[0]))


def _best(grams: Array, lags: NDArray[np.int64], step: float) -> tuple[float, float, float] | None:
    """The delay [s] that leaves least, the share of the record's power that it leaves, and the first slope there."""
    size = np.sqrt(np.diagonal(grams, axis1=1, axis2=2).clip(0.0))
    size = np.where(size > 0.0, size, 1.0)
    scaled = grams / (size[:, :, None] * size[:, None, :])
    inner, outer = scaled[:, :-1, :-1], scaled[:, :-1, -1]
    coefficients = np.linalg.pinv(inner, rcond=1e-9, hermitian=True) @ outer[:, :, None]
    left = 1.0 - (outer[:, None, :] @ coefficients)[:, 0, 0]
    best = int(np.argmin(left))
    if best in (0, lags.size - 1):
        return None
    before, here, after = left[best - 1 : best + 2].tolist()
    shift = turning_point(before, here, after)
    slope = float(coefficients[best, 0, 0]) * float(size[best, -1] / size[best, 0])
    return float((lags[best] + shift) * step), here, slope
