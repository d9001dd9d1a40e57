"""Paths on the water thinned to what a screen can show: a point every so many metres, gaps kept."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...physics.frames import Array
from .level_of_detail import Mask, Rows


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
    gap = np.nan
    return Path(*(np.insert(part, breaks, gap) for part in (found.time, found.north, found.east)))


def nearest(path: Path, north: float, east: float) -> int | None:
    """Row nearest to a place; None where the path has none."""
    away = np.hypot(path.north - north, path.east - east)
    return int(np.nanargmin(away)) if np.isfinite(away).any() else None


def _ends(path: Path) -> Mask:
    """Mask of the first and last rows of every unbroken part, and of one row of every gap."""
    known = np.isfinite(path.north) & np.isfinite(path.east)
    before, after = np.append(False, known[:-1]), np.append(known[1:], False)
    return (known & ~(before & after)) | (~known & before)
