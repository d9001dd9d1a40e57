"""The track on the water for the browser: what was measured, what the models predict, the path from a clicked point."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from ...physics.motion import Array
from .level_of_detail import (
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

Places = tuple[Array, Array]
"""Metres north and metres east, each of shape (rows,)."""

MOST_MEASURED, MOST_PREDICTED = 4000, 6000
"""Points of a path that are sent at once: a path across a screen of 2,000 pixels and back."""
SIDES = ("south", "north", "west", "east")


class Track(Element, component="track.js", dependencies=["drawing.js"]):
    """The track, north up, with equal scales.

    A click picks the measured point nearest to it; the wheel zooms, a drag moves, a double-click shows all. On the
    keyboard the arrows move, + and - zoom, Home shows all, Enter picks the point nearest to the middle.

    Parameters
    ----------
    height : int
        Of the picture [px].
    """

    def __init__(self, height: int = 420) -> None:
        super().__init__()
        self._props["height"] = height
        self._props["label"] = (
            "Track on the water, north up. Arrow keys move, plus and minus zoom, Home shows all, Enter picks the point "
            "in the middle."
        )
        self._measured: Path | None = None
        self._predicted: dict[str, Path] = {}
        self._paths: dict[str, Path] = {}
        self._marks: list[tuple[float, float]] = []
        self._logs: list[Named] = []
        self._box: tuple[float, float, float, float] | None = None
        self._mounted = False
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

        Raises
        ------
        ValueError
            If the three have not the same shape.
        """
        if not np.shape(time) == np.shape(north) == np.shape(east):
            raise ValueError(
                f"time, north and east have the shapes {np.shape(time)}, {np.shape(north)} and {np.shape(east)}: "
                "give one of each a row"
            )
        self._measured = Path(np.asarray(time), np.asarray(north), np.asarray(east))
        self._predicted, self._paths, self._box = {}, {}, None
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
        if self._mounted:
            self._send_predicted()

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
        self._paths = {role: Path(np.asarray(time), *places) for role, places in given.items() if places is not None}
        if self._mounted:
            self._send_paths()

    def divide(self, logs: Sequence[Named]) -> None:
        """Say which log lies where in time: name, begin and end [s] of each, in place of those said before."""
        self._logs = [(name, float(begin), float(end)) for name, begin, end in logs]
        if self._mounted:
            self.run_method("divide", self._logs)

    def mark(self, intervals: Sequence[tuple[float, float]]) -> None:
        """Shade the track where its time [s] lies in an interval, in place of what was shaded before."""
        self._marks = [(float(begin), float(end)) for begin, end in intervals]
        if self._mounted:
            self.run_method("mark", self._marks)

    def on_pick(self, handler: Callable[[float], object]) -> None:
        """Call the handler with the time [s] of the measured point nearest to a click."""

        def picked(event: GenericEventArguments) -> object:
            north, east = sent_number(event.args, "north"), sent_number(event.args, "east")
            if north is None or east is None or self._measured is None:
                return None
            row = nearest(self._measured, north, east)
            return None if row is None else handler(float(self._measured.time[row]))

        self.on("pick", picked)

    def _ready(self) -> None:
        """The browser has built the element, for the first time or anew: it knows nothing yet."""
        self._mounted, self._box = True, None
        self._send_all()

    def _viewed(self, event: GenericEventArguments) -> None:
        """The browser looks closer: send what lies in its view with more points."""
        south, north, west, east = (sent_number(event.args, side) for side in SIDES)
        if south is None or north is None or west is None or east is None or self._measured is None:
            return
        self._box = (south, north, west, east)
        self.run_method("detail", {"box": self._box, **self._lines(self._box)})

    def _lines(self, box: tuple[float, float, float, float] | None) -> dict[str, dict[str, Array]]:
        """Measured and predicted lines by role, thinned; those in a box, or all."""
        lines: dict[str, dict[str, Array]] = {}
        if self._measured is not None:
            measured = self._measured if box is None else within(self._measured, box)
            lines["measured"] = _sent(thinned_by_length(measured, MOST_MEASURED))
        for role, path in self._predicted.items():
            lines[role] = _sent(thinned_by_rows(path if box is None else within(path, box), MOST_PREDICTED))
        return lines

    def _send_all(self) -> None:
        self.run_method("draw", self._lines(None))
        self._send_paths()
        self.run_method("divide", self._logs)
        self.run_method("mark", self._marks)

    def _send_predicted(self) -> None:
        lines = self._lines(None)
        lines.pop("measured", None)
        self.run_method("predict", lines)

    def _send_paths(self) -> None:
        self.run_method("path", {role: _sent(path) for role, path in self._paths.items()})


def _sent(path: Path) -> dict[str, Array]:
    """A path as it goes to the browser."""
    return {"time": rounded_times(path.time), "north": rounded(path.north), "east": rounded(path.east)}
