"""What a stream's type and name say it is: the rules by which channels are guessed."""

import math
import re
from dataclasses import dataclass

from ..canonical import is_canonical
from ..formats.autopilots.autopilot import AUTOPILOTS
from ..formats.base import Name
from .message_types import COMMANDS, JOINTS, NOT_MEASURED, Axes, is_known, meaning_of, on_topic, short_kind

_QUATERNION = {"x": "qx", "y": "qy", "z": "qz", "w": "qw"}
_ROS = (
    (re.compile(r"(?:^|\.)pose\.position\.(?P<axis>[xy])$"), {"x": "x", "y": "y"}, 1),
    (re.compile(r"(?:^|\.)pose\.orientation\.(?P<axis>[xyzw])$"), _QUATERNION, 1),
    (re.compile(r"(?:^|\.)twist\.linear\.(?P<axis>[xy])$"), {"x": "u", "y": "v"}, 1),
    (re.compile(r"(?:^|\.)twist\.angular\.(?P<axis>z)$"), {"z": "r"}, 1),
    (re.compile(r"(?:^|\.)position\.(?P<axis>[xy])$"), {"x": "x", "y": "y"}, 2),
    (re.compile(r"(?:^|\.)orientation\.(?P<axis>[xyzw])$"), _QUATERNION, 2),
    (re.compile(r"(?:^|\.)angular_velocity\.(?P<axis>z)$"), {"z": "r"}, 2),
    (re.compile(r"(?:^|\.)linear_acceleration\.(?P<axis>[xy])$"), {"x": "ax", "y": "ay"}, 2),
)
"""Field name endings of the ROS messages, the channel of each axis, and their rank (odometry before sensors)."""
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

_SIDES = {
    "port": "port",
    "left": "port",
    "stbd": "stbd",
    "starboard": "stbd",
    "right": "stbd",
    "front": "front",
    "rear": "rear",
    "fore": "fore",
    "aft": "aft",
    "bow": "bow",
    "stern": "stern",
    "middle": "middle",
    "lateral": "lateral",
}
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


@dataclass(frozen=True, slots=True)
class Guess:
    """What a stream is taken for.

    Attributes
    ----------
    role : the canonical channel, in the axes of `axes`
    axes : "log" for those of the log (--frame), "ros" for ENU/FLU by REP-103, "ned" for NED/FRD in any log
    rank : lower is better: 0 a canonical name, 1 odometry, 2 another sensor or a guessed command, 3 a coarse one
    group : what the streams of one message share, so that x and y never come from two sources
    scale : from the stream's unit to that of the channel
    within : values outside mean "nothing"
    """

    role: str
    axes: Axes
    rank: int
    group: str
    scale: float = 1.0
    within: tuple[float, float] | None = None


def recognise(name: Name, frame: str = "") -> Guess | None:
    """Tell the channel that a stream's type or name speaks of, None when they speak of none.

    Parameters
    ----------
    name : topic, field and type
    frame : in which the message says its values are; empty for none
    """
    if name.kind.startswith(AUTOPILOTS):
        # Their readers know the messages, and give channels by canonical names; other fields are for channel maps.
        return Guess(name.field, "ned", 0, "") if is_canonical(name.field) else None
    if name.kind and is_known(name.kind):
        known = meaning_of(name, frame)
        if known is None:
            return _by_topic(name)
        return Guess(known.role, known.axes, known.rank, f"{name.topic}:{known.group}", known.scale, known.within)
    if is_canonical(name.field):
        return Guess(name.field, "log", 0, "")
    field = name.field.replace("/", ".").strip(".")
    autopilot = _ARDUPILOT.get(f"{name.topic}.{field}".strip(".").lower())
    if autopilot is not None:
        role, scale = autopilot
        return Guess(role, "log" if role.startswith("pwm") else "ned", 2, name.name.partition(".")[0], scale)
    output = _OUTPUT.search(name.name.lower())
    if output:
        return Guess(f"pwm_{output['number']}", "log", 2, name.name, within=_PULSES)
    # What stands in a list of things (the poses of a path) is not the vehicle's own.
    if not NOT_MEASURED.search(name.name.lower()) and "]." not in field:
        for pattern, roles, rank in _ROS:
            found = pattern.search(field)
            if found:
                by_topic = on_topic(roles[found["axis"]], rank, name.topic)
                return by_topic and Guess(by_topic[0], "ros", by_topic[1], f"{name.topic}:{field[: found.start()]}")
        place = _PLACE.search(field)
        if place:
            return Guess(place["axis"][:3], "ned", 2, f"{name.topic}:{field[: place.start()]}")
    command = _command(name)
    return Guess(command, "log", 2, name.name) if command else None


def _by_topic(name: Name) -> Guess | None:
    """What the topic of a single number, or the name of a joint, says."""
    short = short_kind(name.kind)
    if short == JOINTS:
        role = _propeller(name.field)
        return Guess(role, "ned", 3, name.name) if role else None
    if short not in COMMANDS or name.field != "data":
        return None
    if name.topic.endswith("compass_hdg"):
        return Guess("psi", "ned", 3, name.name, 0.017453292519943295)
    command = _command(name)
    return Guess(command, "log", 2, name.name) if command else None


def _propeller(field: str) -> str | None:
    """The channel of a propeller's measured speed: of a joint of that name, on one side."""
    if field == "velocity[]":
        return "rad_s_any"
    joint, dot, what = field.rpartition(".")
    words = _words(joint)
    side = _side(words)
    return f"rad_s_{side}" if dot and what == "velocity" and side and _PROPELLERS & set(words) else None


def _command(name: Name) -> str | None:
    words = _words(name.name)
    if _BANK.search(name.name.lower()) or _NOT_COMMANDS & set(words) or "joint_state" in name.name.lower():
        return None
    kind = next((kind for kind, marks in _KINDS if marks & set(words)), None)
    side = _side(words)
    return f"{kind}_{side}" if kind and side else None


def like_a_command(name: str) -> bool:
    """Whether a stream of that name may be a command of a thruster."""
    return _LIKE_COMMANDS.search(name) is not None


def side_in(name: str) -> str:
    """The side that a name speaks of, as channels call it, empty where it speaks of none.

    >>> side_in("cmd_starboard"), side_in("motor1")
    ('stbd', '')
    """
    return _side(_words(name.replace("_", " ")))


def says_command(name: str) -> bool:
    """Whether a name says outright that it is a command.

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
