"""Service of a worker: one open log, its vehicle, and the workbench on both, for the page that asks.

Modules that show a log load at once, those that search it on the first search.
"""

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from itertools import count
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..measurements.log_options import Reading
from ..measurements.prepared_logs import Inputs
from ..physics.errors import RequestError, VehicleError
from ..physics.files import write_text, yaml_text
from ..physics.vehicle import Vehicle, load_vehicle
from ..workflows.first_vehicle import Hull, check_wires, with_corrections, write_rewired
from ..workflows.inputs import UNPROVEN, read_inputs
from ..workflows.log_view import LogView, assumed_of, form_of, rows_that_judge
from ..workflows.workbench_facts import (
    Card,
    Fit,
    Form,
    HullDiary,
    ModelChoice,
    Opened,
    Place,
    Searched,
    Source,
    Trained,
    Way,
    Wire,
)
from .steps import FileNames

if TYPE_CHECKING:
    from ..workflows.workbench import Workbench

Say = Callable[[str], None]
_BESIDE = "the model it learnt beside"
"""How a table calls the model of a step beside which a network was trained."""
_TURNED = (
    "{} is read turned round: the log shows that a larger command pushes this thruster astern. The model's curve is "
    "for the turned command; the map that turns it is channels.yaml in the run folder under Take away"
)
"""What must be known of a thruster before the model is given its own commands."""
_KEPT = 3
"""Readings that one can go back to at once: as recorded, repaired, and with other numbers of the vehicle."""

_OF_A_RUN = {"page": "report.html", "findings": "findings.json", "run": ""}
"""What a run folder holds, and where."""


@dataclass(slots=True)
class _Read:
    """What was read, the doubt about its thrusters, how its vehicle was made, where it was, and its bench."""

    source: Source
    inputs: Inputs
    log: LogView
    doubt: str
    how: tuple[str, ...] = ()
    bench: "Workbench | None" = None


@dataclass(frozen=True, slots=True)
class _Other:
    """Another log, what the user calls its files, and the source beside whose vehicle it was read."""

    source: Source
    names: FileNames
    beside: Source
    log: LogView


class WorkerService:
    """Everything that a page may ask of a worker; each method takes and gives what can be sent between processes."""

    def __init__(self) -> None:
        self._read: _Read | None = None
        self._kept: dict[Source, _Read] = {}
        self._other: _Other | None = None

    def open(self, source: Source, folder: str, say: Say | None = None) -> Opened:
        """Read logs for a vehicle.

        Parameters
        ----------
        folder : private to the page; a vehicle and a map made of the log are written there
        """
        self._kept.clear()
        opened = self.turn_to(source, folder, say=say)
        self._other = None
        return opened

    def turn_to(self, source: Source, folder: str, searched: Searched | None = None, say: Say | None = None) -> Opened:
        """The same where what was open may be asked for again, which is then there as it was left.

        Parameters
        ----------
        searched : what was found in it, perhaps by another worker; see `Workbench.resume`
        """
        kept = self._kept.pop(source, None)
        if kept is None:
            kept = self._read_in(source, Path(folder), say)
        self._kept[source] = self._read = kept
        if searched is not None:
            self._open_bench.resume(searched)
        if len(self._kept) > _KEPT:
            del self._kept[next(iter(self._kept))]
        return self.opened(())

    def _read_in(self, source: Source, folder: Path, say: Say | None) -> "_Read":
        found = _of_demo(source, folder)
        vehicle, mapped, doubt, how = _vehicle_of(found, folder, say or (lambda line: None))
        reading = _reading(found, mapped)
        if found.wires:
            wired = _fresh(folder, "wired.yaml")
            reading = replace(reading, channel_map=write_rewired(wired, found.logs, reading, vehicle, found.wires))
        inputs = read_inputs(list(found.logs), vehicle, reading, progress=say)
        doubt = doubt or next((text for text in inputs.warnings if text == UNPROVEN), "")
        said = found.places or found.wires  # whoever has put them right has said it
        return _Read(found, inputs, LogView(inputs), "" if said else doubt, how)

    def opened(self, left: tuple[str, ...], say: Say | None = None) -> Opened:
        """See `Workbench.opened`."""
        read = self._open
        opened = read.log.opened() if read.bench is None and not left else self._open_bench.opened(left)
        notes = *read.how, *opened.notes
        assumed = assumed_of(read.inputs.vehicle, placed=bool(read.source.places))
        return replace(opened, doubt=read.doubt, notes=notes, assumed=assumed)

    def search(self, say: Say | None = None) -> Searched:
        """See `Workbench.search`."""
        return self._open_bench.search(say)

    def recall(self, searched: Searched, say: Say | None = None) -> Searched:
        """See `Workbench.recall`."""
        return self._open_bench.recall(searched)

    def nominal(self) -> str:
        """The vehicle that is open, as the text of its file."""
        return yaml_text(self._open.inputs.vehicle.to_dict(), width=120)

    def fit(self, stand: ModelChoice, on_other: bool = False) -> Fit:
        """See `Workbench.fit`."""
        return self._open_bench.fit(stand, self._other_log if on_other else None)

    def weigh(self, stand: ModelChoice, name: str, say: Say | None = None) -> Card:
        """See `Workbench.weigh`."""
        return self._open_bench.weigh(stand, name)

    def way(self, stand: ModelChoice, time: float, on_other: bool = False) -> Way:
        """See `Workbench.way`."""
        return self._open_bench.way(stand, time, self._other_log if on_other else None)

    def try_on(
        self, source: Source, stand: ModelChoice, names: FileNames, say: Say | None = None
    ) -> tuple[Opened, Fit]:
        """Read another log for the vehicle that is open, and judge a model on it; nothing is fitted to it.

        Parameters
        ----------
        source : the log, its axes and its map; without one it is read with that of the open log
        names : by which the user knows the logs
        """
        other = self._another(source, names, say)
        opened, plain = other.log.opened(), stand == ModelChoice(left=stand.left)
        fit = opened.nominal if plain else self._open_bench.fit(stand, other.log)
        self._other = other
        placed = bool(self._open.source.places)
        return replace(opened, assumed=assumed_of(self._open.inputs.vehicle, placed=placed)), fit

    def _another(self, source: Source, names: FileNames, say: Say | None = None) -> "_Other":
        first = self._open.inputs
        reading = _reading(source, _map_of(source) or first.reading.channel_map)
        inputs = read_inputs(list(source.logs), first.vehicle, reading, progress=say)
        judged = [(path, names.with_user_names(path)) for path in inputs.paths]
        log = LogView(inputs, judged=rows_that_judge(judged, first.paths, first.vehicle))
        return _Other(source, names, self._open.source, log)

    @property
    def _other_log(self) -> LogView:
        """The other log, read for the vehicle that is open now."""
        if self._other is None:
            raise RequestError("no other log is open; try the model on one first")
        if self._other.beside != self._open.source:
            self._other = self._another(self._other.source, self._other.names)
        return self._other.log

    def form(self) -> Form:
        """The numbers of the vehicle with their units and sources, and its thrusters."""
        return form_of(self._open.inputs.vehicle, self._open.source.wires)

    def repair(self, source: Source, folder: str, say: Say | None = None) -> str:
        """Write the log with the repairs that are safe, as `inspect --fix` does, and give its path.

        Raises
        ------
        RequestError
            when there are several logs, or nothing can be repaired.
        """
        from ..workflows.inspect_and_init import look_over

        fixed = _fresh(Path(folder), "repaired.csv")
        logs, reading = [Path(log) for log in source.logs], _reading(source, _map_of(source))
        found, _ = look_over(logs, None, reading, fix=fixed, progress=say)
        done = getattr(found, "fixed", None)
        if done is None or not done.done:
            raise RequestError("there is nothing in this log that can safely be repaired")
        return str(fixed)

    def try_form(self, changed: Mapping[str, float], places: Sequence[Place], wires: Sequence[Wire]) -> str:
        """What is wrong with the vehicle with some of its numbers and thrusters changed; empty where nothing is."""
        vehicle = self._open.inputs.vehicle
        try:
            with_corrections(vehicle, changed, places)
            check_wires(vehicle, wires)
        except (RequestError, VehicleError) as error:
            return error.typed
        return ""

    def take(self, what: str, stand: ModelChoice, folder: str, names: FileNames, say: Say | None = None) -> str:
        """Write what is to be taken away into a folder, and give the path of the file.

        Parameters
        ----------
        what : "page", "model", "findings", "run", the whole run folder as a zip, or the name of an export's format
        names : by which the user knows the logs
        """
        target = Path(folder)
        if what == "model":
            return str(self._model(stand, target, names))
        if what not in _OF_A_RUN:
            held = stand.names and not self._open_bench.no_run(stand)  # without effects it is that of the search
            model = self._run(stand, target, names, say) if held else self._model(stand, target, names)
            return str(_exported(what, model, target))
        run = self._run(stand, target, names, say)
        if what == "run":
            return shutil.make_archive(str(target / "undertow-run"), "zip", run)
        return str(run / _OF_A_RUN[what])

    def formats(self) -> tuple[tuple[str, str], ...]:
        """The formats of exports, each with what it is."""
        from ..exports.formats.base import format_named, format_names

        return tuple((name, format_named(name).about) for name in format_names())

    def _model(self, stand: ModelChoice, target: Path, names: FileNames) -> Path:
        model = target / "model.yaml"
        self._open_bench.vehicle(stand).save(model)
        return write_text(model, names.in_file(model.read_text("utf-8")))

    def _run(self, stand: ModelChoice, target: Path, names: FileNames, say: Say | None) -> Path:
        run = target / "run"
        if run.exists():
            shutil.rmtree(run)
        mapped = self._open.inputs.reading.channel_map
        if mapped is not None:
            names.call(Path(mapped), "channels.yaml")
        self._open_bench.write(stand, run, say, names.in_file)
        if mapped is not None:  # what reads the log as this model was fitted to it lies in the page's own folder
            shutil.copyfile(mapped, run / "channels.yaml")
        return run

    def train(self, network: str, stand: ModelChoice, epochs: int, say: Callable[[Any], None] | None = None) -> Trained:
        """Train a network beside the model of a stand, on the log as that reads it; each `Epoch` is told."""
        from ..residuals.training.training_settings import Choice, TrainingSettings
        from ..workflows.train import train
        from ..workflows.workbench import rival

        bench, given = self._open_bench, self._open.inputs
        vehicle = given.vehicle if stand == ModelChoice(left=stand.left) else bench.vehicle(stand)
        parted = read_inputs(list(given.paths), vehicle, given.reading, progress=None)
        inputs = bench.inputs(stand.left, parted)
        settings = TrainingSettings(epochs=epochs, decline=False)  # what is left is told, and nobody can say --set here
        done = train(inputs, Choice(network), settings=settings, progress=None, watch=say)
        rivals = (rival(model) for model in done.models)
        named = (replace(r, name=_BESIDE) if r.name == "nominal" else r for r in rivals)
        return Trained(" ".join(done.sentences), tuple(named), stand)

    def diary(self, fleet: str, folder: str, say: Say | None = None) -> HullDiary:
        """The diary of a fleet, with its page in a folder."""
        from ..fleet.diary import diary_of
        from ..fleet.parameter_estimates import read_fleet
        from ..reports.page.page import diary_page, glance

        tell = say or (lambda line: None)
        found = read_fleet(fleet)
        tell(f"watching the hulls of {len({one.boat for one in found.estimates})} boats")
        facts = diary_of(found, Path(fleet).absolute().name)
        tell("drawing their days")
        page = write_text(Path(folder) / "diary.html", diary_page(facts))
        return HullDiary(facts.fleet, glance(facts), str(page))

    def load(self) -> None:
        """Load what a search needs, before it is asked for."""
        from ..workflows import workbench as _  # noqa: F401

    @property
    def _open_bench(self) -> "Workbench":
        read = self._open
        if read.bench is None:
            from ..workflows.workbench import Workbench  # here, because a log is shown before a search is loaded

            read.bench = Workbench(read.log)
        return read.bench

    @property
    def _open(self) -> "_Read":
        if self._read is None:
            raise RequestError("no log is open; open one first")
        return self._read


def _vehicle_of(source: Source, folder: Path, say: Say) -> tuple[Vehicle, Path | None, str, tuple[str, ...]]:
    """The vehicle that is meant, the channel map, if there is one; of one that is made a doubt, and how it is."""
    mapped, doubt, how = _map_of(source), "", ()
    if source.vehicle:
        vehicle = load_vehicle(source.vehicle)
    else:
        from ..workflows.inspect_and_init import PLACES, init

        reading = Reading(source.frame or None, mapped)
        draft = init(list(source.logs), Hull(**dict(source.hull)), source.like or None, reading, progress=say)
        mapped = _fresh(folder, "channels.yaml")
        draft.write(_fresh(folder, "vehicle.yaml"), mapped)
        vehicle, doubt = draft.vehicle, next((doubt.value for doubt in draft.doubts if doubt in PLACES), "")
        how = (*(_TURNED.format(t.channel) for t in draft.thrusters if t.turned), *draft.likely, *draft.remarks)
    if source.changed or source.places:
        vehicle = with_corrections(vehicle, dict(source.changed), source.places)
    return vehicle, mapped, doubt, how


def _exported(to: str, model: Path, target: Path) -> Path:
    """A model in the format of another tool; of one that no run holds, without intervals and the run's audit."""
    from ..exports.formats.base import format_named
    from ..workflows.export import export

    there = target / "exported"
    if there.exists():
        shutil.rmtree(there)
    there.mkdir()
    first, *others = export(model, to, there / f"model{format_named(to).suffix}").files
    return Path(shutil.make_archive(str(target / f"model-{to}"), "zip", there)) if others else first


def _map_of(source: Source) -> Path | None:
    return Path(source.channel_map) if source.channel_map else None


def _reading(source: Source, channel_map: str | PathLike[str] | None) -> Reading:
    """How the logs of a source are read, with a map that may be another than its own."""
    return Reading(source.frame or None, channel_map, None, source.as_is)


def _fresh(folder: Path, name: str) -> Path:
    """A path in a folder that no file has: what was made for one reading stays as long as one can go back to it."""
    stem, dot, end = name.partition(".")
    return next(path for k in count(1) if not (path := folder / f"{stem}-{k}{dot}{end}").exists())


def _of_demo(source: Source, folder: Path) -> Source:
    """The source with the files of the demo, copied to where they can be read again, if that is meant."""
    if source.logs:
        return source
    data = resources.files("undertow") / "data"
    paths = [folder / name for name in ("gazebo_blueboat.csv.gz", "demo.yaml")]
    for path in paths:
        path.write_bytes((data / path.name).read_bytes())
    return replace(source, logs=(str(paths[0]),), vehicle=str(paths[1]))
