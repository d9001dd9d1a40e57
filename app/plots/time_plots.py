"""Plots of logs over time: linked time plots, and the track on the water with what the models predict.

All rows stay here; the browser gets what its window shows.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from ...physics.motion import Array
from .level_of_detail import (
    Levels,
    Named,
    Path,
    joined,
    nearest,
    rounded,
    rounded_times,
    sent_number,
    thinned_by_length,
    thinned_by_rows,
    within,
)

Role = Literal["measured", "before", "after", "between"]

HEIGHT = 130
"""Of each panel [px]."""
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


class OverTime(Element):
    """A plot of logs over time; what it is told before there is a browser is sent once that has built it."""

    def __init__(self) -> None:
        super().__init__()
        self._mounted = False
        self._marks: list[tuple[float, float]] = []
        self._logs: list[Named] = []

    def divide(self, logs: Sequence[Named]) -> None:
        """Say which log lies where in time: name, begin and end [s] of each, in place of those said before."""
        self._logs = [(name, float(begin), float(end)) for name, begin, end in logs]
        self._tell("divide", self._logs)

    def mark(self, intervals: Sequence[tuple[float, float]]) -> None:
        """Shade stretches of time [s], in place of those shaded before."""
        self._marks = [(float(begin), float(end)) for begin, end in intervals]
        self._tell("mark", self._marks)

    def _tell(self, what: str, message: object) -> None:
        """Send a message, once there is a browser that has built the element."""
        if self._mounted:
            self.run_method(what, message)

    def _send_logs(self) -> None:
        self._tell("divide", self._logs)
        self._tell("mark", self._marks)


class TimePlots(OverTime, component="time_plots.js", dependencies=["drawing.js"], esm={"undertow-uplot": "uplot"}):
    """Panels above each other with one time axis.

    Drag to zoom, double-click for all, turn the wheel to zoom about the pointer, Shift and drag to select; where there
    is a touch screen, a button says whether a finger's drag zooms or selects. On the keyboard the arrows move the
    window, + and - zoom, Home shows all, Enter selects what is shown, Shift with the arrows moves the cursor.

    Parameters
    ----------
    panels : Sequence[Panel]
        From top to bottom.
    """

    def __init__(self, panels: Sequence[Panel]) -> None:
        super().__init__()
        titles = ", ".join(panel.title for panel in panels)
        self._props["panels"] = [asdict(panel) for panel in panels]
        self._props["height"] = HEIGHT
        self._props["label"] = (
            f"Time plots of {titles}. Arrow keys move, plus and minus zoom, Home shows all, Enter selects what is "
            "shown, Shift and arrow keys read values."
        )
        self._levels = Levels(np.empty(0), {})
        self._window: tuple[float, float] | None = None
        self._width = WIDTH
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
        """
        self._levels = Levels(time, columns)
        self._window = None
        self._draw(fresh=True)

    def change(self, columns: Mapping[str, Array]) -> None:
        """Put new values in place of some columns; the zoom stays, and the lines move to their new place."""
        self._levels.replace(columns)
        self._draw(moved=True)

    def on_brush(self, handler: Callable[[float, float], object]) -> None:
        """Call the handler with begin and end [s] of a stretch that was selected with Shift and a drag."""

        def brushed(event: GenericEventArguments) -> object:
            begin, end = sent_number(event.args, "begin"), sent_number(event.args, "end")
            return handler(begin, end) if begin is not None and end is not None else None

        self.on("brush", brushed)

    def _ready(self, event: GenericEventArguments) -> None:
        """The browser has built the element, for the first time or anew: it knows nothing yet."""
        self._mounted, self._width, self._window = True, self._columns_of(event), None
        self._draw(fresh=True)
        self._send_logs()

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
        if not self._mounted or not len(self._levels.time):
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


Places = tuple[Array, Array]
"""Metres north and metres east, each of shape (rows,)."""

TRACK_HEIGHT = 420
"""Of the picture [px]."""
MOST_MEASURED, MOST_PREDICTED = 4000, 6000
"""Points of a path that are sent at once: a path across a screen of 2,000 pixels and back."""
SIDES = ("south", "north", "west", "east")


class Track(OverTime, component="track.js", dependencies=["drawing.js"]):
    """The track, north up, with equal scales.

    A click picks the measured point nearest to it; the wheel zooms, a drag moves, a double-click shows all. On the
    keyboard the arrows move, + and - zoom, Home shows all, Enter picks the point nearest to the middle.
    """

    def __init__(self) -> None:
        super().__init__()
        self._props["height"] = TRACK_HEIGHT
        self._props["label"] = (
            "Track on the water, north up. Arrow keys move, plus and minus zoom, Home shows all, Enter picks the point "
            "in the middle."
        )
        self._measured = joined(())
        self._predicted: dict[str, Path] = {}
        self._paths: dict[str, Path] = {}
        self.on("ready", self._ready)
        self.on("view", self._viewed)

    def show(self, time: Array, north: Array, east: Array) -> None:
        """Show another track, whole, and forget what was predicted for the one before.

        Parameters
        ----------
        time : Array
            Ascending [s], shape (rows,).
        north, east : Array
            Measured positions [m], each of shape (rows,); NaN breaks the track.
        """
        self._measured = Path(time, north, east)
        self._predicted, self._paths = {}, {}
        if self._mounted:
            self._send_all()

    def predict(self, pieces: Mapping[str, Sequence[tuple[Array, Array, Array]]]) -> None:
        """Show predicted rollouts as thin lines, in place of those with the same role.

        Parameters
        ----------
        pieces : Mapping[str, Sequence[tuple[Array, Array, Array]]]
            By role, "before" or "after": time [s], north and east [m] of every rollout. No rollouts take the role's
            lines away.
        """
        self._predicted |= {role: joined(parts) for role, parts in pieces.items()}
        lines = self._lines(None)
        lines.pop("measured", None)
        self._tell("predict", lines)

    def path(
        self, time: Array, measured: Places | None = None, before: Places | None = None, after: Places | None = None
    ) -> None:
        """Show strongly the rollouts from a clicked point, in place of those shown so before; none takes them away.

        Parameters
        ----------
        time : Array
            Times of the rollouts [s], shape (rows,).
        measured, before, after : Places, optional
            North and east [m] of what was measured meanwhile and what is predicted.
        """
        given = {"measured": measured, "before": before, "after": after}
        self._paths = {role: Path(time, *places) for role, places in given.items() if places is not None}
        self._send_paths()

    def on_pick(self, handler: Callable[[float], object]) -> None:
        """Call the handler with the time [s] of the measured point nearest to a click."""

        def picked(event: GenericEventArguments) -> object:
            north, east = sent_number(event.args, "north"), sent_number(event.args, "east")
            if north is None or east is None:
                return None
            row = nearest(self._measured, north, east)
            return None if row is None else handler(float(self._measured.time[row]))

        self.on("pick", picked)

    def _ready(self) -> None:
        """The browser has built the element, for the first time or anew: it knows nothing yet."""
        self._mounted = True
        self._send_all()

    def _viewed(self, event: GenericEventArguments) -> None:
        """The browser looks closer: send what lies in its view with more points."""
        south, north, west, east = (sent_number(event.args, side) for side in SIDES)
        if south is None or north is None or west is None or east is None:
            return
        box = (south, north, west, east)
        self.run_method("detail", {"box": box, **self._lines(box)})

    def _lines(self, box: tuple[float, float, float, float] | None) -> dict[str, dict[str, Array]]:
        """Measured and predicted lines by role, thinned; those in a box, or all."""
        measured = self._measured if box is None else within(self._measured, box)
        lines = {"measured": _sent(thinned_by_length(measured, MOST_MEASURED))}
        for role, path in self._predicted.items():
            lines[role] = _sent(thinned_by_rows(path if box is None else within(path, box), MOST_PREDICTED))
        return lines

    def _send_all(self) -> None:
        self._tell("draw", self._lines(None))
        self._send_paths()
        self._send_logs()

    def _send_paths(self) -> None:
        self._tell("path", {role: _sent(path) for role, path in self._paths.items()})


def _sent(path: Path) -> dict[str, Array]:
    """A path as it goes to the browser."""
    return {"time": rounded_times(path.time), "north": rounded(path.north), "east": rounded(path.east)}
