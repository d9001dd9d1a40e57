"""Thrusters as a person puts them right: places and directions in the vehicle, commands in a channel map."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..measurements.channels.channel_map import Entry, map_text, read_channel_map
from ..measurements.collection import find_logs
from ..measurements.log import read_log
from ..measurements.log_options import Reading
from ..physics.errors import RequestError
from ..physics.files import write_text
from ..physics.sources import with_sources
from ..physics.thrusters import Thruster, command_of
from ..physics.vehicle import Vehicle, vehicle_from_dict
from .workbench_facts import Place, Wire


def wires_of(vehicle: Vehicle, wires: Sequence[Wire]) -> tuple[Wire, ...]:
    """What drives each thruster: its own command, where nobody said another."""
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
        raise RequestError(f"{vehicle.name} has no thruster {unknown[0]!r}: expected {_names(vehicle.thrusters)}")
    thrusters = [
        t.model_copy(update={"x": at[t.name].x, "y": at[t.name].y, "angle": at[t.name].angle}) if t.name in at else t
        for t in vehicle.thrusters
    ]
    return vehicle.model_copy(update={"thrusters": tuple(thrusters)})


def put_right(vehicle: Vehicle, changed: Mapping[str, float], places: Sequence[Place]) -> Vehicle:
    """The vehicle with numbers and thrusters as a person says, checked as a vehicle file is.

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
    thrusters, found = {t.channel: t for t in vehicle.thrusters}, dict(entries)
    for wire in wires_of(vehicle, wires):
        entry = entries.get(wire.by)
        if entry is None:
            raise RequestError(f"no stream of the log is {wire.by}: expected one of {', '.join(sorted(entries))}")
        found[wire.channel] = _turned(entry, thrusters[wire.channel]) if wire.turned else entry
    return found


def write_rewired(path: Path, logs: Sequence[str], reading: Reading, vehicle: Vehicle, wires: Sequence[Wire]) -> Path:
    """Write the channel map by which logs are read with the thrusters driven as somebody says; see `rewired`.

    All other channels are left to what reads each log: logs may record them in streams of different names.

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
                    f"expected logs that record {command} alike, got {_told(known.get(command))} in "
                    f"{Path(names[0]).name} and {_told(entries.get(command))} in {Path(name).name}; open them one by "
                    "one to exchange or reverse thrusters"
                )
    given = {} if reading.channel_map is None else read_channel_map(Path(reading.channel_map))
    found = rewired(known, vehicle, wires)
    return write_text(path, map_text({**given, **{t.channel: found[t.channel] for t in vehicle.thrusters}}))


def _told(entry: Entry | None) -> str:
    if entry is None:
        return "nothing"
    scaled = f" times {entry.scale:g}" if entry.scale != 1.0 else ""
    return f"{entry.source}{scaled}{f' plus {entry.offset:g}' if entry.offset else ''}"


def _turned(entry: Entry, thruster: Thruster) -> Entry:
    """The same mirrored about the command at which the thruster stands still."""
    neutral = float(command_of(thruster, np.zeros(1))[0])
    return replace(entry, scale=-entry.scale, offset=2.0 * neutral - entry.offset)


def _names(thrusters: Sequence[Thruster]) -> str:
    return ", ".join(t.name for t in thrusters)
