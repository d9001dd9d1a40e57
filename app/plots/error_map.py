"""The map of failure for the browser: a model's error in cells of what the boat did; picked cells select their rows."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from ...physics.frames import Array
from ...physics.in_words import MINUS, number

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
        """Show cells in place of those before; colours move to their new value where the edges are the same.

        Raises
        ------
        ValueError
            If the shapes do not fit each other.
        """
        shape = len(cells.x_edges) - 1, len(cells.y_edges) - 1
        if np.shape(cells.value) != shape or np.shape(cells.count) != shape:
            raise ValueError(
                f"value and count have the shapes {np.shape(cells.value)} and {np.shape(cells.count)}, the edges make "
                f"{shape} cells: give one of each a cell"
            )
        if self._cells is None or not _alike(self._cells, cells):
            self._picked = []
        self._cells = cells
        self._send()

    def pick(self, cells: Iterable[Cell]) -> None:
        """Outline cells as picked, in place of those before, without a call of the handlers."""
        self._picked = [self._known(int(i), int(j)) for i, j in cells]
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

    def _known(self, i: int, j: int) -> Cell:
        if self._cells is None or not _inside((i, j), self._cells):
            raise ValueError(f"there is no cell ({i}, {j}) in the map that is shown: show(cells) comes first")
        return i, j

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
                    {"i": i, "j": j, "level": level_of(float(cells.value[i, j]), cells.top), "told": told(cells, i, j)}
                    for i, j in zip(*map(np.ndarray.tolist, np.nonzero(np.isfinite(cells.value))), strict=True)
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


def told(cells: Cells, i: int, j: int) -> str:
    """A cell in words: its ranges, its error, and how much of the log it holds."""
    ranges = (
        f"{label} {number(edges[k], 2, minus=MINUS)} to {number(edges[k + 1], 2, minus=MINUS)}"
        for label, edges, k in ((cells.x_label, cells.x_edges, i), (cells.y_label, cells.y_edges, j))
    )
    error = f"error {number(cells.value[i, j], 2)} {cells.unit}".rstrip()
    return f"{', '.join(ranges)}: {error}, {number(cells.count[i, j], 2)} s"


def _inside(cell: object, cells: Cells) -> bool:
    """Whether something is a cell of the map."""
    if not isinstance(cell, list | tuple) or len(cell) != 2:
        return False
    return all(type(k) is int and 0 <= k < most for k, most in zip(cell, cells.value.shape, strict=True))


def _alike(one: Cells, other: Cells) -> bool:
    """Whether two maps have the same cells."""
    return np.array_equal(one.x_edges, other.x_edges) and np.array_equal(one.y_edges, other.y_edges)
