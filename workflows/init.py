"""The verb `init`: a vehicle file and a channel map made of logs, every number with its source."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from ..measurements.canonical import command_kind
from ..measurements.channels.channel_map import Entry, map_text
from ..measurements.log import Log, read_log
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.prepared_logs import PathLike
from ..measurements.quality.examination import examine
from ..measurements.quality.record import Record
from ..measurements.thrusters_in_log import FoundThruster, drag_at_speed, surge_at_full, thrusters_in, top_speed
from ..physics.cards import Card
from ..physics.errors import LogError, RequestError
from ..physics.file_marks import on_top
from ..physics.files import write_text
from ..physics.frames import AXES, Array
from ..physics.reading import Plain
from ..physics.thrusters import CommandKind, Thruster, command_of, push_and_turn
from ..physics.typical_hulls import (
    LENGTH,
    Estimate,
    typical_added_mass,
    typical_damping,
    typical_inertia,
    typical_mass,
    typical_spacing,
    typical_thrust,
)
from ..physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from ..reports.terminal.pace import Pace
from .inspect import logs_in

_GIVEN = "given to undertow init"
_AHEAD_OF_STERN = 0.4
"""Distance of thrusters behind the middle over length; it has no effect on one that pushes straight ahead."""
_UNLIKE = (0.5, 4.0)
"""Full thrust ahead over that astern that is believed of a log: a propeller made for one way has 2 to 3."""
_KEEPS, _QUICKEST = 1.2, 0.3
"""Share by which the dampings outweigh the Munk moment; and the quickest time in which sway dies away [s]."""
_SIDE = {"port": -1.0, "starboard": 1.0}
"""Sign of a thruster's place to starboard."""


@dataclass(frozen=True, slots=True)
class Hull:
    """What a person knows of a boat; None for what is to be estimated.

    Attributes
    ----------
    length : [m]
    mass : with payload [kg]
    spacing : distance between port and starboard thruster [m]
    thrust : of one thruster at full command ahead [N]
    """

    length: float | None = None
    mass: float | None = None
    spacing: float | None = None
    thrust: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("length", "m"), ("mass", "kg"), ("spacing", "m"), ("thrust", "N")):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < 1e9:
                raise RequestError(f"init: {name} must be positive, got {value:g} {unit}")


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


def init(
    logs: Iterable[PathLike | Log] | PathLike | Log,
    hull: Hull | None = None,
    like: PathLike | Vehicle | None = None,
    reading: Reading = AS_GUESSED,
    *,
    name: str = "",
    progress: Callable[[int, int], None] | None = None,
    say: Callable[[str], None] | None = None,
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
    progress, say : see `read_inputs`

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
    read = [*(read_log(path, reading, progress=progress, mend=True) for path in paths), *ready]
    told = None if say is None else Pace(say, "checks of the log", even=False).told
    records = [_moving(log, told) for log in read]
    _check_commands(read, records)
    thrusters, astern = _with_astern(records, thrusters_in(records))
    known = hull or Hull()
    first = read[0].name if len(read) == 1 else f"{len(read)} logs"
    called = name or (f"{base.name}, from {first}" if base else f"boat of {first.split('.')[0]}")
    vehicle = _typical(records, thrusters, known, called) if base is None else _like(base, thrusters, known, called)
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
    ratio = float(np.clip(answer.ahead[0] / answer.astern[0], *_UNLIKE))
    return [one if one.shaped else one.unlike(float(f"{ratio:.3g}")) for one in thrusters], True


def _moving(log: Log, told: Callable[[int, int], None] | None) -> Record:
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
            raise LogError(
                f"{log.path}: no thruster command is recognised in this log; expected one command a thruster. Name "
                f"them in a channel map, for example 'pwm_port: {(log.unused or ('RCOU:C1',))[0]}', and give it with "
                f"--map. Not used so far: {listed}"
            )
    common = set.intersection(*(set(record.commands) for record in records))
    if not common:
        raise LogError("init: the logs have no thruster command in common; give logs of one boat")


def _typical(records: Sequence[Record], thrusters: Sequence[FoundThruster], hull: Hull, name: str) -> Vehicle:
    """The vehicle of these thrusters on a hull of which only some numbers are known."""
    length = hull.length or LENGTH
    mass = _told(hull.mass, typical_mass(length))
    inertia = typical_inertia(mass.value, length)
    added = typical_added_mass(mass.value, inertia.value, length)
    totals = (
        mass.value - added["X_udot"].value,
        mass.value - added["Y_vdot"].value,
        inertia.value - added["N_rdot"].value,
    )
    spacing = _told(hull.spacing, typical_spacing(length))
    arms = _arms(thrusters, spacing.value)
    thrust = _thrust(records, thrusters, hull, mass.value, totals[0])
    damping = typical_damping(totals, length)
    for symbol, axis in (("X_u", 0), ("N_r", 2)):
        drag = drag_at_speed(records, thrusters, arms, axis)
        if drag is not None:
            words = f"balances thrust where the log is fastest in {AXES[axis]}; in proportion to the thrust"
            damping[symbol] = Estimate(float(f"{-drag * thrust.value:.3g}"), words)
    top = top_speed(records)
    damping["Y_v"] = _straight(damping["Y_v"], damping["N_r"].value, totals, top)
    x = float(f"{-_AHEAD_OF_STERN * length:.3g}")
    built, sources = [], {}
    for one, y in zip(thrusters, arms, strict=True):
        built.append(_thruster(one, (x, y, 0.0), thrust.value))
        where = f"y: half of {spacing.value:g} m ({spacing.source})" if y else "y: 0, on the centre line"
        sources[one.name] = (
            f"command: {one.output.source}; force: full {thrust.value:g} N {thrust.source}, {_shape(one)}; {where}; x: "
            f"-{_AHEAD_OF_STERN:g} length, without effect on a thruster that pushes straight ahead"
        )
    content = {
        "name": name,
        "mass": mass.value,
        "inertia_z": inertia.value,
        "added_mass": {symbol: estimate.value for symbol, estimate in added.items()},
        "damping": {symbol: estimate.value for symbol, estimate in damping.items()},
        "thrusters": built,
        "sources": {
            "mass": mass.source,
            "inertia_z": inertia.source,
            "added_mass": {symbol: estimate.source for symbol, estimate in added.items()},
            "damping": {symbol: estimate.source for symbol, estimate in damping.items()},
            "thrusters": sources,
        },
    }
    return vehicle_from_dict(content, "init")


def _straight(typical: Estimate, yaw: float, totals: tuple[float, float, float], top: float) -> Estimate:
    """Drag in sway with which the hull keeps its course at the top speed, where the typical one would not do.

    A hull turns away from its course by itself where its Munk moment outweighs its dampings:
    Y_v N_r < (m - X_udot)(X_udot - Y_vdot) u^2 (Fossen 2021, section 6.5: linear sway and yaw with M, C and D). No boat
    that is driven by hand does, whatever keeps it straight: fins, chines, hulls side by side.
    """
    needed = _KEEPS * totals[0] * (totals[1] - totals[0]) * top**2 / max(-yaw, 1e-9)
    most = totals[1] / _QUICKEST
    if -typical.value >= min(needed, most):
        return typical
    words = f"so large that the hull keeps its course at the log's top speed of {top:.2g} m/s; a guess, to be replaced"
    return Estimate(float(f"{-min(needed, most):.3g}"), words)


def _like(base: Vehicle, thrusters: Sequence[FoundThruster], hull: Hull, name: str) -> Vehicle:
    """The hull of another vehicle under these thrusters, which sit and push as that vehicle's on the same side do."""
    own = {side: [t for t in base.thrusters if _side(t) == side] for side in ("port", "starboard", "")}
    built, sources = [], {}
    for one in thrusters:
        fitting = own[one.side] or list(base.thrusters)
        model = fitting.pop(0) if len(fitting) > 1 else fitting[0]
        full = hull.thrust or float(max(abs(force) for force in model.curve.thrust(*_ends(model))))
        y = model.y if hull.spacing is None else 0.5 * hull.spacing * _SIDE.get(one.side, 0.0)
        built.append(_thruster(one, (model.x, y, model.angle), full))
        who = _GIVEN if hull.thrust else f"of thruster {model.name} of {base.name}"
        sources[one.name] = (
            f"command: {one.output.source}; force: full {full:.4g} N {who}, {_shape(one)}; place: as thruster "
            f"{model.name} of {base.name}"
        )
    content: dict[str, Any] = {**base.to_dict(), "name": name, "thrusters": built}
    content["sources"] = {"all": f"as {base.name} has it, to be replaced", "thrusters": sources}
    if hull.mass is not None:
        content["mass"], content["sources"]["mass"] = hull.mass, _GIVEN
    return vehicle_from_dict(content, "init")


def _told(given: float | None, typical: Estimate) -> Estimate:
    return typical if given is None else Estimate(given, _GIVEN)


def _arms(thrusters: Sequence[FoundThruster], spacing: float) -> list[float]:
    """Places to starboard [m]: by the sides, or two of unknown side one to each."""
    if len(thrusters) == 2 and not any(one.side for one in thrusters):
        return [-0.5 * spacing, 0.5 * spacing]
    return [0.5 * spacing * _SIDE.get(one.side, 0.0) for one in thrusters]


def _thrust(
    records: Sequence[Record], thrusters: Sequence[FoundThruster], hull: Hull, mass: float, moved: float
) -> Estimate:
    """Full thrust ahead of each thruster [N]."""
    if all(one.kind == "newton" for one in thrusters):
        return Estimate(max(one.output.ahead for one in thrusters), "the command itself")
    if hull.thrust is not None:
        return Estimate(hull.thrust, _GIVEN)
    answer = surge_at_full(records, thrusters).ahead
    if answer is None:
        return typical_thrust(mass, len(thrusters))
    words = (
        f"moves mass - X_udot = {moved:.4g} kg as fast as the log shows ({answer[0]:.3g} +- {1.96 * answer[1]:.2g} "
        "m/s^2 at full command)"
    )
    return Estimate(float(f"{moved * answer[0] / len(thrusters):.3g}"), words)


def _thruster(one: FoundThruster, place: tuple[float, float, float], thrust: float) -> Plain:
    command, force = one.curve(thrust)
    if one.kind == "newton":
        force = command
    x, y, angle = place
    curve = {"kind": "table", "command": command, "force": force}
    return {"name": one.name, "x": x, "y": y, "angle": angle, "command": one.kind, "curve": curve}


def _shape(one: FoundThruster) -> str:
    if one.kind == "newton":
        return "the command is the force"
    astern = "" if one.output.asymmetry == 1.0 else f", astern its {1.0 / one.output.asymmetry:.2g}-fold"
    if one.output.expo == 1.0:
        return f"over command by its square (speed follows the command, Fossen 2021, eq. 9.4){astern}"
    return f"over command c as {1.0 - one.output.expo:g} c + {one.output.expo:g} c^2 (MOT_THST_EXPO){astern}"


def _side(thruster: Thruster) -> str:
    ahead, turn = push_and_turn(thruster)
    return {1: "port", -1: "starboard"}.get(ahead * turn, "")


def _ends(thruster: Thruster) -> tuple[Array, CommandKind]:
    return command_of(thruster, np.array([-1.0, 1.0])), thruster.command


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
