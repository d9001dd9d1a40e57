"""The first vehicle, with which `init` begins: thrusters as logs show them or a person says, on an assumed hull."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..measurements.channels.channel_map import Entry, map_text, read_channel_map
from ..measurements.formats.registry import find_logs
from ..measurements.log import read_log
from ..measurements.log_options import Reading
from ..measurements.quality.record import Record
from ..measurements.statistics.blocks import weighed
from ..measurements.thrusters_in_log import DetectedThruster, drag_at_speed, surge_at_full, top_speed
from ..physics.errors import RequestError
from ..physics.files import write_text
from ..physics.motion import AXES, Array
from ..physics.reading import Plain
from ..physics.sources import (
    LENGTH,
    SURE,
    THRUST_SPREAD,
    TO_REPLACE,
    Estimate,
    typical_added_mass,
    typical_damping,
    typical_inertia,
    typical_mass,
    typical_spacing,
    typical_thrust,
    with_sources,
)
from ..physics.thrusters import CommandKind, Thruster, command_of, push_and_turn
from ..physics.vehicle import Vehicle, vehicle_from_dict
from .workbench_facts import Place, Wire

_BETWEEN_LOGS = 0.3
"""Share by which the thrust of one boat differs from log to log, beside what its fit leaves and the error that it
tells: 22 to 48 N of a BlueBoat's field logs, as the drag goes with manoeuvre and speed."""
_GIVEN = "given to undertow init"
_AHEAD_OF_STERN = 0.4
"""Distance of thrusters behind the middle over length; it has no effect on one that pushes straight ahead."""
_KEEPS, _QUICKEST = 1.2, 0.3
"""Share by which the dampings outweigh the Munk moment; and the quickest time in which sway dies away [s]."""
_SIDE = {"port": -1.0, "starboard": 1.0}
"""Sign of a thruster's place to starboard."""


_MOST = {"length": ("m", 500.0), "mass": ("kg", 1e9), "spacing": ("m", 100.0), "thrust": ("N", 1e8)}
"""What no hull exceeds, by unit: the largest ships, with room. A length in millimetres is beyond."""


@dataclass(frozen=True, slots=True)
class Hull:
    """Numbers of a boat that a person knows; None for what is to be estimated.

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
        for name, (unit, most) in _MOST.items():
            value = getattr(self, name)
            if value is not None and not 0.0 < value <= most:
                raise RequestError(
                    f"init: {name} must be above 0 and at most {most:g} {unit}, got {value:g} {unit}; give metres, "
                    "kilograms and newtons"
                )


def on_typical_hull(records: Sequence[Record], thrusters: Sequence[DetectedThruster], hull: Hull, name: str) -> Vehicle:
    """The vehicle of these thrusters on a hull of which only some numbers are known.

    Parameters
    ----------
    records : the logs under examination
    thrusters : as the logs show them
    hull : what a person knows of the boat
    name : of the vehicle
    """
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
        where += f"; x: -{_AHEAD_OF_STERN:g} length, without effect on a thruster that pushes straight ahead"
        full = f"full {thrust.value:g} N {thrust.source}, {_shape(one)}; {where}"
        whole = one.kind == "tau"
        sources[one.name] = f"command: {one.output.source}; force: {_shape(one) if whole else full}"
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
    words = f"so large that the hull keeps its course at the log's top speed of {top:.2g} m/s; a guess, {TO_REPLACE}"
    return Estimate(float(f"{-min(needed, most):.3g}"), words)


def like_another(base: Vehicle, thrusters: Sequence[DetectedThruster], hull: Hull, name: str) -> Vehicle:
    """The hull of another vehicle under these thrusters, which sit and push as that vehicle's on the same side do.

    Parameters
    ----------
    base : the vehicle whose hull it is
    thrusters : as the logs show them
    hull : what a person knows of the boat
    name : of the vehicle

    Raises
    ------
    RequestError
        for a length: the other vehicle's hull is not scaled.
    """
    if hull.length is not None:
        raise RequestError(
            f"init: a length of {hull.length:g} m says nothing beside --like {base.name}, whose numbers are taken; "
            "leave --length out, or --like"
        )
    own = {side: [t for t in base.thrusters if _side(t) == side] for side in ("port", "starboard", "")}
    built, sources = [], {}
    for one in thrusters:
        fitting = own[one.side] or list(base.thrusters)
        model = fitting.pop(0) if len(fitting) > 1 else fitting[0]
        back, ahead = (abs(float(force)) for force in model.curve.thrust(*_ends(model)))
        full = hull.thrust or max(back, ahead)
        one = one if one.shaped or not min(back, ahead) > 0.0 else one.unlike(float(f"{ahead / back:.4g}"))
        y = model.y if hull.spacing is None else 0.5 * hull.spacing * _SIDE.get(one.side, 0.0)
        built.append(_thruster(one, (model.x, y, model.angle), full))
        if one.kind == "tau":
            sources[one.name] = f"command: {one.output.source}; force: {_shape(one)}"
            continue
        who = _GIVEN if hull.thrust else f"of thruster {model.name} of {base.name}"
        sources[one.name] = (
            f"command: {one.output.source}; force: full {full:.4g} N {who}, {_shape(one)}; place: as thruster "
            f"{model.name} of {base.name}"
        )
    content: dict[str, Any] = {**base.to_dict(), "name": name, "about": "", "thrusters": built}
    content["sources"] = {"all": f"as {base.name} has it, {TO_REPLACE}", "thrusters": sources}
    if hull.mass is not None:
        content["mass"], content["sources"]["mass"] = hull.mass, _GIVEN
    return vehicle_from_dict(content, "init")


def _told(given: float | None, typical: Estimate) -> Estimate:
    return typical if given is None else Estimate(given, _GIVEN)


def _arms(thrusters: Sequence[DetectedThruster], spacing: float) -> list[float]:
    """Places to starboard [m]: by the sides, or two of unknown side one to each."""
    if any(one.kind == "tau" for one in thrusters):
        return [0.0] * len(thrusters)
    if len(thrusters) == 2 and not any(one.side for one in thrusters):
        return [-0.5 * spacing, 0.5 * spacing]
    return [0.5 * spacing * _SIDE.get(one.side, 0.0) for one in thrusters]


def _thrust(
    records: Sequence[Record], thrusters: Sequence[DetectedThruster], hull: Hull, mass: float, moved: float
) -> Estimate:
    """Full thrust ahead of each thruster [N]."""
    if all(one.kind in ("newton", "tau") for one in thrusters):
        return Estimate(max(one.output.ahead for one in thrusters), "the command itself")
    if hull.thrust is not None:
        return Estimate(hull.thrust, _GIVEN)
    surge, usual = surge_at_full(records, thrusters), typical_thrust(mass, len(thrusters))
    answer = surge.ahead
    if answer is None:
        return usual
    measured = moved * answer[0] / len(thrusters)
    shown = f"{answer[0]:.3g} +- {1.96 * answer[1]:.2g} m/s^2 at full command, {measured:.3g} N"
    between = np.hypot(surge.left, _BETWEEN_LOGS) / np.sqrt(len(records))
    error = float(np.hypot(answer[1] / answer[0], between))
    both = weighed(measured, error, usual.value, THRUST_SPREAD)
    if both is None:
        far = f"what the log shows ({shown}) is too far from that to be believed"
        return replace(usual, source=f"{usual.source}; {far}")
    size, factor = both
    words = (
        f"to move mass - X_udot = {moved:.4g} kg as the log shows ({shown}), weighed with what is typical "
        f"({usual.value:g} N), {SURE} {factor:.1f}"
    )
    return Estimate(float(f"{size:.3g}"), words)


def _thruster(one: DetectedThruster, place: tuple[float, float, float], thrust: float) -> Plain:
    command, force = one.curve(thrust)
    if one.kind in ("newton", "tau"):
        force = command
    x, y, angle = place if one.kind != "tau" else (0.0, 0.0, 0.0)
    curve = {"kind": "table", "command": command, "force": force}
    return {"name": one.name, "x": x, "y": y, "angle": angle, "command": one.kind, "curve": curve}


def _shape(one: DetectedThruster) -> str:
    if one.kind in ("newton", "tau"):
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


def wires_of(vehicle: Vehicle, wires: Sequence[Wire]) -> tuple[Wire, ...]:
    """Command that drives each thruster: its own, where nobody said another."""
    said = {wire.channel: wire for wire in wires}
    return tuple(said.get(t.channel, Wire(t.channel, t.channel)) for t in vehicle.thrusters)


def placed(vehicle: Vehicle, places: Sequence[Place]) -> Vehicle:
    """The vehicle with some thrusters elsewhere; nothing is checked here, see `put_right`.

    Raises
    ------
    RequestError
        for a thruster that it does not have.
    """
    at = {place.name: place for place in places}
    unknown = sorted(set(at) - {t.name for t in vehicle.thrusters})
    if unknown:
        names = ", ".join(t.name for t in vehicle.thrusters)
        raise RequestError(f"{vehicle.name} has no thruster {unknown[0]!r}: expected {names}")
    thrusters = [
        t.model_copy(update={"x": at[t.name].x, "y": at[t.name].y, "angle": at[t.name].angle}) if t.name in at else t
        for t in vehicle.thrusters
    ]
    return vehicle.model_copy(update={"thrusters": tuple(thrusters)})


def with_corrections(vehicle: Vehicle, changed: Mapping[str, float], places: Sequence[Place]) -> Vehicle:
    """The vehicle with numbers and thrusters as a person says, checked as a vehicle file is.

    Parameters
    ----------
    vehicle : to be changed
    changed : new values by symbol, in the unit of each
    places : of thrusters [m, rad]

    Raises
    ------
    VehicleError
        for what no hull has, and the vehicle file did not insist on before.
    RequestError
        for a thruster that it does not have.
    """
    found = with_sources(vehicle, placed(vehicle.with_values(changed), places), "given on the workbench")
    return vehicle_from_dict(found.model_dump(mode="json") | {"insist": list(vehicle.insist)}, vehicle.name)


def check_wires(vehicle: Vehicle, wires: Sequence[Wire]) -> None:
    """Refuse wires that leave a command out, or give one to two thrusters.

    Raises
    ------
    RequestError
        which names the command.
    """
    by = [wire.by for wire in wires_of(vehicle, wires)]
    twice = sorted({command for command in by if by.count(command) > 1})
    if twice:
        raise RequestError(f"{twice[0]} drives two thrusters: expected one command for each, so swap the two")


def rewired(entries: Mapping[str, Entry | None], vehicle: Vehicle, wires: Sequence[Wire]) -> dict[str, Entry | None]:
    """A channel map in which thrusters are driven by other commands, or by their own turned round.

    Parameters
    ----------
    entries : the map as it is

    Raises
    ------
    RequestError
        as `check_wires` does, and for a command that the map does not have.
    """
    check_wires(vehicle, wires)
    thrusters, result = {t.channel: t for t in vehicle.thrusters}, dict(entries)
    for wire in wires_of(vehicle, wires):
        entry = entries.get(wire.by)
        if entry is None:
            raise RequestError(f"no stream of the log is {wire.by}: expected one of {', '.join(sorted(entries))}")
        still = float(command_of(thrusters[wire.channel], np.zeros(1))[0])
        result[wire.channel] = turned(entry, still) if wire.turned else entry
    return result


def write_rewired(path: Path, logs: Sequence[str], reading: Reading, vehicle: Vehicle, wires: Sequence[Wire]) -> Path:
    """Write the channel map by which logs are read with the thrusters driven as somebody says; see `rewired`.

    All other channels are left to what reads each log: logs may record them in streams of different names.

    Parameters
    ----------
    path : of the channel map
    logs, reading : paths, and how they are read
    vehicle : whose thrusters they are
    wires : what drives each thruster

    Raises
    ------
    RequestError
        as `rewired` does, and for logs that record a command in different ways, which one map cannot put right.
    """
    names, _ = find_logs(logs)
    known, *others = (read_log(name, reading).entries for name in names)
    for command in (thruster.channel for thruster in vehicle.thrusters):
        for name, entries in zip(names[1:], others, strict=True):
            if entries.get(command) != known.get(command):
                raise RequestError(
                    f"expected logs that record {command} alike, got {_words(known.get(command))} in "
                    f"{Path(names[0]).name} and {_words(entries.get(command))} in {Path(name).name}; open them one by "
                    "one to exchange or reverse thrusters"
                )
    given = {} if reading.channel_map is None else read_channel_map(Path(reading.channel_map))
    found = rewired(known, vehicle, wires)
    return write_text(path, map_text({**given, **{t.channel: found[t.channel] for t in vehicle.thrusters}}))


def _words(entry: Entry | None) -> str:
    if entry is None:
        return "nothing"
    scaled = f" times {entry.scale:g}" if entry.scale != 1.0 else ""
    return f"{entry.source}{scaled}{f' plus {entry.offset:g}' if entry.offset else ''}"


def turned(entry: Entry, neutral: float) -> Entry:
    """A line of the channel map mirrored about the command at which its thruster stands still."""
    return replace(entry, scale=-entry.scale, offset=2.0 * neutral - entry.offset)
