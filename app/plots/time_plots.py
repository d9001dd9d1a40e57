"""Linked time plots, one cursor and one zoom; all rows stay here, the browser gets what its window shows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from ...physics.motion import Array
from .level_of_detail import Levels, Named, rounded, rounded_times, sent_number

Role = Literal["measured", "before", "after", "between"]

WIDTH = 1000
"""Columns of pixels until the browser has told its own."""
WIDEST = 8192
"""Columns of pixels that a browser may ask for: more than any screen has."""


@dataclass(frozen=True, slots=True)
class Line:
    """One series of a panel: its column, what the key calls it, and whose colour it has."""

    name: str
    label: str
    role: Role


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot above the time axis: its title, the unit of its values, its lines from back to front.

    `band` names the columns of the lower and the upper end of what is shaded behind the line after; none for no band.
    """

    title: str
    unit: str
    lines: Sequence[Line]
    band: tuple[str, ...] = ()


class TimePlots(Element, component="time_plots.js", dependencies=["drawing.js"], esm={"undertow-uplot": "uplot"}):
    """Panels above each other with one time axis.

    Drag to zoom, double-click for all, turn the wheel to zoom about the pointer, Shift and drag to select; where there
    is a touch screen, a button says whether a finger's drag zooms or selects. On the keyboard the arrows move the
    window, + and - zoom, Home shows all, Enter selects what is shown, Shift with the arrows moves the cursor.

    Parameters
    ----------
    panels : Sequence[Panel]
        From top to bottom.
    height : int
        Of each panel [px].
    """

    def __init__(self, panels: Sequence[Panel], height: int = 130) -> None:
        super().__init__()
        titles = ", ".join(panel.title for panel in panels)
        self._props["panels"] = [asdict(panel) for panel in panels]
        self._props["height"] = height
        self._props["label"] = (
            f"Time plots of {titles}. Arrow keys move, plus and minus zoom, Home shows all, Enter selects what is "
            "shown, Shift and arrow keys read values."
        )
        self._levels: Levels | None = None
        self._marks: list[tuple[float, float]] = []
        self._logs: list[Named] = []
        self._window: tuple[float, float] | None = None
        self._width = 0
        self.on("ready", self._ready)
        self.on("window", self._looked)

    @property
    def is_ignoring_events(self) -> bool:
        """Never: plots that are hidden still tell that the browser has built them, or they would stay empty."""
        return False

    def show(self, time: Array, columns: Mapping[str, Array]) -> None:
        """Show other rows, whole.

        Parameters
        ----------
        time : Array
            Ascending [s], shape (rows,).
        columns : Mapping[str, Array]
            Values by the name of their line, each of shape (rows,); NaN breaks a line, a line without values is not
            drawn.

        Raises
        ------
        ValueError
            If the times do not ascend, or a column has another length.
        """
        if len(time) and not np.all(np.diff(time) >= 0.0):
            raise ValueError("time plots need times that ascend: sort the rows, or show each log on its own")
        self._levels = Levels(time, columns)
        self._window = None
        self._draw(fresh=True)

    def change(self, columns: Mapping[str, Array]) -> None:
        """Put new values in place of some columns; the zoom stays, and the lines move to their new place.

        Raises
        ------
        ValueError
            If nothing is shown yet, or a column has another length than the time.
        """
        if self._levels is None:
            raise ValueError("nothing is shown yet: call show(time, columns) before change(columns)")
        self._levels.replace(columns)
        self._draw(moved=True)

    def divide(self, logs: Sequence[Named]) -> None:
        """Say which log lies where in time: name, begin and end [s] of each, in place of those said before."""
        self._logs = [(name, float(begin), float(end)) for name, begin, end in logs]
        if self._width:
            self.run_method("divide", self._logs)

    def mark(self, intervals: Sequence[tuple[float, float]]) -> None:
        """Shade stretches of time [s] in every panel, in place of those shaded before."""
        self._marks = [(float(begin), float(end)) for begin, end in intervals]
        if self._width:
            self.run_method("mark", self._marks)

    def on_brush(self, handler: Callable[[float, float], object]) -> None:
        """Call the handler with begin and end [s] of a stretch that was selected with Shift and a drag."""

        def brushed(event: GenericEventArguments) -> object:
            begin, end = sent_number(event.args, "begin"), sent_number(event.args, "end")
            return handler(begin, end) if begin is not None and end is not None else None

        self.on("brush", brushed)

    def _ready(self, event: GenericEventArguments) -> None:
        """The browser has built the element, for the first time or anew: it knows nothing yet."""
        self._width = self._columns_of(event)
        self._window = None
        self._draw(fresh=True)
        self.run_method("divide", self._logs)
        self.run_method("mark", self._marks)

    def _looked(self, event: GenericEventArguments) -> None:
        """The browser shows another window, or has another width."""
        begin, end = sent_number(event.args, "begin"), sent_number(event.args, "end")
        if begin is None or end is None or begin >= end:
            return
        self._width, self._window = self._columns_of(event), (begin, end)
        self._draw(asked=int(sent_number(event.args, "asked") or 0))

    def _columns_of(self, event: GenericEventArguments) -> int:
        """Columns of pixels that the browser has."""
        return int(min(max(sent_number(event.args, "width") or WIDTH, 1.0), WIDEST))

    def _draw(self, *, fresh: bool = False, moved: bool = False, asked: int = -1) -> None:
        """Send the window, once there is a browser to draw it."""
        if self._levels is None or not self._width or not len(self._levels.time):
            return
        first, last = float(self._levels.time[0]), float(self._levels.time[-1])
        whole = first, last if last > first else first + 1.0  # an axis without length has no ticks
        begin, end = self._window or whole
        time, columns = self._levels.window(begin, end, self._width)
        message = {
            "time": rounded_times(time),
            "columns": {name: rounded(column) for name, column in columns.items()},
            "window": (begin, end),
            "whole": whole,
            "fresh": fresh,
            "moved": moved,
            "asked": asked,
        }
        self.run_method("draw", message)
