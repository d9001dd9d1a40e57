"""Changes of two records of one quantity over pieces of a few seconds, to be compared: no derivative, no drift."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...physics.frames import Array, body_to_earth
from ..canonical import Channel
from ..log import Log
from ..statistics.robust import Fit, robust_fit

_WINDOW = 4.0
"""Length of the pieces over which changes are compared [s]: long beside the noise of a position, short beside drift."""
_LATEST, _LAG = 5.0, 0.5
"""Delays of heading and rate against each other that are tried, both ways, and their step [s]."""
_MANY = 20
"""Pieces from which heading and rate may be said to have nothing in common: chance gives two records a squared
correlation of 0.3 in one of a hundred."""
_SHARED = 0.3
"""That correlation."""
_TURNS = 0.2
"""Spread of the turning over pieces [rad] that is no noise of a compass or drift of a gyro."""
_LEAST_PIECES = 6
"""Pieces that are needed: each has two ways, and a track has four unknowns."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Changes over pieces by one record and by what should explain it, with the number of the piece of each row."""

    target: Array
    columns: Array
    piece: NDArray[np.int64]


def turns(log: Log, scale: float, late: float = 0.0) -> Pieces | None:
    """Turning of the heading, times `scale`, and that by the yaw rate; a bias of the rate is a constant.

    The heading is read as if it were `late` [s].
    """
    heading, rate = log.channels["psi"], log.channels["r"]
    angle = np.unwrap(scale * heading.value)
    total = _integral(rate, rate.value, heading.time - late)
    cut = _cut(heading.time, max(heading.period, rate.period))
    if cut is None:
        return None
    first, last, span = cut
    return _kept(angle[last] - angle[first], [total[last] - total[first], span], np.arange(span.size))


def apart(logs: Sequence[Log]) -> float | None:
    """Share of the turning of the heading that the yaw rate does not explain, whichever of them is how late.

    None where they go together, or where neither turns.
    """
    both = [log for log in logs if {"psi", "r"} <= set(log.channels)]
    lags = np.arange(-_LATEST, _LATEST + 0.5 * _LAG, _LAG)
    best, turned = 0.0, 0.0
    for lag in lags.tolist():
        tables = [turns(log, 1.0, lag) for log in both]
        known = [one for one in tables if one is not None]
        if sum(one.target.size for one in known) < _MANY:
            return None
        target = np.concatenate([one.target for one in known])
        rate = np.concatenate([one.columns[:, 0] for one in known])
        turned = max(turned, float(target.std()), float(rate.std()))
        if target.std() > 0.0 and rate.std() > 0.0:
            best = max(best, float(np.corrcoef(target, rate)[0, 1] ** 2))
    return 1.0 - best if turned > _TURNS and best < _SHARED else None


def ways(log: Log, turn: float, side: float) -> Pieces | None:
    """Way made good by position, and that by the speeds turned into the earth, as two numbers: ahead and across.

    Position = c times the sum of exp(i turn psi) (u + i side v), plus a current: real and imaginary part of c come
    first, then the current. `turn` and `side` are 1 or -1; an angle of c is the angle by which axes are off.
    """
    x, y, u = (log.channels[name] for name in ("x", "y", "u"))
    if x.time.size != y.time.size:
        return None
    psi, sway = log.channels["psi"], log.channels.get("v")
    heading = np.interp(u.time, psi.time, np.unwrap(psi.value))
    across = np.interp(u.time, sway.time, sway.value) if sway else np.zeros(u.time.size)
    rates = body_to_earth(turn * heading, u.value, side * across)
    cut = _cut(x.time, max(x.period, u.period))
    if cut is None:
        return None
    first, last, span = cut
    north, east = (total[last] - total[first] for total in (_integral(u, rate, x.time) for rate in rates))
    target = np.concatenate([channel.value[last] - channel.value[first] for channel in (x, y)])
    nothing = np.zeros(span.size)
    columns = [(north, east), (-east, north), (span, nothing), (nothing, span)]
    return _kept(target, [np.concatenate(pair) for pair in columns], np.tile(np.arange(span.size), 2))


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
    known = np.isfinite(heading)
    turning = turned[last] - turned[first]
    return way[known], heading[known], turning[known], x.time[first][known], x.time[last][known]


def fit_pieces(found: Sequence[Pieces | None]) -> Fit | None:
    """Fit the pieces of all logs together; None where there are fewer than six."""
    known = [pieces for pieces in found if pieces is not None]
    if not known or sum(np.unique(pieces.piece).size for pieces in known) < _LEAST_PIECES:
        return None
    begun, numbers = 0, []
    for pieces in known:
        numbers.append(begun + pieces.piece)
        begun += int(pieces.piece.max()) + 1
    target = np.concatenate([pieces.target for pieces in known])
    return robust_fit(np.concatenate([pieces.columns for pieces in known]), target, np.concatenate(numbers))


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


def _kept(target: Array, columns: list[Array], piece: NDArray[np.int64]) -> Pieces | None:
    table = np.column_stack(columns)
    keep = np.isfinite(table).all(axis=1) & np.isfinite(target)
    return Pieces(target[keep], table[keep], piece[keep]) if keep.any() else None
