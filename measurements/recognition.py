"""What a stream's name says it is: the rules by which channels are guessed."""

import re
from dataclasses import dataclass

from .channels import is_canonical
from .formats.base import Stream

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

_NOT_MEASURED = re.compile(r"cmd|command|setpoint|desired|reference|target|goal|velocity_local")
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


@dataclass(frozen=True, slots=True)
class Guess:
    """What a name says.

    Attributes
    ----------
    role : the canonical channel, in the axes of `ros` or of the log
    ros : whether it is a ROS-style field, ENU/FLU by REP-103
    rank : lower is better: 0 a canonical name, 1 odometry, 2 another sensor or a guessed command
    group : what the streams of one message share, so that x and y never come from two sources
    """

    role: str
    ros: bool
    rank: int
    group: str


def recognise(stream: Stream) -> Guess | None:
    """Tell the channel that a stream's name speaks of, None when it speaks of none."""
    if is_canonical(stream.field):
        return Guess(stream.field, False, 0, "")
    field = stream.field.replace("/", ".").strip(".")
    if not _NOT_MEASURED.search(stream.name.lower()):
        for pattern, roles, rank in _ROS:
            found = pattern.search(field)
            if found:
                return Guess(roles[found["axis"]], True, rank, f"{stream.topic}:{field[: found.start()]}")
    command = _command(stream)
    return Guess(command, False, 2, stream.name) if command else None


def _command(stream: Stream) -> str | None:
    words = [word for word in re.split(r"[^a-z0-9]+", stream.name.lower()) if word]
    if _NOT_COMMANDS & set(words) or "joint_state" in stream.name.lower():
        return None
    kind = next((kind for kind, marks in _KINDS if marks & set(words)), None)
    sides = list(dict.fromkeys(_SIDES[word] for word in words if word in _SIDES))
    if kind is None or not sides:
        return None
    return f"{kind}_{'_'.join(sides)}"


def is_vertical_acceleration(stream: Stream) -> bool:
    """Tell whether the stream is the vertical accelerometer of a ROS IMU message, which shows how it is mounted."""
    return stream.field.replace("/", ".").endswith("linear_acceleration.z")
