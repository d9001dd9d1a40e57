"""How work comes onto the bench: a log, dropped or by its path, with its vehicle; a saved session; or the demo."""

from collections.abc import Callable, Mapping

from nicegui import ui

from ...workflows.workbench_facts import Source
from ..session import Session
from .log_files import LogFiles
from .words import button, line

_MADE = "made from the log"
_HULL = {
    "length": "length [m]",
    "mass": "loaded mass [kg]",
    "spacing": "thrusters apart [m]",
    "thrust": "full thrust of one [N]",
}


class Opening:
    """The page before a log is open, and the dialog by which another one is opened.

    Parameters
    ----------
    vehicles : names of those that come with undertow, each with what it is
    paths : see `LogFiles`
    leave : closes the dialog; None for a page
    """

    def __init__(
        self, session: Session, vehicles: Mapping[str, str], *, paths: bool, leave: Callable[[], object] | None = None
    ) -> None:
        self._session = session
        self._leave = leave
        with ui.element("section").classes("card stack").props('aria-label="Open a log"'):
            line("What does your boat model miss?", tag="h1")
            line(
                "Open a log of the boat. undertow compares it with a model, shows where the model fails, and names the "
                "physics that is missing. Nothing leaves this machine.",
                "muted",
            )
            with ui.element("div").classes("flow"):
                button("Try the demo", self._demo, lead=True, label="Try the demo: a boat recorded in Gazebo")
                line("four minutes of a BlueBoat in Gazebo, and a model with linear drag only", "muted small", "span")
            self._fields(vehicles, paths=paths)

    def _fields(self, vehicles: Mapping[str, str], *, paths: bool) -> None:
        with ui.element("div").classes("grid pair"):
            with ui.element("div").classes("stack"):
                line("1. The log", tag="h2")
                label = "or the path of a log, a folder, a pattern, a fleet or a session"
                self._files = LogFiles(self._session, paths=paths, path_label=label)
                line("or drop a session that was saved, with its log where that has moved.", "muted small")
            with ui.element("div").classes("stack"):
                line("2. The vehicle", tag="h2")
                self._choice = ui.select({_MADE: _MADE, **vehicles}, value=_MADE, label="vehicle")
                self._choice.props("outlined dense")
                self._hull = ui.element("div").classes("flow")
                with self._hull:
                    self._known = {
                        name: ui.number(label=told, min=0).props("outlined dense").style("width: 172px")
                        for name, told in _HULL.items()
                    }
                    line(
                        "What you leave empty is typical of a hull of that length, and marked so.",
                        "muted small",
                    )
                self._choice.on_value_change(lambda e: self._hull.set_visibility(e.value == _MADE))
                line(
                    "or drop your own vehicle.yaml, and a channel map called channels.yaml, beside the log.",
                    "muted small",
                )
        with ui.element("div").classes("flow"):
            button("Open", self._open, lead=True, label="Open the log")
            if self._leave is not None:
                button("Cancel", self._leave)
            self._told = line("", "small", "span").props('role="status"')

    async def _demo(self) -> None:
        await self._session.open(Source(), self._opened)

    def _opened(self) -> None:
        """Leave the dialog, if this is one, when the log is open; say what went wrong where it is not."""
        if self._told.is_deleted:
            return
        self._told.set_text(self._session.names.told(self._session.errands.trouble))
        if not self._session.errands.trouble and self._leave is not None:
            self._leave()

    async def _open(self) -> None:
        files = self._files
        if not files.logs:
            self._told.set_text("Drop a log above, or give its path; or try the demo.")
            return
        made = self._choice.value == _MADE and not files.vehicle
        hull = {name: float(field.value) for name, field in self._known.items() if made and field.value}
        vehicle = files.vehicle or ("" if made else str(self._choice.value))
        source = Source(
            files.logs,
            vehicle,
            tuple(hull.items()),
            channel_map=files.channel_map,
            frame=files.frame,
            as_is=files.as_is,
        )
        await self._session.open(source, self._opened)
