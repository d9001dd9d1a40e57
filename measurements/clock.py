"""The clock of a log: stamps that are astray are dropped, and pieces between which the clock was set are joined."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..physics.frames import Array
from .formats.base import Stream

DAY = 86400.0
"""A step forward from which the clock was set, and the logger did not pause [s]."""
APART = 10.0
"""Gap that is left between pieces when they are joined [s]; nothing is interpolated across so much."""
_FAR = 1.0
"""Time by which a stamp is out of order from which it was not overtaken by another, but is wrong [s]."""
_PERIODS = 10.0
"""The same in steps of a slow channel: a row that was overtaken is out of order by some of them."""
_WIDEST = 3
"""Rows of wrong stamps in a row, at most; more of them are a piece of their own."""
_FEW = 0.02
"""Share of rows whose stamps may be wrong one by one; of more, the clock was set or the rows were shuffled."""
_ROWS = 20
"""Rows that pieces have on average, at least, where the clock was set and the rows were not shuffled."""
_LATEST = 1e11
"""The largest time that a clock may show, either way [s]: three thousand years."""

Rows = NDArray[np.bool_]


class Clock:
    """The clock of the streams of one file, put right as far as can be.

    Stamps that are alone in their disorder are astray, and dropped. Where the clock was set, by a day or more forward
    or by more than rows overtake each other back, what follows is put 10 s behind what was before.

    Parameters
    ----------
    streams : all that become channels
    mend : join pieces of a clock that was set back, too, where the order of the file alone tells what came first

    Attributes
    ----------
    sets : (when, by how much) the clock was set [s], on the joined time
    """

    def __init__(self, streams: Sequence[Stream], mend: bool) -> None:
        self.sets: tuple[tuple[float, float], ...] = ()
        shared = {id(stream.time): stream.time for stream in streams}
        self._keep = {key: ~_astray(time) for key, time in shared.items()}
        self._time = dict(shared)
        runs = {key: _runs(time, np.flatnonzero(self._keep[key])) for key, time in shared.items()}
        most = max(shared, key=lambda key: (len(runs[key]), int(self._keep[key].sum())), default=None)
        if most is None or len(runs[most]) < 2:
            return
        pieces = [(float(shared[most][rows].min()), float(shared[most][rows].max())) for rows in runs[most]]
        if not mend and any(start < end for (_, end), (start, _) in pairwise(pieces)):
            return
        shifts = self._joined(pieces, _step(shared[most][self._keep[most]]))
        for key, time in shared.items():
            moved = time.copy()
            for place, rows in zip(_matched(time, runs[key], pieces), runs[key], strict=True):
                moved[rows] += shifts[place]
            self._time[key] = moved

    def read(self, stream: Stream) -> tuple[Array, Rows]:
        """The stamps of a stream on the joined time [s], and which rows have one that is not astray."""
        return self._time[id(stream.time)], self._keep[id(stream.time)]

    def _joined(self, pieces: Sequence[tuple[float, float]], step: float) -> list[float]:
        shifts, sets, end = [0.0], [], pieces[0][1]
        for (_, before), (start, stop) in pairwise(pieces):
            sets.append((end, start - before - step))
            shifts.append(end + APART - start)
            end += APART + stop - start
        self.sets = tuple(sets)
        return shifts


def _step(time: Array) -> float:
    """Usual time from row to row [s]."""
    return float(np.median(np.abs(np.diff(time))))


def _astray(time: Array) -> Rows:
    """Rows whose stamp is no number, or that one to three in a row are out of order with those around them."""
    found = ~np.isfinite(time) | (np.abs(time) > _LATEST)
    for width in range(1, _WIDEST + 1):
        rows = np.flatnonzero(~found)
        t = time[rows]
        if t.size <= 2 * (_WIDEST + 1):
            break
        far = max(_FAR, _PERIODS * _step(t))
        before, after = t[: -width - 1], t[width + 1 :]
        inner = np.lib.stride_tricks.sliding_window_view(t[1:-1], width)
        out = ((inner > after[:, None] + far) | (inner < before[:, None] - far)).all(axis=1) & (after >= before)
        places = np.flatnonzero(out)
        wrong = {int(place) + 1 + k for place in places[: t.size] for k in range(width)}
        if len(wrong) > max(_WIDEST, _FEW * t.size):
            continue
        # A step into the log or out of it that no pause explains: what is beyond is no piece to work with.
        if not -far <= t[width] - t[width - 1] < DAY:
            wrong |= set(range(width))
        if not -far <= t[-width] - t[-width - 1] < DAY:
            wrong |= set(range(t.size - width, t.size))
        found[rows[sorted(wrong)]] = True
    return found


def _runs(time: Array, rows: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """The rows of each piece between two settings of the clock, in the order of the file."""
    t = time[rows]
    if t.size < 2:
        return [rows]
    steps = np.diff(t)
    far = max(_FAR, _PERIODS * _step(t))
    falls = np.flatnonzero(steps < -far) + 1
    shuffled = falls.size * _ROWS > t.size or (falls.size > 1 and _apart(np.split(t, falls)))
    if shuffled or (falls.size == 0 and np.any(steps < 0.0)):
        rows = rows[np.argsort(t, kind="stable")]
        falls, steps = np.zeros(0, dtype=np.int64), np.diff(time[rows])
    leaps = np.flatnonzero(steps >= DAY) + 1
    return np.split(rows, np.union1d(falls, leaps))


def _apart(pieces: Sequence[Array]) -> bool:
    """Whether no two pieces share any time: they are of one clock, and in disorder."""
    spans = sorted((float(piece.min()), float(piece.max())) for piece in pieces)
    return all(end < start for (_, end), (start, _) in pairwise(spans))


def _matched(time: Array, runs: Sequence[NDArray[np.int64]], pieces: Sequence[tuple[float, float]]) -> list[int]:
    """The piece that each run of a stream lies in; each a later one than the run before."""
    found: list[int] = []
    for place, rows in enumerate(runs):
        low, high = (float(bound) for bound in (time[rows].min(), time[rows].max())) if rows.size else (0.0, 0.0)
        least = found[-1] + 1 if found else 0
        rest = range(least, len(pieces) - (len(runs) - 1 - place))
        found.append(min(rest, key=lambda p: max(pieces[p][0] - low, high - pieces[p][1], 0.0)))
    return found
