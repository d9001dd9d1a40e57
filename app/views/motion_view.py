"""Measured against predicted: time plots, the track on the water, and where the model fails; one selection for all."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
from nicegui import ui

from ...reports.model_words import band_words, held_words
from ...workflows.workbench_facts import Fit, Opened
from ..plots.error_map import AXES, Cells, ErrorMap, Sorted, common_command, sort_rows
from ..plots.time_plots import Line, Panel, TimePlots, Track
from ..session import Session
from ..shown import View
from .words import button, line, watching

_SPEEDS = tuple(
    Panel(
        title,
        unit,
        (
            Line(name, "measured", "measured"),
            Line(f"{name}_before", "as it was", "before"),
            Line(f"{name}_after", "now", "after"),
        ),
        (f"{name}_low_after", f"{name}_high_after"),
    )
    for name, title, unit in (("u", "surge speed", "m/s"), ("v", "sway speed", "m/s"), ("r", "yaw rate", "rad/s"))
)
_MISSING = tuple(
    Panel(
        f"missing {axis} force",
        unit,
        (Line(f"{name}_before", "as it was", "before"), Line(f"{name}_after", "now", "after")),
    )
    for name, (axis, unit) in AXES.items()
)
_STATES = ("u", "v", "r")
_ENDS = tuple(f"{name}_{end}" for name in _STATES for end in ("low", "high"))
"""Columns of the band, of a model that has one."""


class MotionView:
    """Plots, track and map of one session, each told of what the others select."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._opened: object = None
        self._fit: object = None
        self._choices: dict[str, ui.toggle] = {}
        self._sorted: dict[str, Sorted] = {}
        self._view: object = None
        self._marked: object = None
        self._of_cells: object = None
        host = ui.element("div").classes("stack")
        with host:
            self._plots()
            with ui.element("div").classes("grid pair").style("margin-top: 0"):
                self._track_card()
                self._map_card()
        watching(session, host, self._refresh)

    def _plots(self) -> None:
        with ui.element("section").classes("card").props('aria-label="Measured against predicted"'):
            with ui.element("div").classes("flow"):
                line("Measured against predicted", tag="h2").style("margin: 0; flex: 1")
                self._choice("drawn", {"speeds": "Speeds", "forces": "Missing force"}, "What is drawn")
            self._speeds = TimePlots(_SPEEDS)
            self._forces = TimePlots(_MISSING)
            for plots in (self._speeds, self._forces):
                plots.on_brush(lambda begin, end: self._session.shown.select(((begin, end),)))
            self._band = line("", "muted small")
            self._none = button("Clear selection", lambda: self._session.shown.select(()))

    def _track_card(self) -> None:
        with ui.element("section").classes("card").props('aria-label="Track on the water"'):
            line("On the water", tag="h2")
            self._track = Track()
            self._track.on_pick(self._way)
            line("Click the track: both models go from there for 30 s.", "muted small")

    def _map_card(self) -> None:
        with ui.element("section").classes("card").props('aria-label="Where it fails"'):
            with ui.element("div").classes("flow"):
                line("Where it fails", tag="h2").style("margin: 0; flex: 1")
                self._choice("axis", {key: name for key, (name, _) in AXES.items()}, "Axis of the force")
            over = {"turn": "speed and turn", "command": "speed and command"}
            self._choice("over", over, "What the map is over")
            self._map = ErrorMap()
            self._map.on_pick(self._picked)
            line("The force that the model leaves, by what the boat did. Click cells to select.", "muted small")

    def _choice(self, field: str, options: Mapping[str, str], label: str) -> None:
        """A choice of what is drawn, which a field of the view holds."""
        made = ui.toggle(dict(options), value=getattr(self._of_view, field))
        made.props(f'dense no-caps unelevated aria-label="{label}"').classes("small")
        made.on_value_change(lambda event: self._look(**{field: event.value}))
        self._choices[field] = made

    @property
    def _of_view(self) -> View:
        return self._session.shown.view

    def _look(self, **changes: str) -> None:
        """Draw something else."""
        self._session.shown.view = replace(self._of_view, **changes)
        self._refresh()

    def _turn(self) -> None:
        """Turn to what the view says, which a session that was opened again may say, too."""
        view = self._of_view
        for field, choice in self._choices.items():
            choice.set_value(getattr(view, field))
        self._speeds.set_visibility(view.drawn != "forces")
        self._forces.set_visibility(view.drawn == "forces")

    def _refresh(self) -> None:
        session = self._session
        if self._of_view != self._view:
            self._view = self._of_view
            self._turn()
            self._map_of()
        opened, fit = session.shown.opened, session.shown.fit
        if opened is None or fit is None:
            return
        if opened is not self._opened or fit is not self._fit:
            speeds, forces = _after(opened, fit, _STATES + _ENDS), _after(opened, fit, tuple(AXES))
            if opened is not self._opened:
                self._measured(opened, speeds, forces)
            else:
                self._speeds.change(speeds)
                self._forces.change(forces)
            self._opened, self._fit = opened, fit
            self._predict(opened, fit)
            self._map_of()
        marked = session.shown.selected
        if marked != self._marked:
            self._marked = marked
            if marked != self._of_cells:
                self._map.unpick()
            for view in (self._speeds, self._forces, self._track):
                view.mark(marked)
        self._none.style(f"visibility: {'visible' if marked else 'hidden'}")  # its place stays

    def _measured(self, opened: Opened, speeds: dict[str, np.ndarray], forces: dict[str, np.ndarray]) -> None:
        """Draw another log, with what the model makes of its speeds and leaves of its forces."""
        self._sorted = {}
        table, first = opened.table, opened.nominal
        measured = {name: table[name] for name in _STATES} | _drawn(opened, first, "before", _STATES)
        self._speeds.show(table["time"], measured | speeds)
        self._forces.show(table["time"], _drawn(opened, first, "before", tuple(AXES)) | forces)
        self._track.show(table["time"], table["north"], table["east"])
        logs = [(self._session.names.with_user_names(log.name), log.begin, log.end) for log in opened.logs]
        for view in (self._speeds, self._forces, self._track):
            view.divide(logs)

    def _predict(self, opened: Opened, fit: Fit) -> None:
        """Draw the ways of the models on the water, and tell of the band of what is drawn."""
        after = [] if fit is opened.nominal else _pieces(opened, fit)
        self._track.predict({"before": _pieces(opened, opened.nominal), "after": after})
        told = (band_words(fit.band), held_words(fit.held, "the model"))
        self._band.set_text(" ".join(filter(None, told)))
        self._track.path(np.zeros(0))  # what was predicted from a place was of another model

    async def _way(self, time: float) -> None:
        way, shown = await self._session.way(time), self._session.shown
        if way is not None and shown.opened is not None:
            plain = shown.fit is shown.opened.nominal
            self._track.path(way.time, (*way.measured.T,), (*way.before.T,), None if plain else (*way.after.T,))

    def _map_of(self) -> None:
        opened, fit, view = self._session.shown.opened, self._session.shown.fit, self._of_view
        if opened is None or fit is None or opened is not self._opened:
            return
        found = self._cells(opened)
        before, _ = found.error(opened.nominal.columns[view.axis])
        error, count = found.error(fit.columns[view.axis])
        top = float(np.nanquantile(before, 0.98)) if np.isfinite(before).any() else 1.0
        up_label = "yaw rate [rad/s]" if view.over == "turn" else "command, share of the largest"
        name, unit = AXES[view.axis]
        seconds = count * float(np.nanmedian(np.diff(opened.table["time"])))
        self._map.show(Cells(*found.edges, "surge speed [m/s]", up_label, error, seconds, f"{unit} in {name}", top))

    def _cells(self, opened: Opened) -> Sorted:
        """The rows of a log in the cells of the map, sorted once: a slider draws the map anew at every step."""
        over = self._of_view.over
        if over not in self._sorted:
            table = opened.table
            self._sorted[over] = sort_rows(
                table["u"], table["r"] if over == "turn" else common_command(table, opened.commands)
            )
        return self._sorted[over]

    def _picked(self, cells: list[tuple[int, int]]) -> None:
        opened = self._session.shown.opened
        if opened is not None:
            self._of_cells = self._cells(opened).stretches(opened.table["time"], cells)
            self._session.shown.select(self._of_cells)


def _after(opened: Opened, fit: Fit, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """The present model's columns; nothing to draw while it is the nominal one."""
    nothing = {f"{name}_after": np.full(opened.table["time"].size, np.nan) for name in names}
    if fit is opened.nominal or not (fit.names or not fit.unseen):
        return nothing
    return nothing | _drawn(opened, fit, "after", tuple(name for name in names if name in fit.columns))


def _drawn(opened: Opened, fit: Fit, role: str, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """A model's columns as lines that break where a prediction begins anew; forces are no predictions."""
    anew = opened.table["anew"] == 1.0
    return {f"{n}_{role}": fit.columns[n] if n in AXES else np.where(anew, np.nan, fit.columns[n]) for n in names}


def _pieces(opened: Opened, fit: Fit) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """A model's way, cut where it begins anew."""
    time, north, east = opened.table["time"], fit.columns["north"], fit.columns["east"]
    begins = np.flatnonzero(~(opened.table["anew"] == 0.0))
    edges = [*begins.tolist(), time.size]
    return [
        (time[a:b], north[a:b], east[a:b]) for a, b in pairwise(edges) if b - a > 1 and np.isfinite(north[a:b]).all()
    ]
