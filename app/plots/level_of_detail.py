"""Level of detail: long series and paths thinned to what a screen can show, and sent as short messages.

A series keeps the least and the greatest value in every column of pixels, a path a point every so many metres; gaps
stay. Numbers from the browser are checked.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array

Rows = NDArray[np.intp]
"""Numbers of rows."""
Mask = NDArray[np.bool_]
"""A yes or no a row."""

BLOCK = 32
"""Rows that are looked at once and for all: 500,000 rows make 15,625 blocks, which a window goes through in 0.1 ms."""
TORN = 24
"""Rows a column of pixels up to which a gap within one is shown: rollouts of 100 rows then begin 4 pixels apart."""
FINE = 2 * BLOCK
"""Rows a column of pixels from which on blocks do: a bucket's edge is then off by half its width at most."""


def thinned(
    time: Array, columns: Mapping[str, Array], begin: float, end: float, width: int
) -> tuple[Array, dict[str, Array]]:
    """A window of some series, with no more than two values a column of pixels.

    All series keep one common time axis. Each column of pixels gives two points at most, at the times of its first and
    its last row: every series has its least value at one and its greatest at the other, the smaller one first where
    the series rises. A gap between the two, as where a rollout ends and the next begins, stands there as a point of its
    own while the columns hold few rows. Where the window has no more rows than two a column, the rows themselves come
    back, and one beyond each end, so that a line reaches the edge.

    Parameters
    ----------
    time : Array
        Times of the rows, ascending [s], shape (rows,).
    columns : Mapping[str, Array]
        Series by name, each of shape (rows,); NaN where a series has a gap.
    begin, end : float
        The window [s].
    width : int
        Its columns of pixels.

    Returns
    -------
    tuple[Array, dict[str, Array]]
        Times [s] and series of the window.

    Examples
    --------
    >>> time = np.arange(1000.0)
    >>> spike = np.where(time == 137.0, 9.0, 0.0)
    >>> coarse, columns = thinned(time, {"spike": spike}, 0.0, 999.0, 10)
    >>> len(coarse), float(columns["spike"].max())
    (20, 9.0)
    """
    first, last = _rows(time, begin, end)
    if last - first <= 2 * width:
        return time[first:last], {name: column[first:last] for name, column in columns.items()}
    starts = _starts(time, first, last, (begin, end, width))
    ends = np.append(starts[1:], last)
    thin = {name: _in_order(c, (starts, ends), (c[:last], c[:last]), starts) for name, c in columns.items()}
    torn: dict[str, Rows] = {}
    if last - first <= TORN * width:
        for name, column in columns.items():
            gaps = np.isnan(column[:last])
            inside = np.logical_or.reduceat(gaps, starts) & ~np.isnan(thin[name][:, 0])
            torn[name] = np.where(inside, np.where(gaps[starts], 0, np.where(gaps[ends - 1], 2, 1)), -1)
    return _paired(time, thin, (starts, ends), torn)


class Levels:
    """Series whose windows are thinned at any zoom in less than a millisecond, however long they are.

    Parameters
    ----------
    time : Array
        Times of the rows, ascending [s], shape (rows,).
    columns : Mapping[str, Array]
        Series by name, each of shape (rows,); NaN where a series has a gap.
    """

    def __init__(self, time: Array, columns: Mapping[str, Array]) -> None:
        self.time = np.ascontiguousarray(time, dtype=np.float64)
        self.columns: dict[str, Array] = {}
        self._blocks: dict[str, tuple[Array, Array]] = {}
        self.replace(columns)

    def replace(self, columns: Mapping[str, Array]) -> None:
        """Put other values in place of some series, or more series beside them, on the same times."""
        for name, given in columns.items():
            column = np.ascontiguousarray(given, dtype=np.float64)
            if column.shape != self.time.shape:
                raise ValueError(
                    f"column {name!r} has the shape {column.shape}, the time {self.time.shape}: give one value a row"
                )
            self.columns[name] = column
            begins = np.arange(0, len(column), BLOCK)
            self._blocks[name] = np.fmin.reduceat(column, begins), np.fmax.reduceat(column, begins)

    def window(self, begin: float, end: float, width: int) -> tuple[Array, dict[str, Array]]:
        """As `thinned`; in a wide window a column of pixels begins at a block's edge, less than a pixel away."""
        first, last = _rows(self.time, begin, end)
        if last - first < FINE * width:
            return thinned(self.time, self.columns, begin, end, width)
        blocks = np.unique(_starts(self.time, first, last, (begin, end, width)) // BLOCK)
        starts, ends = blocks * BLOCK, np.append(blocks[1:] * BLOCK, last)
        until = -(-last // BLOCK)
        thin: dict[str, Array] = {}
        for name, column in self.columns.items():
            lows, highs = self._blocks[name]
            thin[name] = _in_order(column, (starts, ends), (lows[:until], highs[:until]), blocks)
        return _paired(self.time, thin, (starts, ends), {})


def _rows(time: Array, begin: float, end: float) -> tuple[int, int]:
    """First row of a window and the one after its last, with one more on either side."""
    first, last = np.searchsorted(time, begin, "left"), np.searchsorted(time, end, "right")
    return max(int(first) - 1, 0), min(int(last) + 1, len(time))


def _starts(time: Array, first: int, last: int, window: tuple[float, float, int]) -> Rows:
    """First row of every column of pixels that has any; the rows beyond the ends are on their own."""
    begin, end, width = window
    inner = first + np.searchsorted(time[first:last], np.linspace(begin, end, width + 1)[:-1], "left")
    beyond = [last - 1] if time[last - 1] > end else []
    return np.unique(np.concatenate(([first], inner[inner < last], beyond)).astype(np.intp))


def _in_order(column: Array, buckets: tuple[Rows, Rows], extremes: tuple[Array, Array], at: Rows) -> Array:
    """Both extremes of every bucket, shape (buckets, 2), the smaller first where the series rises; NaN in a gap.

    `extremes` are the least and the greatest values of rows, or of blocks of them, and each bucket begins `at` one.
    """
    starts, ends = buckets
    low, high = np.fmin.reduceat(extremes[0], at), np.fmax.reduceat(extremes[1], at)
    rises = column[starts] <= column[ends - 1]
    return np.stack((np.where(rises, low, high), np.where(rises, high, low)), axis=1)


def _paired(
    time: Array, pairs: Mapping[str, Array], buckets: tuple[Rows, Rows], torn: Mapping[str, Rows]
) -> tuple[Array, dict[str, Array]]:
    """Both points of every bucket, one after the other; three where one series is torn.

    `torn` says where a bucket's gap is: 0 at its begin, 1 between the points, 2 at its end, -1 nowhere. There the other
    series repeat the point before, in the same pixel. A bucket of one row gives one point.
    """
    starts, ends = buckets
    kept = np.ones((len(starts), 3), dtype=bool)
    kept[:, 1] = np.logical_or.reduce([place >= 0 for place in torn.values()]) if torn else False
    kept[:, 2] = ends - starts > 1
    times = np.stack((time[starts], time[starts], time[ends - 1]), axis=1)
    points: dict[str, Array] = {}
    for name, pair in pairs.items():
        three = pair[:, [0, 0, 1]]
        if name in torn:
            three[:, 1] = np.where(torn[name] == 2, pair[:, 1], pair[:, 0])
            rows = np.flatnonzero(torn[name] >= 0)
            three[rows, torn[name][rows]] = np.nan
        points[name] = three[kept]
    return times[kept], points


@dataclass(frozen=True, slots=True)
class Path:
    """Where something was: times [s], metres north and east, each of shape (rows,); NaN breaks the path."""

    time: Array
    north: Array
    east: Array

    def rows(self, kept: Mask | Rows) -> "Path":
        """Some of its rows, by mask or by index."""
        return Path(self.time[kept], self.north[kept], self.east[kept])


def joined(pieces: Sequence[tuple[Array, Array, Array]]) -> Path:
    """Pieces of time, north and east as one path, with a gap after each piece."""
    gap = np.array([np.nan])
    parts = [[part for piece in pieces for part in (piece[k], gap)] for k in range(3)]
    return Path(*(np.concatenate(part) if part else np.empty(0) for part in parts))


def thinned_by_length(path: Path, most: int) -> Path:
    """About `most` points at even distances along the path, with the ends of all its unbroken parts.

    Examples
    --------
    >>> t = np.linspace(0.0, 1.0, 10_001)
    >>> thin = thinned_by_length(Path(t, 100.0 * t, 0.0 * t), 100)
    >>> len(thin.time), float(thin.north[-1])
    (101, 100.0)
    """
    if len(path.time) <= most:
        return path
    steps = np.hypot(np.diff(path.north), np.diff(path.east))
    length = np.concatenate(([0.0], np.cumsum(np.nan_to_num(steps))))
    if length[-1] == 0.0:
        return path.rows(_ends(path))
    part = np.floor(length / length[-1] * most)
    return path.rows(_ends(path) | np.concatenate(([True], part[1:] > part[:-1])))


def thinned_by_rows(path: Path, most: int) -> Path:
    """Every so many rows, with the ends of all unbroken parts: the same rows for every path of the same parts."""
    if len(path.time) <= most:
        return path
    every = -(-len(path.time) // most)
    return path.rows(_ends(path) | (np.arange(len(path.time)) % every == 0))


def within(path: Path, box: tuple[float, float, float, float]) -> Path:
    """The parts of a path inside a box (south, north, west, east) [m], each with one row beyond its ends."""
    south, north, west, east = box
    inside = (path.north >= south) & (path.north <= north) & (path.east >= west) & (path.east <= east)
    kept = inside.copy()
    kept[1:] |= inside[:-1]
    kept[:-1] |= inside[1:]
    rows = np.flatnonzero(kept)
    breaks = np.flatnonzero(np.diff(rows) > 1) + 1
    found = path.rows(rows)
    return Path(*(np.insert(part, breaks, np.nan) for part in (found.time, found.north, found.east)))


def nearest(path: Path, north: float, east: float) -> int | None:
    """Row nearest to a place; None where the path has none."""
    away = np.hypot(path.north - north, path.east - east)
    return int(np.nanargmin(away)) if np.isfinite(away).any() else None


def _ends(path: Path) -> Mask:
    """Mask of the first and last rows of every unbroken part, and of one row of every gap."""
    known = np.isfinite(path.north) & np.isfinite(path.east)
    before, after = np.append(False, known[:-1]), np.append(known[1:], False)
    return (known & ~(before & after)) | (~known & before)


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
    most = float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))
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
