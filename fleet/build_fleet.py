"""Building of a fleet folder: a worker reads each log once, and makes a few kilobytes of factors of it."""

import hashlib
import json
import math
import os
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from ..discovery.balance.base import WeakSettings
from ..measurements.formats.registry import log_digests
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.prepared_logs import PathLike
from ..measurements.statistics.processors import single_threaded
from ..physics.errors import LogError, RequestError, VehicleError, expect
from ..physics.files import write_bytes
from ..physics.folders import hold_folder
from ..physics.stage import Say
from ..physics.vehicle import Vehicle, load_vehicle
from ..reports.terminal.progress import SHOWN, Pace, showing
from ..workflows.compress import in_pieces
from ..workflows.inputs import read_motions
from . import fleet_folder
from .fleet_folder import FleetIndex, FleetLog, SkippedLog
from .hull_factors import HullFactors, HullFactorsAbout, hull_factors, settings_of, to_bytes
from .log_sources import LogSource, fetched, find_sources, is_url
from .workers import Engine, WorkerLost, mapped

_MOST_TOLD = 500
"""Letters of a reason: some lines."""


@dataclass(frozen=True, slots=True)
class LogTask:
    """What is asked of a worker.

    Attributes
    ----------
    source : the log, and what is known of it before it is read
    vehicle, follow, reading : what is followed, and how the log is read
    kept : folder of the fleet; factors that are in it already are not made again
    """

    source: LogSource
    vehicle: Vehicle
    follow: tuple[str, ...]
    reading: Reading
    kept: str


Answer = tuple[FleetLog | SkippedLog, bytes | None]
"""The row of a log in the index, and its factors; none where they are kept already, or cannot be made."""


@single_threaded
def factors_of(task: LogTask) -> Answer:
    """Read a log and make its factors, unless they are there; what is wrong with the log is told, not raised."""
    place = task.source.place
    path = Path(place)
    try:
        with fetched(place) if is_url(place) else nullcontext(path) as path:
            return _factors_of(task, path)
    except Exception as error:  # whatever a broken log leads to, the others go on
        told = str(error).strip() or type(error).__name__
        told = told.replace(str(path), place).removeprefix(f"{place}: ")
        return _skipped(task.source, " ".join(told.split())[:_MOST_TOLD]), None


def _skipped(source: LogSource, problem: str) -> SkippedLog:
    return SkippedLog(log=source.place, boat=source.boat, problem=problem)


def key_of(sha256: str, task: LogTask) -> str:
    """By what the factors of a log are known: equal keys, equal factors."""
    reading = task.reading
    mapped = None if reading.channel_map is None else log_digests([str(reading.channel_map)])[0]["sha256"]
    made = {
        "schema": HullFactorsAbout.SCHEMA,
        "log": sha256,
        "follow": task.follow,
        "settings": settings_of(task.vehicle),
        "reading": [reading.frame, mapped, reading.namespace, reading.as_is, reading.fix],
    }
    return hashlib.sha256(json.dumps(made, sort_keys=True).encode()).hexdigest()


def _factors_of(task: LogTask, path: Path) -> Answer:
    source, folder, content = task.source, Path(task.kept), None
    sha256 = log_digests([str(path)])[0]["sha256"]
    if sha256 is None:
        raise LogError(f"{path}: no such log, or it cannot be opened")
    key = key_of(sha256, task)
    if fleet_folder.has_factors(folder, key):
        factors = fleet_folder.read_hull_factors(folder, key)
    else:
        log, motions = read_motions(path, task.vehicle, task.reading)
        start = log.start_ns / 1e9 if log.start_ns else float("nan")
        pieces = in_pieces(motions, WeakSettings())
        factors = hull_factors(pieces, task.vehicle, task.follow, digest=sha256, start=start)
        content = to_bytes(factors)
    time = middle(source, factors)
    if not math.isfinite(time):
        return _skipped(source, _NO_DAY), None
    row = FleetLog(
        log=source.place,
        boat=source.boat,
        time=fleet_folder.iso(time),
        hours=float(factors.hours.sum()),
        factors=key,
        sha256=sha256,
        vehicle=task.vehicle.digest,
        begins=_begins(source),
        notes=source.notes,
        version=source.version,
    )
    return row, content


_DAY = 86400.0
"""Seconds of a day."""
_NO_DAY = (
    "neither the log, nor its name, nor a manifest says of which day it is; write one with the columns log and day"
)
_STAYS = " What an earlier call read of it stays in the fleet."


@dataclass(frozen=True, slots=True)
class FleetBuilt:
    """What became of the logs of a call.

    Attributes
    ----------
    index : of the folder as it is now
    read : logs that were read in this call
    kept : logs that were there already, unchanged
    skipped : logs of this call that could not be read, or count already, and why
    """

    index: FleetIndex
    read: int
    kept: int
    skipped: tuple[SkippedLog, ...]


@showing
def build_fleet(
    logs: Iterable[PathLike] | PathLike,
    vehicle: Vehicle | PathLike,
    out: PathLike,
    reading: Reading = AS_GUESSED,
    *,
    follow: Sequence[str] = (),
    engine: Engine | None = None,
    progress: Say | None = SHOWN,
    force: bool = False,
) -> FleetBuilt:
    """Make a fleet folder of logs, or add logs to one.

    A log whose bytes, vehicle and settings are as they were is not read again, so that an interrupted call goes on
    where it was. One that cannot be read is named, and the others are as if it were not there. Logs of earlier calls
    stay, also one that cannot be read any more. The folder does not depend on who worked, nor in which order.

    Parameters
    ----------
    logs : files, folders, patterns, addresses of object stores, manifests; see `find_sources`
    vehicle : whose parameters are followed, where a manifest names no other
    out : the folder
    reading : how the logs are read
    follow : symbols of the parameters; default: damping that the vehicle has, scales of thrust, and mass
    engine : who does the work; default: all processors of this machine
    progress : called with lines about the work, shown where nothing is said; None for silence
    force : write over what another made

    Raises
    ------
    LogError, VehicleError, RequestError
        when a source, a vehicle or the folder cannot be used, or not one log can be read.
    """
    given = [logs] if isinstance(logs, str | os.PathLike) else list(logs)
    for one in given:
        expect("build_fleet: logs", one, (str, os.PathLike), "give paths of logs, folders, patterns or manifests")
    expect("build_fleet: reading", reading, Reading, "undertow.Reading(frame=...) says how")
    sources = find_sources(given)
    vehicles: dict[str, Vehicle] = {"": vehicle if isinstance(vehicle, Vehicle) else load_vehicle(vehicle)}
    for source in sources:
        if source.vehicle not in vehicles:
            try:
                vehicles[source.vehicle] = load_vehicle(source.vehicle)
            except VehicleError as error:
                raise VehicleError(f"{source.place}, by the manifest: {error.typed}") from None
    for one in vehicles.values():
        for symbol in follow:
            one.parameter(symbol)
    folder = Path(out)
    fleet_folder.check_fleet_target(folder, [s.place for s in sources], force=force)
    (folder / fleet_folder.FACTORS).mkdir(parents=True, exist_ok=True)
    with hold_folder(folder, "writes"):
        earlier = fleet_folder.existing_index(folder)
        fleet_folder.write_index(folder, earlier)  # an interrupted call leaves a fleet, which another goes on with
        at = str(folder.resolve())
        tasks = [LogTask(s, vehicles[s.vehicle], tuple(follow), reading, at) for s in sources]
        built = _built(folder, earlier, tasks, engine or Engine(), progress)
        fleet_folder.write_index(folder, built.index)
        fleet_folder.clear_factors(folder, built.index)
    if not built.index.logs:
        first = built.skipped[0]
        raise RequestError(f"expected at least one log that can be read, got {len(built.skipped)} that cannot; "
                           f"the first: {first.log}: {first.problem}")  # fmt: skip
    return built


def _built(
    folder: Path, earlier: FleetIndex, tasks: Sequence[LogTask], engine: Engine, progress: Say | None
) -> FleetBuilt:
    known = {log.log: log for log in earlier.logs}
    found: dict[str, FleetLog] = {}
    skipped: list[SkippedLog] = []
    left: list[LogTask] = []
    for task in tasks:
        log = known.get(task.source.place)
        if log is not None and _unchanged(folder, log, task):
            found[log.log] = log.but(boat=task.source.boat, notes=task.source.notes)
        else:
            left.append(task)
    made: set[str] = set()
    pace = Pace(progress, "logs")
    for done, (at, answer) in enumerate(mapped(factors_of, left, engine), start=1):
        if isinstance(answer, WorkerLost):
            lost = f"{answer}; it may need more memory than a worker has: give fewer workers, or read it alone"
            answer = _skipped(left[at].source, lost), None
        row, content = answer
        if isinstance(row, SkippedLog):
            skipped.append(row.but(problem=f"{row.problem}{_STAYS}") if row.log in known else row)
        else:
            found[row.log] = row
            if content is not None:
                write_bytes(fleet_folder.factors_path(folder, row.factors), content)
                made.add(row.factors)
        pace.told(done, len(left))
    now = {task.source.place for task in tasks}
    others = [log for log in earlier.logs if log.log not in found]
    digests = {log.sha256 for log in found.values()}
    # Of the same bytes, a log of earlier calls has moved where it is there no more; else it is the one that counts.
    still = [log for log in others if log.sha256 in digests and os.path.exists(log.log)]
    once: dict[str, FleetLog] = {}
    for log in sorted([*found.values(), *still], key=lambda log: log.log):
        first = once.setdefault(log.sha256, log)
        if first is not log:
            same = f"it has the same bytes as {first.log}"
            skipped.append(SkippedLog(log=log.log, boat=log.boat, problem=same))
    there = [log for log in earlier.skipped if is_url(log.log) or os.path.exists(log.log)]
    waiting = [log for log in there if log.log not in now]
    unread = [log for log in others if log.sha256 not in digests]
    index = fleet_folder.index_of([*once.values(), *unread], [*skipped, *waiting])
    given = [log.factors for log in once.values() if log.log in now]
    read = sum(key in made for key in given)  # of equal bytes one is read, or both at a time
    return FleetBuilt(index, read, len(given) - read, tuple(sorted(skipped, key=lambda one: one.log)))


def _unchanged(folder: Path, log: FleetLog, task: LogTask) -> bool:
    """True when a log is as it was, as far as size, time and what is asked tell, and its factors are there."""
    same = task.source.version == log.version != "" and _begins(task.source) == log.begins
    return same and key_of(log.sha256, task) == log.factors and fleet_folder.has_factors(folder, log.factors)


def middle(source: LogSource, factors: HullFactors) -> float:
    """The middle of a log [s since 1970]; NaN where nobody knows it.

    A manifest has the first word, as clocks on board may be wrong: but where its day is that of the log's own clock,
    that tells the time of day. A date in the name of the file is the last resort.
    """
    first, last = float(factors.begin.min()), float(factors.end.max())
    own = float(factors.start[0]) + 0.5 * (first + last)
    said = source.begins
    if said is None and math.isfinite(own):
        return own
    said = source.named if said is None else said
    if said is None:
        return math.nan
    if said % _DAY == 0.0 and math.isfinite(own) and said <= own < said + _DAY:
        return own
    return said + 0.5 * (last - first)


def _begins(source: LogSource) -> str:
    return "" if source.begins is None else fleet_folder.iso(source.begins)
