"""Lags between records: the delay at which a linear model leaves least, and changes of records over pieces of seconds.

Two records of one quantity are compared by their changes over pieces: no derivative, no drift.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array, body_to_earth
from ..canonical import Channel
from ..log import Log
from ..preparation.resampling import gap_limit
from ..statistics.blocks import CI, LEVEL, Fit, interval, robust_fit, student
from ..statistics.signals import band_passed, drift_free, noise_level, turning_point
from .faults import BLOCK, FEWEST, Size, size_of, size_of_unexplained, squared_held_out

_FAR = (-5.0, 5.0)
"""Delays between records of one quantity that are tried [s]: clocks that were set by hand are seconds apart."""
FOLLOWS = 0.6
"""Share of a record that another of the same quantity must explain before its delay means anything. Half of it finds
the same; twice as much is more than any explains (`benchmarks/steady_limits.py`)."""
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
    stretches : of 10 s that tell it
    size : what the delay explains of the record, beside none
    """

    seconds: float
    error: float
    explained: float
    stretches: int
    size: Size

    @property
    def ci95(self) -> tuple[float, float]:
        """The 95 % interval [s]."""
        return interval(self.seconds, self.error)


def quick(rate: Array, step: float) -> Array:
    """Keep 0.2 to 2 Hz of records (n, ...) sampled every `step` [s], without moving them in time."""
    return band_passed(rate, step, QUICK)


def lag_of(
    responses: Sequence[Response],
    step: float,
    smoothed: Callable[[Array, float], Array] = drift_free,
    reach: tuple[float, float] = (-0.6, 1.0),
) -> Lag | None:
    """Find the delay of a record after its drivers.

    Each record is smoothed and fitted by the delayed drivers and the rest at every delay within `reach` [s]; a parabola
    through the three best tells it between samples, a jackknife over stretches of 10 s its error.

    Parameters
    ----------
    responses : stretches of a record and its drivers
    step : of all stretches [s]
    smoothed : a filter of (values, step)
    reach : least and largest delay [s]

    Returns
    -------
    Lag or None
        None where there are fewer than four stretches, nothing moves, or the best delay is the longest or shortest.
    """
    lags = np.arange(round(reach[0] / step), round(reach[1] / step) + 1, dtype=np.int64)
    margin, block = int(np.abs(lags).max()), round(BLOCK / step)
    grams: list[Array] = []
    for one in responses:
        table = np.column_stack([one.drivers, one.besides, one.rate])
        if one.rate.size >= 2 * margin + block // 2 and np.isfinite(table).all():
            grams.append(_grams(smoothed(table, step), one.drivers.shape[1], lags, margin, block))
    if sum(gram.shape[0] for gram in grams) < FEWEST:
        return None
    every = np.concatenate(grams)
    total = every.sum(axis=0)
    size = np.sqrt(np.diagonal(total.mean(axis=0)))
    if size[-1] < 1e-9 or not (size[:-1] > 0.0).any():
        return None
    whole = _best(total, lags, step)
    if whole is None:
        return None
    seconds, left = whole
    without = [_best(total - gram, lags, step) for gram in every]
    known = np.array([one[0] for one in without if one is not None])
    count = known.size
    if count < len(without):
        return None
    error = float(np.sqrt((count - 1) / count * ((known - known.mean()) ** 2).sum()))
    few = student(count - 1, LEVEL) / CI
    return Lag(seconds, few * error, 1.0 - left, count, _size(every, lags, round(seconds / step)))


def lag_anywhere(responses: Sequence[Response], step: float) -> Lag | None:
    """The delay of a record, looked for nearby first, so that short stretches count, and then far away."""
    near = lag_of(responses, step)
    if near is not None and near.explained >= FOLLOWS:
        return near
    return lag_of(responses, step, reach=_FAR) or near


def _grams(smooth: Array, drivers: int, lags: NDArray[np.int64], margin: int, block: int) -> Array:
    """Normal matrices (stretches, lags, p, p) of one record, drivers first and the record last."""
    rows = smooth.shape[0] - 2 * margin
    edges = margin + np.linspace(0, rows, max(1, round(rows / block)) + 1).astype(int)
    result = np.empty((edges.size - 1, lags.size, smooth.shape[1], smooth.shape[1]))
    for b, (first, last) in enumerate(pairwise(edges)):
        part = smooth[first:last].copy()
        for k, lag in enumerate(lags):
            part[:, :drivers] = smooth[first - lag : last - lag, :drivers]
            result[b, k] = part.T @ part
    return result


def _size(grams: Array, lags: NDArray[np.int64], lag: int) -> Size:
    """What a delay explains, beside none, in each stretch, of normal matrices (stretches, lags, p, p)."""

    def errors(wanted: int) -> Array:
        each = grams[:, int(np.argmin(np.abs(lags - wanted)))]
        total = each.sum(axis=0)
        c = np.append(-np.linalg.pinv(total[:-1, :-1], rcond=1e-9, hermitian=True) @ total[:-1, -1], 1.0)
        return np.einsum("i,bij,j->b", c, each, c)

    return size_of(errors(0), errors(lag), grams[:, 0, -1, -1], np.arange(grams.shape[0]))


def _best(grams: Array, lags: NDArray[np.int64], step: float) -> tuple[float, float] | None:
    """The delay [s] that leaves least, and the share of the record's power that it leaves."""
    left = unexplained_shares(grams)
    best = int(np.argmin(left))
    if best in (0, lags.size - 1):
        return None
    before, here, after = left[best - 1 : best + 2].tolist()
    return float((lags[best] + turning_point(before, here, after)) * step), here


def unexplained_shares(grams: Array) -> Array:
    """Share of a record's power that least squares leave (lags,), by normal matrices (lags, p, p), its row the last."""
    size = np.sqrt(np.diagonal(grams, axis1=1, axis2=2).clip(0.0))
    size = np.where(size > 0.0, size, 1.0)
    scaled = grams / (size[:, :, None] * size[:, None, :])
    inner, outer = scaled[:, :-1, :-1], scaled[:, :-1, -1:]
    coefficients = (np.linalg.pinv(inner, rcond=1e-9, hermitian=True) @ outer)[:, :, 0]
    return np.asarray(1.0 - (outer[:, :, 0] * coefficients).sum(axis=1))


_WINDOW = 4.0
"""Length of a piece over which changes are compared [s]: long beside the noise of a position, short beside drift."""

_LATEST, _LAG = 5.0, 0.5
"""Delays of heading and rate against each other that are tried, both ways, and their step [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Changes of one quantity over pieces (m,) by two records: real [rad], or north + i east [m].

    Attributes
    ----------
    measured, implied : the change of a record, and what it should be by the other
    span : lengths of the pieces [s]
    piece : their numbers
    """

    measured: NDArray[Any]
    implied: NDArray[Any]
    span: Array
    piece: NDArray[np.int64]

    @property
    def block(self) -> NDArray[np.int64]:
        """Numbers of the blocks of time to which they belong."""
        return blocks_of_pieces(self.piece)

    def errors(self, factor: complex) -> Array:
        """Squares of what is left of the measured changes, beside a drift, where the implied are times a factor."""
        return np.abs(beside_drift(self.measured - factor * self.implied, self.span)) ** 2


def beside_drift(change: NDArray[Any], span: Array) -> NDArray[Any]:
    """Changes over pieces of some length [s] less a drift that is in them all: a bias, or a current."""
    drift = change / span
    usual: complex = float(np.median(np.real(drift)))
    if np.iscomplexobj(drift):
        usual += 1j * float(np.median(np.imag(drift)))
    return np.asarray(change - usual * span)


def turns(logs: Sequence[Log], scale: float, late: float = 0.0) -> Pieces | None:
    """Turning by headings, times `scale`, and by yaw rates, over the pieces of all logs; None where there is none.

    Headings are read as if they were `late` [s].
    """

    def series(log: Log) -> tuple[Array, float, Array, Array]:
        heading, rate = log.channels["psi"], log.channels["r"]
        total = _integral(rate, rate.value, heading.time - late)
        return heading.time, max(heading.period, rate.period), np.unwrap(scale * heading.value), total

    return _over_pieces(logs, series)


def unexplained_turning(logs: Sequence[Log]) -> Size | None:
    """How much of the turning of the heading the yaw rate does not explain, whichever of them is how late.

    None where the pieces are too few. The noise of the heading is no turning, nor is what the noise of the yaw rate
    adds up to: of what follows from it, a slope of k, least squares leaves k times its square (Fuller 1987, eq. 1.1.7).
    """
    both = [log for log in logs if {"psi", "r"} <= set(log.channels)]
    noise = 2.0 * float(np.mean([(noise_level(np.unwrap(log.channels["psi"].value)) or 0.0) ** 2 for log in both]))
    rates = [log.channels["r"] for log in both]
    of_rate = float(np.mean([(noise_level(rate.value) or 0.0) ** 2 * rate.period for rate in rates]))
    best: Size | None = None
    for late in np.arange(-_LATEST, _LATEST + 0.5 * _LAG, _LAG).tolist():
        found = turns(both, 1.0, late)
        if found is None or found.span.size < FEWEST:
            return None
        heading, rate = (beside_drift(part, found.span) for part in (found.measured, found.implied))
        power = heading**2 - noise
        slope = float(np.clip((heading @ rate) / max(float(rate @ rate), 1e-300), 0.0, 1.0))
        left = squared_held_out(heading, rate[:, None], found.block) - noise - slope * of_rate * found.span
        size = size_of_unexplained(left, power, found.block)
        best = size if best is None or size.weight.value < best.weight.value else best
    return best


def ways(logs: Sequence[Log], turn: int, side: int) -> Pieces | None:
    """Way by positions and by the sum of exp(i turn psi) (u + i side v), over the pieces of all logs.

    Parameters
    ----------
    logs : with positions, headings and speeds
    turn, side : 1 or -1: the way round of the heading, and the side of sway
    """

    def series(log: Log) -> tuple[Array, float, NDArray[Any], NDArray[Any]]:
        x, y, u, psi = (log.channels[name] for name in ("x", "y", "u", "psi"))
        sway = log.channels.get("v")
        heading = np.interp(u.time, psi.time, np.unwrap(psi.value))
        across = np.interp(u.time, sway.time, sway.value) if sway else np.zeros(u.time.size)
        north, east = body_to_earth(turn * heading, u.value, side * across)
        sailed = _integral(u, north, x.time) + 1j * _integral(u, east, x.time)
        return x.time, max(x.period, u.period), x.value + 1j * y.value, sailed

    return _over_pieces([log for log in logs if log.channels["x"].time.size == log.channels["y"].time.size], series)


def headings(logs: Sequence[Log]) -> Pieces:
    """Change of exp(i psi) over the same pieces as `ways` has, by an antenna a metre ahead of the origin [m]."""

    def series(log: Log) -> tuple[Array, float, NDArray[Any], NDArray[Any]]:
        x, u, psi = (log.channels[name] for name in ("x", "u", "psi"))
        bow = np.exp(1j * np.interp(x.time, psi.time, np.unwrap(psi.value)))
        inside = (x.time >= u.time[0]) & (x.time <= u.time[-1])  # as the sum of the speeds is known
        return x.time, max(x.period, u.period), np.where(inside, bow, np.nan), bow

    found = _over_pieces([log for log in logs if log.channels["x"].time.size == log.channels["y"].time.size], series)
    assert found is not None, "asked of logs that have ways"
    return found


def courses(log: Log) -> tuple[NDArray[np.complex128], Array, Array, Array, Array] | None:
    """Way made good over pieces, north and east as one complex number [m], and the heading of each [rad].

    Returns
    -------
    (way, heading, turning, begin, end) or None
        (m,) each: the heading is the mean, the turning its change [rad], the ends are in [s]. None where the positions
        do not come together or are too few.
    """
    x, y, psi = (log.channels[name] for name in ("x", "y", "psi"))
    if x.time.size != y.time.size:
        return None
    cut = _cut(x.time, max(x.period, psi.period))
    if cut is None:
        return None
    first, last, _ = cut
    angle = np.unwrap(psi.value)
    turned = np.interp(x.time, psi.time, angle)
    mean = [_integral(psi, part, x.time) for part in (np.cos(angle), np.sin(angle))]
    heading = np.arctan2(*(total[last] - total[first] for total in reversed(mean)))
    way = (x.value[last] - x.value[first]) + 1j * (y.value[last] - y.value[first])
    over = np.concatenate(([0], np.cumsum(np.diff(x.time) > gap_limit(x, None))))  # where a jump was taken out, too
    known = np.isfinite(heading) & (over[last] == over[first])
    turning = turned[last] - turned[first]
    return way[known], heading[known], turning[known], x.time[first][known], x.time[last][known]


def fit_ways(found: Pieces) -> Fit | None:
    """Fit the complex number c and the current of made = c sailed + current span; None for too few pieces to do it."""
    ahead, across, nothing = np.real(found.implied), np.imag(found.implied), np.zeros(found.span.size)
    columns = [(ahead, across), (-across, ahead), (found.span, nothing), (nothing, found.span)]
    target = np.concatenate([np.real(found.measured), np.imag(found.measured)])
    if target.size <= len(columns):
        return None
    return robust_fit(np.column_stack([np.concatenate(pair) for pair in columns]), target, np.tile(found.piece, 2))


def blocks_of_pieces(piece: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers of the blocks of time to which pieces of some numbers belong."""
    return piece // round(BLOCK / _WINDOW)


def _integral(channel: Channel, rate: Array, at: Array) -> Array:
    """Integral of a rate at the stamps of a channel, read at other stamps; NaN outside."""
    time = channel.time
    total = np.concatenate(([0.0], np.cumsum(0.5 * np.diff(time) * (rate[1:] + rate[:-1]))))
    return np.interp(at, time, total, left=np.nan, right=np.nan)


def _cut(time: Array, period: float) -> tuple[NDArray[np.int64], NDArray[np.int64], Array] | None:
    """First and last row of pieces of 4 s (longer where samples are far apart), and their lengths [s].

    None goes across a hole. Only windows that hold a sample are looked at: a clock that was set makes a hole of years.
    """
    window = max(_WINDOW, 8.0 * period)
    if time.size < 3:
        return None
    number = np.floor((time - time[0]) / window)
    begins = np.concatenate(([0], np.flatnonzero(np.diff(number)) + 1))
    first, last = begins[:-1], begins[1:]
    span = time[last] - time[first]
    whole = (span > 0.5 * window) & (span < 1.5 * window)
    return (first[whole], last[whole], span[whole]) if whole.any() else None


def _over_pieces(
    logs: Sequence[Log], series: Callable[[Log], tuple[Array, float, NDArray[Any], NDArray[Any]]]
) -> Pieces | None:
    """Changes of two series over the pieces of all logs, lengths [s] and numbers of these; those that are all known.

    Parameters
    ----------
    series : of a log, stamps (n,) [s], the longest step of its records [s], and both series (n,)
    """
    found, begun = [], 0
    for log in logs:
        time, period, one, other = series(log)
        cut = _cut(time, period)
        if cut is None:
            continue
        first, last, span = cut
        found.append((one[last] - one[first], other[last] - other[first], span, begun + np.arange(span.size)))
        begun += span.size + 1
    if not found:
        return None
    table = [np.concatenate(column) for column in zip(*found, strict=True)]
    keep = np.logical_and.reduce([np.isfinite(column) for column in table])
    return Pieces(*(column[keep] for column in table))
