"""Files that are dropped on the page, or a path: a log, and what it is read with."""

from itertools import count
from pathlib import Path
from weakref import proxy

from nicegui import events, ui

from ...physics.printable import one_line
from ..closed_to_strangers import MOST_UPLOADED
from ..session import Session
from .words import button, line

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
        self._path = ui.input(label=path_label) if paths else None
        if self._path is not None:
            self._path.props("outlined dense")
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

    @property
    def channel_map(self) -> str:
        """The channel map that was dropped last; empty for none."""
        return next(reversed(self._of("map")), "")

    @property
    def frame(self) -> str:
        """Axes of the log; empty for what it says."""
        return str(self._frame.value)

    @property
    def as_is(self) -> bool:
        """Whether a broken log is taken as it is."""
        return bool(self._as_is.value)

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
