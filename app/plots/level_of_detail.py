"""Long series thinned to what a screen can show: least and greatest value in every column of pixels."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...physics.frames import Array

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
    seen = last - first <= TORN * width
    thin: dict[str, Array] = {}
    torn: dict[str, Rows] = {}
    for name, column in columns.items():
        part = column[first:last]
        gaps = np.isnan(part)
        filled = np.where(gaps, np.inf, part), np.where(gaps, -np.inf, part)
        thin[name] = _in_order(column, (starts, ends), filled, starts - first)
        if seen and gaps.any():
            inside = np.logical_or.reduceat(gaps, starts - first) & ~np.isnan(thin[name][:, 0])
            place = np.where(gaps[starts - first], 0, np.where(gaps[ends - 1 - first], 2, 1))
            torn[name] = np.where(inside, place, -1)
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
            self._blocks[name] = _of_blocks(column, np.inf, np.minimum), _of_blocks(column, -np.inf, np.maximum)

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


def _of_blocks(column: Array, nothing: float, extreme: np.ufunc) -> Array:
    """Extreme of every block of rows, gaps left out; `nothing` where a block is all gap."""
    whole = len(column) // BLOCK * BLOCK
    filled = np.where(np.isnan(column), nothing, column)
    parts = extreme.reduce(filled[:whole].reshape(-1, BLOCK), axis=1)
    rest = filled[whole:]
    return np.append(parts, extreme.reduce(rest)) if rest.size else parts


def _in_order(column: Array, buckets: tuple[Rows, Rows], extremes: tuple[Array, Array], at: Rows) -> Array:
    """Both extremes of every bucket, shape (buckets, 2), the smaller first where the series rises; NaN in a gap.

    `extremes` are the least and the greatest values of rows, or of blocks of them, and each bucket begins `at` one.
    """
    starts, ends = buckets
    low, high = np.minimum.reduceat(extremes[0], at), np.maximum.reduceat(extremes[1], at)
    rises = column[starts] <= column[ends - 1]
    pair = np.stack((np.where(rises, low, high), np.where(rises, high, low)), axis=1)
    pair[low > high] = np.nan
    return pair


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
