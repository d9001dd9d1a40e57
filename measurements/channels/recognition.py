"""Recognition of channels by type and name, of the vehicles that share a log, and of what a table lacks.

A missing channel is named with the lines of a channel map that would supply it, from columns that look like it.
"""

import math
import re
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import takewhile

import numpy as np

from ...physics.errors import LogError
from ..canonical import LIMITS, command_kind, is_canonical
from ..formats.autopilots.autopilot import AUTOPILOTS
from ..formats.base import Name, Stream
from .message_types import COMMANDS, ENDINGS, JOINTS, NOT_MEASURED, Meaning, is_known, meaning_of, on_topic, short_kind

_DEGREES = math.pi / 180.0
_ARDUPILOT = {
    "gps.lat": ("lat", 1.0),
    "gps.lng": ("lon", 1.0),
    "att.yaw": ("psi", _DEGREES),
    "dcm.yaw": ("psi", _DEGREES),
    "imu.gyrz": ("r", 1.0),
    "imu.accx": ("ax", 1.0),
    "imu.accy": ("ay", 1.0),
    "rcou.c1": ("pwm_port", 1.0),
    "rcou.c3": ("pwm_stbd", 1.0),
}
"""`MESSAGE.Field` of ArduPilot in a table: the channel, NED/FRD, and its scale. Outputs 1 and 3 drive the left and the
right thruster in its usual setting for two (`SERVO1_FUNCTION` 73, `SERVO3_FUNCTION` 74); whether that is so, only a
log's parameters or the boat's answer tell."""
_OUTPUT = re.compile(r"servo_output_raw\W(?:.*\W)?servo(?P<number>\d+)_raw$")
_BANK = re.compile(r"(?:servo_output_raw|rc_channels_(?:raw|scaled))\W(?:.*\W)?port$")
"""MAVLink messages in a table: an output by its number [us], and the number of the bank of outputs, no port side."""
_PULSES = (800.0, 2200.0)
"""An output is 0 or 65535 where it is not driven (MAVLink, common.xml)."""
_PLACE = re.compile(r"(?:^|\.)(?P<axis>latitude|longitude)$")
_TRACK = re.compile(
    r"(?P<sog>sog|speed_over_ground|ground_?speed)_(?P<pace>mps|m_s|kn|kt|kts|knots)$"
    r"|(?P<cog>cog|course_over_ground|ground_?course)(?P<angle>_deg|_rad)$"
)
"""Columns of a receiver's speed and course that say their unit."""
_PACES = {"mps": 1.0, "m_s": 1.0} | dict.fromkeys(("kn", "kt", "kts", "knots"), 1852.0 / 3600.0)
_ANGLES = {"_deg": _DEGREES, "_rad": 1.0}
"""What one of each unit is in those of the channels."""

_SIDES = {side: side for side in ("port", "stbd", "front", "rear", "fore", "aft", "bow", "stern", "middle", "lateral")}
_SIDES |= {"left": "port", "starboard": "stbd", "right": "stbd"}
_KINDS = (
    ("pwm", {"pwm", "servo", "rcou", "us"}),
    ("newton", {"thrust", "force", "newton", "newtons"}),
    ("normalized", {"throttle", "normalized", "normalised"}),
    ("rad_s", {"omega", "rads"}),
)
_NOT_COMMANDS = {"enable", "min", "max", "trim", "feedback", "measured", "state", "temperature", "current"}
_NOT_COMMANDS |= {"angle", "azimuth", "pos", "position", "rpm"}
"""Words of what a thruster has beside its command: VRX turns its azimuth thrusters by `left_thrust_angle`."""
_COMMANDS = frozenset({"cmd", "command"})
_LIKE_COMMANDS = re.compile(
    r"rcou|rc/?out|servo|pwm|thrust|motor|throttle|actuator|prop|rpm|cmd|command|esc\b", re.IGNORECASE
)
"""Words in the names of streams that may be commands of thrusters."""
_PROPELLERS = {"propeller", "prop", "motor", "thruster", "screw"}


def recognise(name: Name, frame: str = "") -> Meaning | None:
    """Tell the channel that a stream's type or name speaks of, None when they speak of none.

    Parameters
    ----------
    name : topic, field and type
    frame : in which the message says its values are; empty for none
    """
    if name.kind.startswith(AUTOPILOTS):
        # Their readers know the messages, and give channels by canonical names; other fields are for channel maps.
        return Meaning(name.field, "ned", 0, "") if is_canonical(name.field) else None
    if name.kind and is_known(name.kind):
        known = meaning_of(name, frame)
        if known is None:
            return _by_topic(name)
        return replace(known, group=f"{name.topic}:{known.group}")
    if is_canonical(name.field):
        return Meaning(name.field, "log", 0, "")
    field = name.field.replace("/", ".").strip(".")
    autopilot = _ARDUPILOT.get(f"{name.topic}.{field}".strip(".").lower())
    if autopilot is not None:
        role, scale = autopilot
        return Meaning(role, "log" if role.startswith("pwm") else "ned", 2, name.name.partition(".")[0], scale)
    output = _OUTPUT.search(name.name.lower())
    if output:
        return Meaning(f"pwm_{output['number']}", "log", 2, name.name, within=_PULSES)
    # What stands in a list of things (the poses of a path) is not the vehicle's own.
    if not NOT_MEASURED.search(name.name.lower()) and "]." not in field:
        for ending, told in ENDINGS.items():
            before, end = field[: -len(ending)], field[-len(ending) :]
            if end == ending and before[-1:] in ("", "."):
                by_topic = on_topic(told.role, told.rank, name.topic)
                return by_topic and Meaning(by_topic[0], "ros", by_topic[1], f"{name.topic}:{before[:-1]}")
        place = _PLACE.search(field)
        if place:
            return Meaning(place["axis"][:3], "ned", 2, f"{name.topic}:{field[: place.start()]}")
    track = None if name.kind else _TRACK.fullmatch(field.lower())
    if track:
        role, scale = ("sog", _PACES[track["pace"]]) if track["sog"] else ("cog", _ANGLES[track["angle"]])
        return Meaning(role, "ned", 3, f"{name.topic}:track", scale)
    return _command(name)


def _by_topic(name: Name) -> Meaning | None:
    """What the topic of a single number, or the name of a joint, says."""
    short = short_kind(name.kind)
    if short == JOINTS:
        role = _propeller(name.field)
        return Meaning(role, "ned", 3, name.name) if role else None
    if short not in COMMANDS or name.field != "data":
        return None
    if name.topic.endswith("compass_hdg"):
        return Meaning("psi", "ned", 3, name.name, _DEGREES)
    return _command(name)


def _propeller(field: str) -> str | None:
    """The channel of a propeller's measured speed: of a joint of that name, on one side."""
    if field == "velocity[]":
        return "rad_s_any"
    joint, dot, what = field.rpartition(".")
    words = _words(joint)
    side = _side(words)
    return f"rad_s_{side}" if dot and what == "velocity" and side and _PROPELLERS & set(words) else None


def _command(name: Name) -> Meaning | None:
    words = _words(name.name)
    if _BANK.search(name.name.lower()) or _NOT_COMMANDS & set(words) or "joint_state" in name.name.lower():
        return None
    kind = next((kind for kind, marks in _KINDS if marks & set(words)), None)
    side = _side(words)
    return Meaning(f"{kind}_{side}", "log", 2, name.name) if kind and side else None


def like_a_command(name: str) -> bool:
    """True when a stream of that name may be a command of a thruster."""
    return _LIKE_COMMANDS.search(name) is not None


def side_in(name: str) -> str:
    """The side that a name speaks of, as channels call it, empty where it speaks of none.

    >>> side_in("cmd_starboard"), side_in("motor1")
    ('stbd', '')
    """
    return _side(_words(name.replace("_", " ")))


def says_command(name: str) -> bool:
    """True when a name says outright that it is a command.

    >>> says_command("/wamv/left_thrust_cmd:data"), says_command("/wamv/left_thrust_measure:data")
    (True, False)
    """
    return not _COMMANDS.isdisjoint(_words(name))


def _words(text: str) -> list[str]:
    return [word for word in re.split(r"[^a-z0-9]+", text.lower()) if word]


def _side(words: list[str]) -> str:
    return "_".join(dict.fromkeys(_SIDES[word] for word in words if word in _SIDES))


def is_vertical_acceleration(name: Name) -> bool:
    """Tell whether the stream is the vertical accelerometer of a ROS IMU message, which shows how it is mounted."""
    return name.field.replace("/", ".").endswith("linear_acceleration.z")


_MOTION = {
    "psi": re.compile(r"heading|hdg|yaw(?!.?rate)|compass", re.IGNORECASE),
    "x": re.compile(r"north", re.IGNORECASE),
    "y": re.compile(r"east", re.IGNORECASE),
    "u": re.compile(r"surge|forward|ahead", re.IGNORECASE),
    "v": re.compile(r"sway|starboard|lateral", re.IGNORECASE),
}
"""Words of columns that may be channels of motion."""


def says_motion(stream: str, name: str) -> bool:
    """True when the name of a stream that is no channel ends as a channel of motion is called, or speaks of it.

    >>> says_motion("odometry.psi", "psi"), says_motion("Heading (deg)", "psi"), says_motion("led.r", "psi")
    (True, True, False)
    """
    return re.split(r"[^A-Za-z0-9]+", stream)[-1] == name or _MOTION[name].search(stream) is not None


_TURN = 2.0 * np.pi + 0.01
"""Angle that a heading in radians which is not unwrapped stays below; one in degrees goes up to 360."""
_MOST = 6
"""Columns that are named."""


def lacks(have: Collection[str], streams: Sequence[Stream]) -> list[str]:
    """What a search needs and a table does not have, as sentences with the lines of a channel map to try.

    Parameters
    ----------
    have : canonical channels of the log
    streams : those that became no channel
    """
    moving = [s for s in streams if np.isfinite(s.value).any() and np.nanmin(s.value) < np.nanmax(s.value)]
    result = []
    if "psi" not in have:
        result.append(f"A search needs the heading, psi [rad].{_to_try(_of_motion(('psi',), moving))}")
    # Speeds may be left out where a position is there, and the other way round.
    if not {"u", "v"} <= set(have) and not {"x", "y"} <= set(have):
        lines = _of_motion([name for name in ("x", "y", "u", "v") if name not in have], moving)
        result.append(f"A search needs a position, x and y [m], or speeds, u and v [m/s].{_to_try(lines)}")
    if not any(command_kind(name) for name in have):
        kinds = "pwm_port [us], newton_port [N] or normalized_port [-1 to 1]"
        result.append(f"A search needs the command of each thruster, such as {kinds}.{_to_try(_of_commands(moving))}")
    return result


def _to_try(lines: Mapping[str, str]) -> str:
    listed = ", ".join(f"{name!r}: {line}" for name, line in lines.items())
    return f" By names and ranges, try channel_map={{{listed}}}." if lines else ""


def _of_motion(wanted: Sequence[str], streams: Sequence[Stream]) -> dict[str, str]:
    """Lines for the first column of each name that may be wanted."""
    result = {}
    for name in wanted:
        stream = next((s for s in streams if says_motion(s.name, name)), None)
        if stream is not None:
            degrees = name == "psi" and np.nanmax(np.abs(stream.value)) > _TURN
            result[name] = f"{{'from': {stream.name!r}, 'unit': 'deg'}}" if degrees else repr(stream.name)
    return result


def _of_commands(streams: Sequence[Stream]) -> dict[str, str]:
    """Lines for columns that may be commands: those that name a side, or where none does, all."""
    like = [stream for stream in streams if like_a_command(stream.name)]
    sided = [stream for stream in like if side_in(stream.name)] or like
    result: dict[str, str] = {}
    for stream in sided[:_MOST]:
        thruster = side_in(stream.name) or re.sub(r"\W", "_", stream.name)
        result.setdefault(f"{_kind(stream)}_{thruster}", repr(stream.name))
    return result


def _kind(stream: Stream) -> str:
    """The kind of command that has values in the range of a stream."""
    ends = float(np.nanmin(stream.value)), float(np.nanmax(stream.value))
    fits = [kind for kind in ("pwm", "normalized") if LIMITS[kind][0] <= ends[0] and ends[1] <= LIMITS[kind][1]]
    return fits[0] if fits else "newton"


_PLACES = (frozenset({"x", "y"}), frozenset({"lat", "lon"}), frozenset({"u", "v"}), frozenset({"x_dot", "y_dot"}))
_HEADINGS = (frozenset({"psi"}), frozenset({"qx", "qy", "qz", "qw"}))


def is_under(topic: str, namespace: str) -> bool:
    """True when a topic lies in a namespace; slashes at its ends do not matter.

    >>> is_under("/alpha/odometry", "alpha"), is_under("/alphabet/odometry", "alpha")
    (True, False)
    """
    return f"{topic.strip('/')}/".startswith(f"{namespace.strip('/')}/")


def vehicles(names: Sequence[Name]) -> tuple[str, ...]:
    """Name the namespaces of several vehicles, sorted; empty when one vehicle may have written everything.

    Two namespaces are two vehicles when they differ in one part only, hold a topic of the same name and type below it,
    and each tells a heading and a position or velocity of its own. Commands outside of both say that there is one
    vehicle, with two estimators.
    """
    roles: dict[tuple[str, ...], set[str]] = defaultdict(set)
    families: dict[tuple[str, ...], dict[tuple[tuple[str, ...], str], set[str]]] = defaultdict(lambda: defaultdict(set))
    for name in names:
        guess = recognise(name) if name.topic else None
        if guess is None:
            continue
        parts = tuple(name.topic.strip("/").split("/"))
        for depth in range(1, len(parts)):
            roles[parts[:depth]].add(guess.role)
            if command_kind(guess.role) is None:
                families[parts[: depth - 1]][parts[depth:], name.kind].add(parts[depth - 1])
        roles[parts].add(guess.role)
    for parent in sorted(families, key=lambda parts: (len(parts), parts)):
        alike = set().union(*(members for members in families[parent].values() if len(members) > 1))
        found = sorted(member for member in alike if _moves(roles[(*parent, member)]))
        if len(found) < 2:
            continue
        inside = [(*parent, member) for member in found]
        commanded = [parts for parts, known in roles.items() if any(command_kind(role) for role in known)]
        # A topic with commands that is no start of a longer one stands for itself.
        leaves = [parts for parts in commanded if not any(other[: len(parts)] == parts != other for other in commanded)]
        if all(any(parts[: len(own)] == own for own in inside) for parts in leaves):
            return tuple("/" + "/".join(parts) for parts in inside)
    return ()


def check_namespace(names: Sequence[Name], namespace: str | None, where: str) -> tuple[str, ...]:
    """Refuse a log of several vehicles of which none is chosen, or a namespace that is not there; give a note on it.

    Parameters
    ----------
    names : of all streams
    namespace : that was chosen
    where : the file, for messages

    Raises
    ------
    LogError
        with the namespaces that can be chosen.
    """
    found = vehicles(names)
    if namespace is None:
        if found:
            raise LogError(
                f"{where}: expected the log of one vehicle, got {len(found)}: {', '.join(found)}. Choose one with "
                f"--namespace {found[0]}."
            )
        return ()
    if not any(is_under(name.topic, namespace) for name in names if name.topic):
        there = ", ".join(found or _starts(names)[:12]) or "none: its topics have no parts"
        raise LogError(f"{where}: no topic lies in the namespace '{namespace}'; namespaces in the log: {there}.")
    others = [other for other in found if not is_under(other, namespace)]
    return (f"namespace {namespace} chosen, not {', '.join(others)}",) if others else ()


def _starts(names: Sequence[Name]) -> list[str]:
    """What the topics that may become channels begin with, as far as those of one first part agree; else all topics."""
    deep = [name for name in names if "/" in name.topic.strip("/")]
    agreed: dict[str, list[str]] = {}
    for name in [name for name in deep if recognise(name)] or deep:
        parts = name.topic.strip("/").split("/")[:-1]
        alike = takewhile(lambda pair: pair[0] == pair[1], zip(agreed.get(parts[0], parts), parts, strict=False))
        agreed[parts[0]] = [part for part, _ in alike]
    return sorted("/" + "/".join(parts) for parts in agreed.values())


def _moves(roles: set[str]) -> bool:
    return any(place <= roles for place in _PLACES) and any(heading <= roles for heading in _HEADINGS)
