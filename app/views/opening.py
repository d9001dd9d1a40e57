"""Opening and taking away: a log, a saved session or the demo comes onto the bench; page, model, commands leave it."""

from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from pathlib import Path
from weakref import proxy

from nicegui import events, ui
from nicegui.elements.mixins.text_element import TextElement

from ...physics.errors import one_line
from ...workflows.workbench_facts import Source
from ..session import Session
from ..steps import MOST_UPLOADED
from .words import button, dialog, line, redrawn


def taking_away(session: Session) -> None:
    """A menu button in the bar."""
    with button("Take away", lambda: None, lead=True), ui.menu().props('aria-label="Take away"'):
        for mark, (name, told, act) in _THINGS.items():
            with ui.menu_item(on_click=partial(act, session)).mark(mark), ui.element("div"):
                line(name, tag="b")
                line(told, "muted small")
        ui.separator()
        ui.menu_item("The commands that do the same", on_click=lambda: _commands(session))


def _warn(session: Session) -> None:
    ui.notify(session.errands.trouble, type="warning", multi_line=True)


async def _take(session: Session, what: str) -> None:
    path = await session.take(what)
    if path is None:
        _warn(session)
        return
    ui.download.content(path.read_bytes(), path.name)


async def _save(session: Session) -> None:
    opened, path = session.shown.fitted, await session.save()
    if path is None or opened is None:
        _warn(session)
        return
    log = session.names.in_file(session.names.with_user_names(opened.opened.log)).partition(".")[0]
    ui.download.content(path.read_bytes(), f"{log}.session.json")


async def _for_another(session: Session) -> None:
    """A dialog of the formats of exports, each with what it is."""
    formats = dict(await session.ask("formats") or ())
    if not formats:
        _warn(session)
        return
    with dialog() as made:
        line("The model for another program", tag="h2")
        choice = ui.radio(formats, value=next(iter(formats))).props('aria-label="Format"').classes("formats")
        line("Every file says what is known about the model, and what the format cannot express.", "muted small")
        with ui.element("div").classes("flow"):
            button("Write and take", lambda: _take(session, str(choice.value)), lead=True)
            button("Close", made.close)


_THINGS = {
    "take page": ("The report page", "one HTML file that opens anywhere", partial(_take, what="page")),
    "take model": ("model.yaml", "the corrected vehicle file", partial(_take, what="model")),
    "take findings": ("findings.json", "the findings for machines", partial(_take, what="findings")),
    "take run": ("The run folder", "everything, as a zip", partial(_take, what="run")),
    "export": ("For another program", "Gazebo, C, Python, MATLAB, an autopilot ...", _for_another),
    "save": ("The session", "log, vehicle, steps and view, to go on later or elsewhere", _save),
}
"""Items of the menu by their marks: name, what it is, and what takes it away."""


def _commands(session: Session) -> None:
    with dialog() as made:
        line("The same on the command line", tag="h2")
        ui.code(session.commands(), language="bash").classes("commands")
        button("Close", made.close)


SUFFIXES = (
    *(".csv.gz", ".csv", ".parquet", ".bin", ".log", ".tlog", ".ulg", ".mcap", ".db3", ".bag", ".mat", ".npy", ".txt"),
    *(".yaml", ".yml", ".json"),
)
"""Ends of file names that an upload may keep; of a name from the browser nothing else becomes a part of a path."""
_KINDS = {"log": "a log", "vehicle": "the vehicle file", "map": "the channel map", "session": "a session"}
_LONGEST = 120
"""Characters of a name from the browser that are shown."""
_COUNT = count(1)
"""Numbers of uploads: no two are kept under one name."""


def stored_as(name: str, number: int) -> str:
    """The name under which an upload is kept: its number, and its kind where that is known.

    Examples
    --------
    >>> stored_as("../../etc/my log.CSV", 1), stored_as("run.exe", 2)
    ('upload-1.csv', 'upload-2')
    """
    lower = name.lower()
    return f"upload-{number}{next((end for end in SUFFIXES if lower.endswith(end)), '')}"


class LogFiles:
    """A place to drop files on, a field for a path, and how a log is read.

    Parameters
    ----------
    paths : files of this machine may be named; not where others than its user may see the page
    path_label : of the field for a path
    """

    def __init__(self, session: Session, *, paths: bool, path_label: str) -> None:
        self._session = session
        self._files: dict[Path, str] = {}
        kept = proxy(self)  # FastAPI keeps an upload beyond its page, which would keep all of this
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
        self._told = line("", "small").props('role="status"')
        self._path = ui.input(label=path_label).props("outlined dense") if paths else None
        self._frame = ui.select({"": "axes as the log says", "enu": "ENU / FLU", "ned": "NED / FRD"}, value="")
        self._frame.props('outlined dense label="axes"')
        self._as_is = ui.checkbox("take a broken log as it is (every result then carries a warning)")

    @property
    def logs(self) -> tuple[str, ...]:
        """Paths of all that is no vehicle and no map: logs, and a session."""
        path = "" if self._path is None else (self._path.value or "").strip()
        return (*self._of("session"), *self._of("log"), *([path] if path else []))

    @property
    def vehicle(self) -> str:
        """The vehicle file that was dropped last; empty for none."""
        return next(reversed(self._of("vehicle")), "")

    def source(self, vehicle: str = "", hull: Mapping[str, float] | None = None) -> Source:
        """The logs for a vehicle, or for one that is made of what is known of the hull, read as was chosen."""
        return Source(
            self.logs,
            vehicle,
            tuple((hull or {}).items()),
            channel_map=next(reversed(self._of("map")), ""),
            frame=str(self._frame.value),
            as_is=bool(self._as_is.value),
        )

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

    def _of(self, kind: str) -> list[str]:
        return [str(path) for path, name in self._files.items() if _kind(path, name) == kind]


def shown(name: str) -> str:
    """The last part of a name from the browser, as it may be shown."""
    return one_line(name.replace("\\", "/").rsplit("/", 1)[-1])[:_LONGEST] or "a file without a name"


def _kind(path: Path, name: str) -> str:
    if path.suffix == ".json":
        return "session"
    if path.suffix not in (".yaml", ".yml"):
        return "log"
    return "map" if "channel" in name.lower() or "map" in name.lower() else "vehicle"


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
        self._session, self._leave = session, leave
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
                    line("What you leave empty is typical of a hull of that length, and marked so.", "muted small")
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
        self._opened = partial(_told_or_left, self._session, self._told, self._leave)

    async def _demo(self) -> None:
        await self._session.open(Source(), self._opened)

    async def _open(self) -> None:
        files = self._files
        if not files.logs:
            self._told.set_text("Drop a log above, or give its path; or try the demo.")
            return
        made = self._choice.value == _MADE and not files.vehicle
        hull = {name: float(field.value) for name, field in self._known.items() if made and field.value}
        vehicle = files.vehicle or ("" if made else str(self._choice.value))
        await self._session.open(files.source(vehicle, hull), self._opened)


def _told_or_left(session: Session, told: TextElement, leave: Callable[[], object] | None) -> None:
    """Leave the dialog, if this is one, when the log is open; say what went wrong where it is not."""
    if told.is_deleted:
        return
    told.set_text(session.names.with_user_names(session.errands.trouble))
    if not session.errands.trouble and leave is not None:
        leave()


def another_log(session: Session, *, paths: bool) -> None:
    """A line with both logs, and the way to try another.

    Parameters
    ----------
    paths : see `LogFiles`
    """
    place = ui.element("section").classes("flow small").props('aria-label="The log that is shown"')
    place.style("margin-top: 12px")

    def facts() -> tuple[list[str], bool]:
        logs = (session.shown.fitted, session.shown.other)
        names = [session.names.with_user_names(one.opened.log) for one in logs if one is not None]
        return names, session.shown.on_other

    def draw(facts: tuple[list[str], bool]) -> None:
        names, on_other = facts
        if len(names) == 2:
            options = {False: f"{names[0]} (fitted)", True: f"{names[1]} (tried)"}
            choice = ui.toggle(options, value=on_other).props('dense no-caps unelevated aria-label="Log"')
            choice.on_value_change(lambda event: session.shown.look_at(other=bool(event.value)))
            button("Put away", session.put_away, label="Put the other log away")
        button("Try on another log", lambda: _try_another(session, paths=paths), label="Try the model on another log")

    redrawn(session, place, facts, draw)


def _try_another(session: Session, *, paths: bool) -> None:
    """The dialog by which another log is tried."""
    with dialog(620) as made:
        line("Try the model on another log", tag="h2").style("margin: 0")
        line(
            "A log of the same boat. The model predicts it as it is: nothing is fitted to this log, and the open one "
            "stays as you left it.",
            "muted small",
        )
        files = LogFiles(session, paths=paths, path_label="or the path of a log, a folder or a pattern")
        line("It is read with the channel map of the open log, unless you drop another beside it.", "muted small")

        async def predict() -> None:
            if not files.logs:
                told.set_text("Drop a log above, or give its path.")
                return
            await session.try_on(files.source())
            _told_or_left(session, told, made.close)

        with ui.element("div").classes("flow"):
            button("Predict", predict, lead=True, label="Predict the other log")
            button("Cancel", made.close)
            told = line("", "small", "span").props('role="status"')
