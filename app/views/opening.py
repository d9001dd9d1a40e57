"""How a log comes onto the bench: dropped, chosen by its path, or the one of the demo; and its vehicle."""

from collections.abc import Callable, Mapping
from itertools import count
from pathlib import Path
from weakref import proxy

from nicegui import events, ui

from ...physics.printable import one_line
from ...workflows.workbench_facts import Source
from ..closed_to_strangers import MOST_UPLOADED
from ..session import Session
from .words import button, line

SUFFIXES = (
    *(".csv.gz", ".csv", ".parquet", ".bin", ".log", ".tlog", ".ulg", ".mcap", ".db3", ".bag", ".mat"),
    *(".yaml", ".yml"),
)
"""Ends of file names that an upload may keep; of a name from the browser nothing else becomes a part of a path."""
_MADE = "made from the log"
_KINDS = {"log": "a log", "vehicle": "the vehicle file", "map": "the channel map"}
_LONGEST = 120
"""Characters of a name from the browser that are shown."""
_COUNT = count(1)
"""Numbers of uploads: no two are kept under one name."""
_HULL = {
    "length": "length [m]",
    "mass": "loaded mass [kg]",
    "spacing": "thrusters apart [m]",
    "thrust": "full thrust of one [N]",
}


def stored_as(name: str, number: int) -> str:
    """The name under which an upload is kept: its number, and its kind where that is known.

    Examples
    --------
    >>> stored_as("../../etc/my log.CSV", 1), stored_as("run.exe", 2)
    ('upload-1.csv', 'upload-2')
    """
    lower = name.lower()
    return f"upload-{number}{next((end for end in SUFFIXES if lower.endswith(end)), '')}"


class Opening:
    """The page before a log is open, and the dialog by which another one is opened.

    Parameters
    ----------
    vehicles : names of those that come with undertow, each with what it is
    paths : files of this machine may be named; not where others than its user may see the page
    leave : closes the dialog; None for a page
    """

    def __init__(
        self, session: Session, vehicles: Mapping[str, str], *, paths: bool, leave: Callable[[], object] | None = None
    ) -> None:
        self._session = session
        self._leave = leave
        self._files: dict[Path, str] = {}
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
        kept = proxy(self)  # FastAPI keeps an upload beyond its page, which would keep all of this
        with ui.element("div").classes("grid pair"):
            with ui.element("div").classes("stack"):
                line("1. The log", tag="h2")
                with ui.element("div").classes("drop"):
                    self._upload = ui.upload(
                        label="Drop logs here, or press +",
                        multiple=True,
                        auto_upload=True,
                        max_file_size=MOST_UPLOADED,
                        on_upload=lambda event: kept._uploaded(event),
                        on_rejected=lambda: ui.notify("This file is too large to upload: give its path instead."),
                    )
                    self._upload.props('flat aria-label="Upload logs" no-thumbnails')
                self._dropped = ui.element("div").classes("stack")
                self._path = ui.input(label="or the path of a log, a folder, a pattern or a fleet") if paths else None
                if self._path is not None:
                    self._path.props("outlined dense")
                self._frame = ui.select({"": "axes as the log says", "enu": "ENU / FLU", "ned": "NED / FRD"}, value="")
                self._frame.props('outlined dense label="axes"')
                self._as_is = ui.checkbox("take a broken log as it is (every result then carries a warning)")
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

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        name = shown(event.file.name)
        self._upload.reset()
        if not name.lower().endswith(SUFFIXES):
            self._told.set_text(f"{name} is no log that undertow reads: {', '.join(SUFFIXES)}")
            return
        target = self._session.folder / stored_as(name, next(_COUNT))
        await event.file.save(target)
        self._session.names.call(target, name)
        self._files[target] = name
        self._told.set_text("")
        self._list()

    def _list(self) -> None:
        """The files that were dropped, each with what it is taken for and a button that takes it out."""
        self._dropped.clear()
        with self._dropped:
            for path, name in self._files.items():
                with ui.element("div").classes("flow small"):
                    line(f"{name}: {_KINDS[_kind(path, name)]}", tag="span")
                    button("\N{MULTIPLICATION SIGN}", lambda path=path: self._take_out(path), label=f"Take {name} out")

    def _take_out(self, path: Path) -> None:
        self._files.pop(path, None)
        path.unlink(missing_ok=True)
        self._list()

    def _opened(self) -> None:
        """Leave the dialog, if this is one, when the log is open; say what went wrong where it is not."""
        if self._told.is_deleted:
            return
        self._told.set_text(self._session.names.told(self._session.errands.trouble))
        if not self._session.errands.trouble and self._leave is not None:
            self._leave()

    def _of(self, kind: str) -> list[str]:
        return [str(path) for path, name in self._files.items() if _kind(path, name) == kind]

    async def _open(self) -> None:
        path = "" if self._path is None else (self._path.value or "").strip()
        logs = (*self._of("log"), *([path] if path else []))
        own, mapped = self._of("vehicle"), self._of("map")
        if not logs:
            self._told.set_text("Drop a log above, or give its path; or try the demo.")
            return
        made = self._choice.value == _MADE and not own
        hull = {name: float(field.value) for name, field in self._known.items() if made and field.value}
        vehicle = own[-1] if own else ("" if made else str(self._choice.value))
        await self._session.open(
            Source(
                logs,
                vehicle,
                tuple(hull.items()),
                channel_map=mapped[-1] if mapped else "",
                frame=self._frame.value,
                as_is=bool(self._as_is.value),
            ),
            self._opened,
        )


def shown(name: str) -> str:
    """The last part of a name from the browser, as it may be shown."""
    return one_line(name.replace("\\", "/").rsplit("/", 1)[-1])[:_LONGEST] or "a file without a name"


def _kind(path: Path, name: str) -> str:
    if path.suffix not in (".yaml", ".yml"):
        return "log"
    return "map" if "channel" in name.lower() or "map" in name.lower() else "vehicle"
