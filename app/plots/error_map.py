"""Map of failure: a model's error in cells of what the boat did or where it was; picked cells select their rows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from ...physics.motion import Array
from ...physics.presentation import MINUS, number

Cell = tuple[int, int]
"""Place of a cell along x and along y, from zero."""

STEPS = 6
"""Colours of the scale, --heat1 to --heat6."""


@dataclass(frozen=True, slots=True)
class Cells:
    """A model's error over two quantities.

    Parameters
    ----------
    x_edges, y_edges : Array
        Ascending, shapes (nx + 1,) and (ny + 1,).
    x_label, y_label : str
        What they are, with their units.
    value : Array
        Error in every cell, shape (nx, ny); NaN where no rows lie.
    count : Array
        Seconds of log in every cell, shape (nx, ny).
    unit : str
        Of the error.
    top : float
        Error at the top of the colour scale: the same for maps that are to be compared.
    """

    x_edges: Array
    y_edges: Array
    x_label: str
    y_label: str
    value: Array
    count: Array
    unit: str
    top: float


class ErrorMap(Element, component="error_map.js", dependencies=["drawing.js"]):
    """Cells coloured by error.

    A click picks a cell, with Shift or Ctrl one more, a drag all that it touches; a click on the only picked cell, or
    Escape, picks none. On the keyboard the arrows go from cell to cell, Enter or Space picks.
    """

    def __init__(self) -> None:
        super().__init__()
        self._cells: Cells | None = None
        self._picked: list[Cell] = []
        self._mounted = False
        self.on("ready", self._ready)

    def show(self, cells: Cells) -> None:
        """Show cells in place of those before; colours move to their new value where the edges are the same."""
        if self._cells is None or not _alike(self._cells, cells):
            self._picked = []
        self._cells = cells
        self._send()

    def unpick(self) -> None:
        """Take the outlines of picked cells away, without a call of the handlers."""
        self._picked = []
        if self._mounted:
            self.run_method("pick", self._picked)

    def on_pick(self, handler: Callable[[list[Cell]], object]) -> None:
        """Call the handler with the cells (i, j) that are picked now; none when the selection was taken back."""

        def picked(event: GenericEventArguments) -> object:
            sent, cells = event.args.get("cells"), self._cells
            known = [] if cells is None or not isinstance(sent, list) else [one for one in sent if _inside(one, cells)]
            self._picked = [(i, j) for i, j in known]
            return handler(list(self._picked))

        self.on("pick", picked)

    def _ready(self) -> None:
        """The browser has built the element, for the first time or anew: it knows nothing yet."""
        self._mounted = True
        self._send()

    def _send(self) -> None:
        """Send the cells, once there is a browser to draw them."""
        if self._cells is None or not self._mounted:
            return
        cells = self._cells
        self.run_method(
            "draw",
            {
                "x": {"edges": cells.x_edges.tolist(), "label": cells.x_label},
                "y": {"edges": cells.y_edges.tolist(), "label": cells.y_label},
                "cells": [
                    {
                        "i": i,
                        "j": j,
                        "level": level_of(float(cells.value[i, j]), cells.top),
                        "told": cell_in_words(cells, i, j),
                    }
                    for i, j in np.argwhere(np.isfinite(cells.value)).tolist()
                ],
                "unit": cells.unit,
                "scale": [number(k * cells.top / STEPS, 2) for k in range(STEPS + 1)],
            },
        )
        self.run_method("pick", self._picked)


def level_of(value: float, top: float) -> int:
    """The colour of an error: 1 from zero on, 6 just below the top of the scale and above it.

    Examples
    --------
    >>> [level_of(value, 0.6) for value in (0.0, 0.05, 0.31, 0.59, 2.0)]
    [1, 1, 4, 6, 6]
    """
    return min(max(int(STEPS * value / top) + 1, 1), STEPS) if top > 0.0 else 1


def cell_in_words(cells: Cells, i: int, j: int) -> str:
    """A cell in words: its ranges, its error, and how much of the log it holds."""
    ranges = (
        f"{label} {number(edges[k], 2, minus=MINUS)} to {number(edges[k + 1], 2, minus=MINUS)}"
        for label, edges, k in ((cells.x_label, cells.x_edges, i), (cells.y_label, cells.y_edges, j))
    )
    error = f"error {number(cells.value[i, j], 2)} {cells.unit}".rstrip()
    return f"{', '.join(ranges)}: {error}, {number(cells.count[i, j], 2)} s"


def _inside(cell: object, cells: Cells) -> bool:
    """True when something is a cell of the map."""
    if not isinstance(cell, list | tuple) or len(cell) != 2:
        return False
    return all(type(k) is int and 0 <= k < most for k, most in zip(cell, cells.value.shape, strict=True))


def _alike(one: Cells, other: Cells) -> bool:
    """True when two maps have the same cells."""
    return np.array_equal(one.x_edges, other.x_edges) and np.array_equal(one.y_edges, other.y_edges)


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
