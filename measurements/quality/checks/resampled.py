"""Check of a log put on a finer grid than it was measured on: rows that repeat, or lie on lines between others."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ....physics.motion import Array
from ...canonical import MOTION, Channel
from ..record import About, Channels, Check, Finding, Fix, Found, Record, altered

_OF_MOTION = (*MOTION, "ax", "ay")
_LEAST_ROWS = 200
"""Rows that are needed, and a tenth of it of measured ones, for a median and quantiles to mean something."""
_FLAT = 0.01
"""Bend of a record, beside its largest ones, up to which a row lies on the line between its neighbours; of rows that
are measured, one in fifty does."""
_SHARE = 0.6
"""Share of such rows from which a log is interpolated: to three times its rate or more."""
_EVEN = 0.8
"""Share of spans between measured rows that are of one length, but for rounding: a logger loses some."""
_ENDS = 0.5
"""Time for which the ends of a log repeat one row from which it was filled up there [s]."""


def _resampled(records: Sequence[Record]) -> Found:
    """Tell held, interpolated and filled-up rows from measured ones; a log of such rows is sound at its own rate.

    A note for each way in which the rows are not measured; none where they are.
    """
    found = [finding for record in records for finding in _unmeasured(record.log.channels)]
    # Several logs of one boat are told of once.
    return list({finding.sentence: finding for finding in found}.values())


def _unmeasured(channels: Channels) -> list[Finding]:
    table = _table(channels)
    if table is None:
        return []
    time, values, names = table
    fresh = _new(values)
    about, result = About("resampled", names), []
    padded = _padding(time, values, fresh)
    if padded:
        text = f"the log repeats one row for {padded:.2g} s at its end or start: it was filled up there"
        done = f"{padded:.2g} s of one repeated row at the ends of the log dropped"
        fix = Fix(done, partial(_thinned, keep=_between_padding))
        result.append(about.note(text, value=padded, unit="s", fix=fix))
    rate = float((time.size - 1) / (time[-1] - time[0]))
    rows = _held_over(fresh)
    if rows > 1:
        text = f"all channels of motion are held: measured {rate / rows:.3g} times a second, written {rate:.3g} times"
        done = f"rows that repeat the one before dropped: {rate / rows:.3g} rows a second kept"
        fix, wrong = Fix(done, partial(_thinned, keep=_measured)), "rows that repeat hold no new measurement"
        result.append(about.note(text, value=rate / rows, unit="Hz", consequence=wrong, fix=fix))
    elif rows := _interpolated(values):
        text = f"the log is interpolated to {rate:.3g} Hz from about {rate / rows:.3g} Hz"
        result.append(about.note(text, value=rate / rows, unit="Hz"))
    return result


def _table(channels: Channels) -> tuple[Array, list[Array], tuple[str, ...]] | None:
    """Stamps and records of the motion where all of it is one table; None otherwise."""
    parts = [channels[name] for name in _OF_MOTION if name in channels]
    if len(parts) < 3 or parts[0].time.size < _LEAST_ROWS:
        return None
    time = parts[0].time
    if not all(part.time is time or np.array_equal(part.time, time) for part in parts):
        return None
    values = [part.unwrapped for part in parts]
    return time, values, tuple(part.name for part in parts)


def _new(values: Sequence[Array]) -> NDArray[np.bool_]:
    """Whether a record changes from the row before to each row; records one by one, since a long log has many rows."""
    fresh = np.zeros(values[0].size, dtype=bool)
    fresh[0] = True
    for record in values:
        fresh[1:] |= record[1:] != record[:-1]
    return fresh


def _padding(time: Array, values: Sequence[Array], fresh: NDArray[np.bool_]) -> float:
    """Time for which a log of a moving boat repeats its first or its last row [s]."""
    first, last = _inner(fresh)
    if last <= first:
        return 0.0
    # A boat that lies still shows the same row, too: beside what is filled up, it moves as it does elsewhere.
    near = max(3, int(np.searchsorted(time, time[first] + _ENDS)) - first)
    ends = (
        (float(time[first] - time[0]), (first, first + near)),
        (float(time[-1] - time[last]), (max(first, last - near), last)),
    )
    usual = _steps(values, first, last)
    moving = usual > 0.0

    def moves(rows: tuple[int, int]) -> bool:
        """Whether most records move at least a tenth as fast in some rows as they usually do."""
        quick = moving & (_steps(values, *rows) > 0.1 * usual)
        return bool(quick.sum() > 0.5 * moving.sum())

    return sum(length for length, rows in ends if length > _ENDS and moves(rows))


def _steps(values: Sequence[Array], first: int, last: int) -> Array:
    """The usual step of each record between two rows."""
    return np.array([np.median(np.abs(np.diff(record[first : last + 1]))) for record in values])


def _inner(fresh: NDArray[np.bool_]) -> tuple[int, int]:
    """The last row of what may be filled up at the start, and the first of what may be at the end."""
    rows = np.flatnonzero(fresh[1:]) + 1
    return (int(rows[0]) - 1, int(rows[-1])) if rows.size else (0, 0)


def _between_padding(fresh: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The rows without what may be filled up at either end."""
    first, last = _inner(fresh)
    keep = np.zeros(fresh.size, dtype=bool)
    keep[first : last + 1] = True
    return keep


def _held_over(fresh: NDArray[np.bool_]) -> int:
    """Rows over which every record is held, in the median of those that are new; 1 where none is."""
    spans = np.diff(np.flatnonzero(fresh))
    if spans.size < _LEAST_ROWS // 10:
        return 1
    rows = round(float(np.median(spans)))
    return rows if np.mean(np.abs(spans - rows) <= 1) >= _EVEN and float(np.mean(spans)) > 1.5 else 1


def _measured(fresh: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The rows that are new; of a boat at rest, which shows nothing new, one wherever one was measured."""
    rows = np.flatnonzero(fresh)
    since = np.arange(fresh.size) - rows[np.cumsum(fresh) - 1]
    return fresh | (since % _held_over(fresh) == 0)


def _thinned(channels: Channels, keep: Callable[[NDArray[np.bool_]], NDArray[np.bool_]]) -> dict[str, Channel]:
    """The channels of motion with some of their rows; commands stay, since what is held is what was commanded."""
    table = _table(channels)
    if table is None:
        return dict(channels)
    _, values, names = table
    rows = keep(_new(values))
    return altered(channels, names, lambda channel: channel.rows(rows))


def _interpolated(values: Sequence[Array]) -> int:
    """Rows from one measured row to the next where those between lie on lines; 0 where all are measured."""
    measured = np.zeros(values[0].size - 2, dtype=bool)
    for record in values:
        bend = np.abs(np.diff(record, n=2))
        size = float(np.quantile(bend, 0.95))
        if size > 0.0:
            measured |= bend / size > _FLAT
    knots = np.flatnonzero(measured)
    if knots.size < _LEAST_ROWS // 10 or 1.0 - knots.size / measured.size < _SHARE:
        return 0
    spans = np.diff(knots)
    spans = spans[spans > 1]
    rows = float(np.median(spans)) if spans.size else 0.0
    # A measured row between two of the grid bends the line in both: steps of one, and of one less.
    even = bool(spans.size and np.mean(np.abs(spans - rows) <= 1.0) >= _EVEN)
    return round(rows) if even and rows >= 3.0 else 0


RESAMPLED = Check("resampled", _resampled)
