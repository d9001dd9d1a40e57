"""How a log comes onto the bench: dropped, chosen by its path, or the one of the demo; and its vehicle."""

from pathlib import Path

from nicegui import events, ui

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
_HULL = {
    "length": "length [m]",
    "mass": "mass with payload [kg]",
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
    paths : files of this machine may be named; not where others than its user may see the page
    """

    def __init__(self, session: Session, vehicles: tuple[str, ...], *, paths: bool) -> None:
        self._session = session
        self._logs: list[Path] = []
        self._vehicle: Path | None = None
        self._map: Path | None = None
        self._count = 0
        with ui.element("section").classes("card stack").props('aria-label="Open a log"'):
            line("What does your boat model miss?", tag="h1")
            line(
                "Open a log of the boat. undertow compares it with a model, shows where the model fails, and names the "
                "physics that is missing. Nothing leaves this machine.",
                "muted",
            )
            with ui.element("div").classes("row"):
                button("Try the demo", self._demo, lead=True, label="Try the demo: a boat recorded in Gazebo")
                line("four minutes of a BlueBoat in Gazebo, and a model with linear drag only", "muted small", "span")
            self._fields(vehicles, paths=paths)

    def _fields(self, vehicles: tuple[str, ...], *, paths: bool) -> None:
        with ui.element("div").classes("grid pair"):
            with ui.element("div").classes("stack"):
                line("1. The log", tag="h2")
                with ui.element("div").classes("drop"):
                    upload = ui.upload(
                        label="Drop logs here, or press +",
                        multiple=True,
                        auto_upload=True,
                        max_file_size=MOST_UPLOADED,
                        on_upload=self._uploaded,
                        on_rejected=lambda: ui.notify("This file is too large to upload: give its path instead."),
                    )
                    upload.props('flat aria-label="Upload logs"')
                self._path = ui.input(label="or the path of a log, a folder or a pattern") if paths else None
                if self._path is not None:
                    self._path.props("outlined dense")
                self._frame = ui.select({"": "axes as the log says", "enu": "ENU / FLU", "ned": "NED / FRD"}, value="")
                self._frame.props('outlined dense label="axes"')
                self._as_is = ui.checkbox("take a broken log as it is (every result then carries a warning)")
            with ui.element("div").classes("stack"):
                line("2. The vehicle", tag="h2")
                self._choice = ui.select([_MADE, *vehicles], value=_MADE, label="vehicle").props("outlined dense")
                self._hull = ui.element("div").classes("row")
                with self._hull:
                    self._known = {
                        name: ui.number(label=told, min=0).props("outlined dense").style("width: 172px")
                        for name, told in _HULL.items()
                    }
                    line("What you leave empty is typical of a hull of the length, and says so.", "muted small")
                self._choice.on_value_change(lambda e: self._hull.set_visibility(e.value == _MADE))
                line(
                    "or drop your own vehicle.yaml, and a channel map called channels.yaml, beside the log.",
                    "muted small",
                )
        with ui.element("div").classes("row"):
            self._told = line("", "muted small", "span")
            button("Open", self._open, lead=True, label="Open the log")

    async def _demo(self) -> None:
        await self._session.open(Source())

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        self._count += 1
        target = self._session.folder / stored_as(event.file.name, self._count)
        await event.file.save(target)
        if target.suffix in (".yaml", ".yml"):
            if "channel" in event.file.name.lower() or "map" in event.file.name.lower():
                self._map = target
            else:
                self._vehicle = target
        else:
            self._logs.append(target)
        told = [f"{len(self._logs)} log{'s' * (len(self._logs) != 1)}"] * bool(self._logs)
        told += ["a vehicle file"] * (self._vehicle is not None) + ["a channel map"] * (self._map is not None)
        self._told.set_text(f"Ready: {', '.join(told)}.")

    async def _open(self) -> None:
        path = "" if self._path is None else (self._path.value or "").strip()
        logs = tuple(map(str, self._logs)) + ((path,) if path else ())
        if not logs:
            self._told.set_text("Drop a log above, or give its path; or try the demo.")
            return
        made = self._choice.value == _MADE and self._vehicle is None
        hull = {name: float(field.value) for name, field in self._known.items() if made and field.value}
        vehicle = str(self._vehicle) if self._vehicle else ("" if made else str(self._choice.value))
        await self._session.open(
            Source(
                logs,
                vehicle,
                tuple(hull.items()),
                channel_map=str(self._map or ""),
                frame=self._frame.value,
                as_is=bool(self._as_is.value),
            )
        )
