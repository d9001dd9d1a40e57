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
_LEAST_PIECES = 6
"""Pieces that are needed: each has two ways, and a track has four unknowns."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Changes over pieces by one record and by what should explain it, with the number of the piece of each row."""

    target: Array
    columns: Array
    piece: NDArray[np.int64]


def turns(log: Log, scale: float) -> Pieces | None:
    """Turning of the heading, times `scale`, and that by the yaw rate; a bias of the rate is a constant."""
    heading, rate = log.channels["psi"], log.channels["r"]
    angle = np.unwrap(scale * heading.value)
    total = _integral(rate, rate.value, heading.time)
    cut = _cut(heading.time, max(heading.period, rate.period))
    if cut is None:
        return None
    first, last, span = cut
    return _kept(angle[last] - angle[first], [total[last] - total[first], span], np.arange(span.size))


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
