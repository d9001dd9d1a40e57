"""Channels that a vehicle needs of a log, and what to say when one is missing."""

import re
from collections.abc import Sequence

import numpy as np

from ...physics.errors import LogError
from ...physics.motion import Array
from ...physics.thrusters import side_named
from ...physics.vehicle import Vehicle
from ..canonical import COMMAND_UNITS, Channel, command_kind, kind_of, unit_of
from ..channels.channel_map import Entry, map_text
from ..channels.recognition import like_a_command, says_motion
from ..formats.base import some
from ..log import Log


def command_channels(vehicle: Vehicle | None) -> tuple[str, ...]:
    """Names of the command channels of a vehicle, `<command>_<thruster>`, in its order; none without a vehicle."""
    return tuple(thruster.channel for thruster in vehicle.thrusters) if vehicle else ()


def problems(log: Log, vehicle: Vehicle | None) -> list[str]:
    """Everything that keeps a log from being used for a vehicle, as sentences without the file name."""
    result = []
    have = log.channels
    if "psi" not in have:
        result.append(
            f"expected a heading (psi or a quaternion), got only {_listed(log)}. Map it with a channel map"
            f"{_such_as(log, ('psi',))}."
        )
    elif have["psi"].time.size < 2:
        result.append("expected at least 2 samples of psi, got 1.")
    else:
        result += _angle_problems(have["psi"], have.get("r"))
    velocities = [name for name in ("u", "v") if name not in have]
    if velocities and not {"x", "y"} <= set(have):
        result.append(
            f"expected u and v (or x and y, to derive them), but {' and '.join(velocities)} and a position are "
            f"missing; got {_listed(log)}. Map them with a channel map{_such_as(log, ('x', 'y', 'u', 'v'))}."
        )
    missing = [name for name in command_channels(vehicle) if name not in have]
    told = _numbered(log, missing) or _mixed(log, missing) or _generalised(log, missing)
    result += [told] if told else [_command_problem(log, name) for name in missing]
    result += [
        f"{name} has one sample in {channel.period:g} s (at least one in 2 s is needed). Is the time column in seconds?"
        for name, channel in have.items()
        if command_kind(name) is None and name not in ("ax", "ay") and channel.period > 2.0
    ]
    return result


def require(log: Log, vehicle: Vehicle | None) -> None:
    """Refuse a log that cannot be used for a vehicle.

    Raises
    ------
    LogError
        with the first of `problems`.
    """
    found = problems(log, vehicle)
    if found:
        raise LogError(f"{log.path}: {' '.join((found[0], *log.lacks))}")


def _such_as(log: Log, names: Sequence[str]) -> str:
    """The lines of a channel map for streams whose names say such channels, as the end of a sentence; or empty."""
    like = {name: next((stream for stream in log.unused if says_motion(stream, name)), None) for name in names}
    entries = {
        name: Entry(stream, np.pi / 180.0 if name == "psi" and "deg" in stream.lower() else 1.0)
        for name, stream in like.items()
        if stream is not None
    }
    lines = map_text(entries).splitlines()
    return f", such as {' and '.join(repr(line) for line in lines)}" if lines else ""


def _listed(log: Log) -> str:
    return " ".join(log.channels) or "no channel"


def _numbered(log: Log, missing: Sequence[str]) -> str:
    """What to say where commands are missing and the log has as many of their kind, by number; else empty."""
    kinds = {kind_of(name) for name in missing}
    spare = [
        channel
        for name, channel in sorted(log.channels.items(), key=lambda item: (len(item[0]), item[0]))  # 2 before 10
        if (kind := command_kind(name)) and kind[0] in kinds and kind[1].isdigit()
    ]
    if len(kinds) != 1 or len(spare) < len(missing):
        return ""
    pairs = zip(missing, spare, strict=False)
    lines = map_text({name: log.entries.get(channel.name) or Entry(channel.origin) for name, channel in pairs})
    names = " ".join(channel.name for channel in spare)
    return (
        f"missing command channel {' '.join(missing)}; the log has {names}, by number of the output, and does not say "
        "which thruster each one drives. Say so in a channel map (--map channels.yaml), a line for each, such as "
        f"{' and '.join(lines.splitlines())} (if these are the outputs); 'undertow inspect' with that map then tells "
        "whether sides and directions are right."
    )


_THROTTLE, _STEERING = (re.compile(word, re.IGNORECASE) for word in ("throttle|thr_?out", "steer"))
"""Words in the names of the two demands of a boat that is steered by its sides."""


def mix_of(log: Log, names: Sequence[str]) -> dict[str, Entry]:
    """The lines of a channel map that mix the log's throttle and steering into sides; none where it has not both."""
    throttle = next((name for name in log.unused if _THROTTLE.search(name)), None)
    steering = next((name for name in log.unused if _STEERING.search(name)), None)
    if throttle is None or steering is None:
        return {}
    return {name: Entry(throttle, steering=Entry(steering)) for name in names}


def _mixed(log: Log, missing: Sequence[str]) -> str:
    """What to say where commands of two sides are missing and the log has throttle and steering; else empty."""
    sides = {side_named((command_kind(name) or ("", ""))[1]) for name in missing}
    entries = mix_of(log, missing)
    if sides != {"port", "starboard"} or not entries:
        return ""
    lines, throttle = map_text(entries), next(iter(entries.values()))
    return (
        f"missing command channel {' '.join(missing)}; the log has {' and '.join(throttle.sources)}. "
        f"Mix them into the two sides in a channel map (--map channels.yaml): {' and '.join(lines.splitlines())}, both "
        "with the scale that makes them the command's unit, such as '{from: steering, scale: 0.01}' of percent."
    )


def _generalised(log: Log, missing: Sequence[str]) -> str:
    """What to say where commands are missing and the log has forces and moments in their place; else empty."""
    taus = [name for name in log.channels if kind_of(name) == "tau"]
    if not missing or not taus:
        return ""
    actuators = "; ".join(f"{{name: {name.removeprefix('tau_')}, command: tau, curve: ...}}" for name in taus)
    return (
        f"missing command channel {' '.join(missing)}; the log has {' and '.join(taus)}, force and moment of the whole "
        f"vessel, and not the commands of its thrusters. Give a vehicle with such actuators (thrusters: {actuators}); "
        "'undertow init LOG' writes one."
    )


def like_commands(log: Log) -> list[str]:
    """Streams that became no channel, and whose names are like those of commands; what steers is none."""
    kept = {channel.origin for channel in log.auxiliary.values()}
    return [stream for stream in log.unused if like_a_command(stream) and stream not in kept]


def _command_problem(log: Log, name: str) -> str:
    kind, thruster = command_kind(name) or ("", name)
    unit = COMMAND_UNITS.get(kind, "?")
    others = [other for other in log.channels if (command_kind(other) or ("", ""))[1] == thruster]
    if others:
        other = kind_of(others[0])
        return (
            f"wrong command kind: the vehicle wants {name} [{unit}] for thruster '{thruster}', the log has "
            f"{' '.join(others)} [{unit_of(others[0])}]. Give the thruster 'command: {other}' with its curve in the "
            f"vehicle file, or map a stream of kind {kind} to {name}."
        )
    commands = [other for other in log.channels if command_kind(other)]
    likely = like_commands(log)
    cure = f"map a stream to {name}, such as {some(likely, 6)}" if likely else f"map a stream to {name}"
    return (
        f"missing command channel {name} of thruster '{thruster}'; commands in the log: "
        f"{' '.join(commands) or 'none'}; all channels: {_listed(log)}. "
        f"{'Rename the thruster, or m' if commands else 'M'}{cure[1:]}."
    )


def _angle_problems(heading: Channel, rate: Channel | None) -> list[str]:
    """Degrees where radians are due: never converted silently, always refused."""
    steps = np.abs(np.diff(heading.value))
    jumps = (steps > 340.0) & (steps < 361.0) & (np.diff(heading.time) < 2.0)
    cure = "Map it with 'scale: 0.017453292519943'."
    if jumps.any():
        return [f"psi ({heading.origin}) must be in radians, but it jumps by 360 as degrees do. {cure}"]
    if rate is None or rate.time.size < 20 or heading.time.size < 20:
        return []
    measured = np.interp(heading.time, rate.time, rate.value)
    # Degrees are torn where they are unwrapped as radians: the reading that follows the yaw rate is the right one.
    angles = (np.unwrap(heading.value, period=period) for period in (2.0 * np.pi, 360.0))
    readings = [_followed(np.gradient(angle, heading.time), measured) for angle in angles]
    if min(measured.std(), *(spread for _, _, spread in readings)) < 1e-6:
        return []
    alike, ratio, _ = max(readings, key=lambda reading: reading[0])
    if alike < 0.5:
        return []
    if 30.0 < ratio < 120.0:
        return [
            f"psi ({heading.origin}) turns {ratio:.0f} times as fast as r ({rate.origin}): psi is in degrees. {cure}"
        ]
    if 1 / 120.0 < ratio < 1 / 30.0:
        return [f"r ({rate.origin}) is {1 / ratio:.0f} times the turning of psi: r is in degrees per second. {cure}"]
    return []


def _followed(turning: Array, measured: Array) -> tuple[float, float, float]:
    """Correlation of a turning with the measured one, its size over that, and its standard deviation."""
    ratio = abs(float(turning @ measured)) / max(float(measured @ measured), 1e-300)
    turning = turning - turning.mean()
    power = float(turning @ turning)
    # The mean of the measured one does not count: the other has none.
    both = abs(float(turning @ measured))
    alike = both / max(float(np.sqrt(power * measured.size) * measured.std()), 1e-300)
    return alike, ratio, float(np.sqrt(power / measured.size))
