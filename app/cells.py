"""The map of failure: the force that a model leaves, by where the boat was, as cells that can be picked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..physics.frames import Array

AXES = {"X": ("surge", "N"), "Y": ("sway", "N"), "N": ("yaw", "N m")}
"""Forces by their column: axis and unit."""
_CELLS = (14, 10)
"""Cells across and up: as many as a finger can hit on a small screen."""
_FEWEST = 5
"""Rows below which a cell has no colour: its error would be chance."""
_ENDS = (0.002, 0.998)
"""Shares of the rows between which the map reaches, so that a spike does not squeeze it."""


@dataclass(frozen=True, slots=True, eq=False)
class Sorted:
    """Rows sorted into cells.

    Attributes
    ----------
    edges : of the cells across (nx + 1,) and up (ny + 1,)
    cell : number of the cell of each row, x * ny + y; -1 for one that lies in none
    """

    edges: tuple[Array, Array]
    cell: np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """Cells across and up."""
        return self.edges[0].size - 1, self.edges[1].size - 1

    def error(self, force: Array) -> tuple[Array, Array]:
        """Root mean square of a force (rows,) in every cell, NaN where there are too few rows, and rows in each."""
        known = (self.cell >= 0) & np.isfinite(force)
        size = self.shape[0] * self.shape[1]
        count = np.bincount(self.cell[known], minlength=size)
        squares = np.bincount(self.cell[known], weights=force[known] ** 2, minlength=size)
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.where(count >= _FEWEST, np.sqrt(squares / count), np.nan)
        return error.reshape(self.shape), count.reshape(self.shape).astype(float)

    def stretches(self, time: Array, picked: Sequence[tuple[int, int]]) -> tuple[tuple[float, float], ...]:
        """The stretches of time [s] in which the boat was in some cells; what is less than a second apart is one."""
        chosen = np.isin(self.cell, [x * self.shape[1] + y for x, y in picked])
        rows = np.flatnonzero(chosen)
        if not rows.size:
            return ()
        apart = np.flatnonzero(np.diff(time[rows]) > 1.0)
        first, last = rows[np.r_[0, apart + 1]], rows[np.r_[apart, rows.size - 1]]
        return tuple((float(time[a]), float(time[b])) for a, b in zip(first, last, strict=True))


def sort_rows(across: Array, up: Array) -> Sorted:
    """Sort rows into cells of one size over two quantities (rows,)."""
    known = np.isfinite(across) & np.isfinite(up)
    edges, places = [], []
    for values, cells in zip((across, up), _CELLS, strict=True):
        low, high = np.quantile(values[known], _ENDS) if known.any() else (0.0, 1.0)
        high = high if high > low else low + 1.0
        edges.append(np.linspace(low, high, cells + 1))
        with np.errstate(invalid="ignore"):
            places.append(np.floor((values - low) / (high - low) * cells * (1.0 - 1e-12)))
    x, y = places
    inside = known & (x >= 0) & (x < _CELLS[0]) & (y >= 0) & (y < _CELLS[1])
    cell = np.full(across.size, -1)
    cell[inside] = (x[inside] * _CELLS[1] + y[inside]).astype(int)
    return Sorted((edges[0], edges[1]), cell)


def common_command(table: Mapping[str, Array], commands: Sequence[str]) -> Array:
    """What all thrusters are told, each in shares of its own largest command from its neutral, (rows,)."""
    shares = []
    for name in commands:
        values = table[name] - (1500.0 if name.startswith("pwm_") else 0.0)
        most = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 0.0
        shares.append(values / (most or 1.0))
    return np.mean(shares, axis=0)
