"""Clocks: stray stamps dropped, pieces joined between which the clock was set, and the delay between two records."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..physics.file_records import Number, Record
from ..physics.motion import Array
from .formats.base import Stream
from .statistics.signals import band_pass, turning_point

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
    result = ~np.isfinite(time) | (np.abs(time) > _LATEST)
    for width in range(1, _WIDEST + 1):
        rows = np.flatnonzero(~result)
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
        result[rows[sorted(wrong)]] = True
    return result


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
    """True when no two pieces share any time: they are of one clock, and in disorder."""
    spans = sorted((float(piece.min()), float(piece.max())) for piece in pieces)
    return all(end < start for (_, end), (start, _) in pairwise(spans))


def _matched(time: Array, runs: Sequence[NDArray[np.int64]], pieces: Sequence[tuple[float, float]]) -> list[int]:
    """The piece that each run of a stream lies in; each a later one than the run before."""
    result: list[int] = []
    for place, rows in enumerate(runs):
        low, high = (float(bound) for bound in (time[rows].min(), time[rows].max())) if rows.size else (0.0, 0.0)
        least = result[-1] + 1 if result else 0
        rest = range(least, len(pieces) - (len(runs) - 1 - place))
        result.append(min(rest, key=lambda p: max(pieces[p][0] - low, high - pieces[p][1], 0.0)))
    return result


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
    """Keep a band [Hz] of records (n, ...) sampled every `step` [s], without moving them in time.

    Parameters
    ----------
    values : (n, ...)
    step : [s]
    band : its ends [Hz]
    """
    padding = min(values.shape[0] - 1, round(5.0 / step))
    result = np.empty(values.shape)
    # Long records one after the other: the filter makes several copies of what it is given.
    columns, mean = values.reshape(values.shape[0], -1), np.atleast_1d(values.mean(axis=0))
    passed, width = result.reshape(columns.shape), max(1, _AT_ONCE // values.shape[0])
    for begin in range(0, columns.shape[1], width):
        few = slice(begin, begin + width)
        passed[:, few] = band_pass(columns[:, few] - mean[few], step, band, 2, padding)
    return result


def _correlation(a: Array, b: Array, lag: int) -> float:
    """Correlation of a(t) with b(t + lag)."""
    left = a[max(0, -lag) : a.size - max(0, lag)]
    right = b[max(0, lag) : b.size - max(0, -lag)]
    left, right = left - left.mean(), right - right.mean()
    power = float(np.sqrt((left @ left) * (right @ right)))
    return float(left @ right) / power if power > 0 else 0.0
