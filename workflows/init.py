"""The verb `init`: a vehicle file and a channel map made of logs, every number with its source."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from ..measurements.canonical import command_kind
from ..measurements.channels.channel_map import Entry, map_text
from ..measurements.log import Log, read_log
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.preparation.needs import like_commands
from ..measurements.prepared_logs import PathLike
from ..measurements.quality.examination import examine
from ..measurements.quality.record import Record
from ..measurements.statistics.prior import weighed
from ..measurements.thrusters_in_log import FoundThruster, surge_at_full, thrusters_in
from ..physics.cards import Card
from ..physics.errors import LogError
from ..physics.file_marks import on_top
from ..physics.files import write_text
from ..physics.stage import Say
from ..physics.typical_hulls import LENGTH
from ..physics.vehicle import Vehicle, load_vehicle
from ..reports.terminal.pace import Pace, megabytes
from ..reports.terminal.progress import SHOWN, showing
from .first_vehicle import Hull, like_another, on_typical_hull
from .inspect import logs_in

_UNLIKE = float(np.log(2.0))
"""Standard deviation of the logarithm of full thrust ahead over that astern: a propeller made for one way has 2 to 3,
one made for both 1."""


class Doubt(Enum):
    """What nobody told and the log does not show."""

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
    entries, unused : the channel map, see `map_text`
    doubts : what is to be put right by a person
    logs : the logs read
    """

    vehicle: Vehicle
    thrusters: tuple[FoundThruster, ...]
    entries: Mapping[str, Entry]
    unused: tuple[str, ...]
    doubts: tuple[Doubt, ...]
    logs: tuple[Path, ...]

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        seen = [f"{t.channel} ({t.side or 'side unknown'}{', turned round' * t.turned})" for t in self.thrusters]
        return [
            ("vehicle", f"{self.vehicle.name}, {self.vehicle.mass:g} kg"),
            ("thrusters", ", ".join(seen)),
            ("to look at", " ".join(doubt.value for doubt in self.doubts)),
        ]

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
    mass. What nobody told is typical of a hull of the length, and says so; see `physics.typical_hulls`.

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
    records = [_moving(log, told) for log in read]
    _check_commands(read, records)
    found = thrusters_in(records)  # like another boat, thrust astern is that boat's
    thrusters, astern = _with_astern(records, found) if base is None else (found, True)
    known = hull or Hull()
    first = read[0].name if len(read) == 1 else f"{len(read)} logs"
    called = name or (f"{base.name}, from {first}" if base else f"boat of {first.split('.')[0]}")
    vehicle = (
        on_typical_hull(records, thrusters, known, called)
        if base is None
        else like_another(base, thrusters, known, called)
    )
    entries = _entries(read[0], thrusters)
    doubts = _doubts(thrusters, known, base is not None, astern)
    return Draft(vehicle, tuple(thrusters), entries, read[0].unused, doubts, tuple(log.path for log in read))


def _with_astern(records: Sequence[Record], thrusters: list[FoundThruster]) -> tuple[list[FoundThruster], bool]:
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
    ratio = told[0]
    return [one if one.shaped else one.unlike(float(f"{ratio:.3g}")) for one in thrusters], True


def _moving(log: Log, told: Callable[[int, int], None]) -> Record:
    """A log with its motion repaired, and its commands as they are: the vehicle file is to fit these."""
    clean = examine(log, progress=told).clean
    commands = {name: channel for name, channel in log.channels.items() if command_kind(name)}
    return Record.of(replace(log, channels={**clean.channels, **commands}))


def _check_commands(logs: Sequence[Log], records: Sequence[Record]) -> None:
    for log, record in zip(logs, records, strict=True):
        if not record.stretches:
            raise LogError(f"{log.path}: {record.why_not}")
        if not record.commands:
            listed = ", ".join(log.unused[:6]) or "nothing"
            stream = (*like_commands(log), "STREAM")[0]
            raise LogError(
                f"{log.path}: no thruster command is recognised in this log; expected one command a thruster. Name "
                f"them in a channel map, for example 'pwm_port: {stream}', and give it with "
                f"--map. Not used so far: {listed}"
            )
    common = set.intersection(*(set(record.commands) for record in records))
    if not common:
        raise LogError("init: the logs have no thruster command in common; give logs of one boat")


def _entries(log: Log, thrusters: Sequence[FoundThruster]) -> dict[str, Entry]:
    """The channel map of the log, with its commands called and turned as the vehicle has them."""
    entries = dict(log.entries)
    moved = {one.channel: (one, entries.pop(one.read_as)) for one in thrusters if one.read_as in entries}
    for channel, (one, entry) in moved.items():
        if one.turned:
            entry = replace(entry, scale=-entry.scale, offset=2.0 * one.output.neutral - entry.offset)
        entries[channel] = entry
    return entries


def _doubts(thrusters: Sequence[FoundThruster], hull: Hull, like: bool, astern: bool) -> tuple[Doubt, ...]:
    found = []
    if len(thrusters) > 1 and not any(one.side for one in thrusters):
        found.append(Doubt.SIDES)
    elif len(thrusters) > 1 and not all(one.by_log for one in thrusters):
        found.append(Doubt.SIGNS)
    if not all(one.rested for one in thrusters):
        found.append(Doubt.NEUTRAL)
    if not astern:
        found.append(Doubt.ASTERN)
    if hull.length is None and not like:
        found.append(Doubt.LENGTH)
    if hull.mass is None and not like:
        found.append(Doubt.MASS)
    return tuple(found)
