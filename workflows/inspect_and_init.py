"""The verbs `inspect` (logs looked over, one of them repaired) and `init` (a vehicle file and channel map of them)."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from ..measurements.canonical import command_kind
from ..measurements.channels.channel_map import Entry, map_text
from ..measurements.formats.registry import find_logs
from ..measurements.inspection import (
    Examination,
    Fixed,
    Inspection,
    Inspections,
    examine,
    inspect_log,
    inspect_logs,
    pool,
)
from ..measurements.log import Log, read_log
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.preparation.needs import like_commands, mix_of
from ..measurements.prepared_logs import PathLike, check_target, write_clean
from ..measurements.quality.checks.sides import SIDES
from ..measurements.quality.quick_motion import stands_still
from ..measurements.quality.record import Record
from ..measurements.statistics.blocks import weighed
from ..measurements.thrusters_in_log import DetectedThruster, idle_commands, surge_at_full, thrusters_in
from ..physics.errors import LogError, RequestError
from ..physics.files import on_top, write_text
from ..physics.presentation import Card, each, listing
from ..physics.sources import LENGTH
from ..physics.stage import Say, trim_memory
from ..physics.vehicle import Vehicle, load_vehicle
from ..reports.terminal.progress import SHOWN, Pace, megabytes, showing
from .first_vehicle import Hull, like_another, on_typical_hull, turned
from .inputs import likely_misplaced


def logs_in(paths: Sequence[Path]) -> tuple[list[Path], tuple[str, ...]]:
    """The logs that files, folders and patterns stand for, and notes on what else is there; see `find_logs`.

    Raises
    ------
    RequestError
        when a log is named twice.
    LogError
        when a folder or a pattern holds none.
    """
    names, notes = find_logs(paths)
    found = [Path(name) for name in names]
    seen = set()
    for path in found:
        if path.resolve() in seen:
            raise RequestError(f"{path} is given twice; its evidence would count twice. Give it once.")
        seen.add(path.resolve())
    return found, notes


@showing
def look_over(
    paths: Sequence[Path],
    vehicle: Vehicle | None = None,
    reading: Reading = AS_GUESSED,
    *,
    fix: Path | None = None,
    progress: Say | None = SHOWN,
) -> tuple[Inspection | Inspections, Log]:
    """Inspect logs, and write one of them repaired.

    Parameters
    ----------
    paths : logs, folders of logs, or patterns
    vehicle : whose needs are checked
    reading : see `read_log`
    progress : called with lines about the work, shown where nothing is said; None for silence
    fix : file for the repaired log, None to write nothing

    Returns
    -------
    (what was found, the first log) : Inspection or Inspections, Log
        Of one log or of several, whose `notes` name the files beside them that are no logs; with `fix`, its path and
        what was done under `fixed`.

    Raises
    ------
    LogError, RequestError
        when a log cannot be read, or `fix` is asked of several logs or would overwrite one.
    """
    logs, notes = logs_in(paths)
    if fix is not None:
        if len(logs) > 1:
            raise RequestError(f"--fix {fix}: expected one log to repair, got {len(logs)}; repair them one by one")
        check_target(fix, logs)
    told_bytes = megabytes(progress)
    read = [read_log(log, reading, progress=told_bytes, mend=True) for log in logs]
    trim_memory()
    if len(read) > 1:
        return inspect_logs(read, vehicle).but(notes=notes), read[0]
    checked = Pace(progress, "checks of the log", even=False).told
    examination = examine(read[0], vehicle, progress=checked)
    inspection = inspect_log(read[0], vehicle, examination=examination)
    inspection = inspection.but(notes=(*inspection.notes, *notes))
    if fix is None:
        return inspection, read[0]
    done, left = examination.fixes, examination.still_wrong
    write_clean(examination.clean, done, left, fix)
    fixed = Fixed(path=str(fix), done=done, left=left, usable=inspection.repaired)
    return inspection.but(fixed=fixed), read[0]


_UNLIKE = float(np.log(2.0))
"""Standard deviation of the logarithm of full thrust ahead over that astern: a propeller made for one way has 2 to 3,
one made for both 1."""


class Doubt(Enum):
    """A number that nobody told and the log does not show."""

    SIDES = (
        "Which thruster is at port is not known: the names do not say it, and the log does not show it. They were "
        "taken in this order; if the boat turns the other way than predicted, change the sign of both y."
    )
    SIGNS = (
        "The log does not show for certain which way each thruster pushes and on which side it is, so the names are "
        "believed. Give several logs of the boat at once: together they may tell."
    )
    ASTERN = (
        "The log does not show how hard the thrusters push astern: they were given the same thrust as ahead. What "
        "discovery says of astern thrust is then about this guess."
    )
    NEUTRAL = (
        "The boat is never seen at rest, so the pulse at which the thrusters stand still is not known: 1500 us is "
        "usual. Give a log that begins or ends at rest, or correct the curves."
    )
    LENGTH = (
        f"Nobody told the length: {LENGTH:g} m was taken, and inertia, added mass and spacing come from it (--length)."
    )
    MASS = (
        "Nobody told the mass. Forces, damping and inertia come out in proportion to it: what is missing is found all "
        "the same, its amount is only right if the mass is."
    )


PLACES = (Doubt.SIDES, Doubt.SIGNS)
"""What is doubtful of the thrusters' sides and directions."""


@dataclass(frozen=True, slots=True, repr=False)
class Draft(Card):
    """A vehicle and a channel map made of logs.

    Attributes
    ----------
    vehicle : its `sources` say of every number where it is from
    thrusters : what the logs show of them, in the order of the vehicle's
    entries, unused : the channel map, see `map_text`; None for what it leaves out
    likely : what the logs likely show of the thrusters' places, against the channel map, with the lines that follow it
    remarks : what the logs say of the commands that a person must know
    doubts : what nobody told and the logs do not show
    logs : the logs read
    """

    vehicle: Vehicle
    thrusters: tuple[DetectedThruster, ...]
    entries: Mapping[str, Entry | None]
    unused: tuple[str, ...]
    likely: tuple[str, ...]
    remarks: tuple[str, ...]
    doubts: tuple[Doubt, ...]
    logs: tuple[Path, ...]

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        seen = [f"{t.channel} ({t.side or 'side unknown'}{', turned round' * t.turned})" for t in self.thrusters]
        return [
            ("vehicle", f"{self.vehicle.name}, {self.vehicle.mass:g} kg"),
            ("thrusters", ", ".join(seen)),
            ("to settle", self.unsettled),
            *each("to look at", self.to_look_at),
        ]

    @property
    def to_look_at(self) -> tuple[str, ...]:
        """Points for a person to look at, beside what is `unsettled`: remarks, then doubts."""
        return (*self.remarks, *(doubt.value for doubt in self.doubts if doubt not in PLACES))

    @property
    def unsettled(self) -> str:
        """Doubts about the thrusters' places, and the lines that settle them; empty where there are none."""
        if self.likely:
            return " ".join([*self.likely, "Until then, the map believes the names."])
        if Doubt.SIGNS not in self.doubts:
            return next((doubt.value for doubt in self.doubts if doubt in PLACES), "")
        unsure = {t.channel: (self.entries[t.channel], t.output.neutral) for t in self.thrusters if not t.by_log}
        other = {name: entry and turned(entry, neutral) for name, (entry, neutral) in unsure.items()}
        lines = " or ".join(map_text({name: entry}).strip() for name, entry in other.items())
        return f"{Doubt.SIGNS.value} If you know that one is turned round, write its line into the map: {lines}."

    def write(self, vehicle: Path, channels: Path | None) -> None:
        """Write the vehicle file, and the channel map if one is wanted."""
        self.vehicle.save(vehicle, by="init")
        if channels is not None:
            write_text(channels, on_top("init --channels", map_text(self.entries, self.unused)))


@showing
def init(
    logs: Iterable[PathLike | Log] | PathLike | Log,
    hull: Hull | None = None,
    like: PathLike | Vehicle | None = None,
    reading: Reading = AS_GUESSED,
    *,
    name: str = "",
    progress: Say | None = SHOWN,
) -> Draft:
    """Make a vehicle and a channel map of logs of one boat.

    Thrusters, their neutral, ends and sides come from the log: from the autopilot's parameters where it has them, and
    tested against what the boat did. Thrust and drag are such that the boat moves as in the log, in proportion to the
    mass. What nobody told is typical of a hull of the length, and says so; see `physics.sources`.

    Parameters
    ----------
    logs : paths of logs, folders or patterns; or logs in memory
    hull : what is known of the boat
    like : vehicle file or name of a shipped one, whose hull is taken where `hull` says nothing
    reading : how the logs are read
    name : of the vehicle; the first log's where it is empty
    progress : see `read_inputs`

    Raises
    ------
    LogError
        when a log cannot be read, or shows no motion or no thruster command.
    RequestError, VehicleError
        when a number is impossible, or `like` is no vehicle.
    """
    given = [logs] if isinstance(logs, str | os.PathLike | Log) else list(logs)
    ready = [one for one in given if isinstance(one, Log)]
    named = [Path(one) for one in given if not isinstance(one, Log)]
    paths, _ = logs_in(named) if named or not ready else ([], ())
    base = like if isinstance(like, Vehicle) or like is None else load_vehicle(like)
    told_bytes = megabytes(progress)
    read = [*(read_log(path, reading, progress=told_bytes, mend=True) for path in paths), *ready]
    told = Pace(progress, "checks of the log", even=False).told
    _check_vessels(read, reading)
    examined = [examine(log, progress=told) for log in read]
    records = [_moving(log, one) for log, one in zip(read, examined, strict=True)]
    _check_commands(read, records)
    found = thrusters_in(records)  # like another boat, thrust astern is that boat's
    thrusters, astern = _with_astern(records, found) if base is None else (found, True)
    known = hull or Hull()
    first = read[0].name if len(read) == 1 else f"{len(read)} logs"
    called = name or (f"{base.name}, from {first}" if base else f"boat of {Path(first.removesuffix('.gz')).stem}")
    if base is None:
        vehicle = on_typical_hull(records, thrusters, known, called)
    else:
        vehicle = like_another(base, thrusters, known, called)
    still = idle_commands(records)
    entries = _entries(read[0], thrusters, still)
    unused = (*read[0].unused, *(read[0].channels[name].origin for name in still))
    likely = tuple(_likely(examined, thrusters))
    remarks = (*_of_still(records, thrusters, still), *_of_map(read))
    doubts = _doubts(thrusters, known, base is not None, astern)
    return Draft(vehicle, tuple(thrusters), entries, unused, likely, remarks, doubts, tuple(log.path for log in read))


def _with_astern(records: Sequence[Record], thrusters: list[DetectedThruster]) -> tuple[list[DetectedThruster], bool]:
    """The thrusters with thrust astern as the boat answers it, where no parameter tells it; and whether it is told."""
    if all(one.shaped for one in thrusters):
        return thrusters, True
    answer = surge_at_full(records, thrusters)
    if answer.ahead is None or answer.astern is None:
        return thrusters, False
    (ahead, error), (back, other) = answer.ahead, answer.astern
    told = weighed(ahead / back, float(np.hypot(error / ahead, other / back)), 1.0, _UNLIKE)
    if told is None:
        return thrusters, False
    return [one if one.shaped else one.unlike(float(f"{told[0]:.3g}")) for one in thrusters], True


def _moving(log: Log, examined: Examination) -> Record:
    """A log with its motion repaired, and its commands as they are: the vehicle file is to fit these."""
    commands = {name: channel for name, channel in log.channels.items() if command_kind(name)}
    return Record.of(replace(log, channels={**examined.clean.channels, **commands}))


def _likely(examined: Sequence[Examination], thrusters: Sequence[DetectedThruster]) -> list[str]:
    """What is likely wrong with thrusters of which the logs show nothing for certain, as `inspect` says it."""
    findings = pool(examined, (SIDES.name,)) if len(examined) > 1 else examined[0].findings
    settled = {one.read_as for one in thrusters if one.by_log}
    return likely_misplaced([finding for finding in findings if not settled.issuperset(finding.channels)])


def _of_still(records: Sequence[Record], thrusters: Sequence[DetectedThruster], still: Sequence[str]) -> list[str]:
    """What becomes of commands that never move."""
    texts = [
        f"{name} never moves: left out, in the channel map as '{name}: null'. If it drives a thruster, give a log in "
        "which it moves, too."
        for name in still
    ]
    kept = [one for one in thrusters if stands_still(records, one.read_as)]
    if len(kept) == len(thrusters):
        names = listing([one.read_as for one in kept])
        return [*texts, f"{names} never move{'s' * (len(kept) == 1)}: nothing in the log shows what they do."]
    return texts + [
        f"{one.read_as} never moves, but it is a thruster by the autopilot's parameters ({one.output.source}): kept, "
        "and nothing in the log shows its side and thrust."
        for one in kept
    ]


def _of_map(logs: Sequence[Log]) -> list[str]:
    """What the given channel map leaves out, though it is in none of the logs."""
    idle = set.intersection(*(set(log.idle) for log in logs))
    known = listing([name for name in logs[0].channels if command_kind(name)])
    return [f"'{name}: null' leaves nothing out: no log has it. The commands are {known}." for name in sorted(idle)]


def _check_vessels(logs: Sequence[Log], reading: Reading) -> None:
    for log in logs:
        if log.craft is not None and not log.craft.craft.floats and not reading.as_is:
            raise LogError(
                f"{log.path}: {log.craft.sentence}; expected the log of a boat, whose thrusters push along the water. "
                "Give another log, or say --as-is if it is a boat all the same"
            )


def _check_commands(logs: Sequence[Log], records: Sequence[Record]) -> None:
    for log, record in zip(logs, records, strict=True):
        if not record.stretches:
            raise LogError(f"{log.path}: {record.why_not}")
        if not record.commands:
            listed = ", ".join(log.unused[:6]) or "nothing"
            stream = (*like_commands(log), "STREAM")[0]
            sides = map_text(mix_of(log, ("normalized_port", "normalized_stbd"))).splitlines()
            lines = " and ".join(f"'{line}'" for line in sides or [f"pwm_port: {stream}"])
            raise LogError(
                f"{log.path}: no thruster command is recognised in this log; expected one command a thruster. Name "
                f"them in a channel map, for example {lines}, and give it with --map. Not used so far: {listed}"
            )
    if not set.intersection(*(set(record.commands) for record in records)):
        raise LogError("init: the logs have no thruster command in common; give logs of one boat")


def _entries(log: Log, thrusters: Sequence[DetectedThruster], still: Sequence[str]) -> dict[str, Entry | None]:
    """The channel map of the log, with its commands called and turned as the vehicle has them."""
    entries = {**log.entries, **dict.fromkeys(still)}
    moved = [(one, entry) for one in thrusters if (entry := entries.get(one.read_as)) is not None]
    for one, _ in moved:
        del entries[one.read_as]
    for one, entry in moved:
        entries[one.channel] = turned(entry, one.output.neutral) if one.turned else entry
    return entries


def _doubts(thrusters: Sequence[DetectedThruster], hull: Hull, like: bool, astern: bool) -> tuple[Doubt, ...]:
    sided = [one for one in thrusters if one.kind != "tau"]
    named = any(one.side for one in sided)
    doubtful = {
        Doubt.SIDES: len(sided) > 1 and not named,
        Doubt.SIGNS: len(sided) > 1 and named and not all(one.by_log for one in sided),
        Doubt.NEUTRAL: not all(one.rested for one in thrusters),
        Doubt.ASTERN: not astern,
        Doubt.LENGTH: hull.length is None and not like,
        Doubt.MASS: hull.mass is None and not like,
    }
    return tuple(doubt for doubt, is_so in doubtful.items() if is_so)
