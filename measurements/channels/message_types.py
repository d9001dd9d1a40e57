"""Messages of robots: the channel of each number of each type that undertow knows, and whose a message is."""

import math
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ..canonical import command_kind
from ..formats.base import Name, Stream

Axes = Literal["log", "ros", "ned"]
"""Of a value: as the log's canonical channels (--frame), ENU/FLU by REP-103, or NED/FRD whatever the log has."""


@dataclass(frozen=True, slots=True)
class Meaning:
    """What one number of a message is, or a stream is taken for.

    Attributes
    ----------
    role : the canonical channel, in the axes of `axes`
    axes : see `Axes`
    rank : lower is better: 0 a canonical name, 1 odometry, 2 a sensor or a guessed command, 3 a coarse instrument
    group : start of the field's name that the numbers of one quantity share; of a stream what those of one message
        share, so that x and y never come from two sources
    scale : from the message's unit to that of the channel
    within : values outside mean "nothing" by the definition of the message
    """

    role: str
    axes: Axes
    rank: int
    group: str = ""
    scale: float = 1.0
    within: tuple[float, float] | None = None


def _fields(group: str, rank: int, roles: Mapping[str, str], axes: Axes = "ros") -> dict[str, Meaning]:
    """The numbers of one quantity by their full names, of the last parts of these and their roles."""
    return {f"{group}{part}": Meaning(role, axes, rank, group) for part, role in roles.items()}


_QUATERNION = {axis: f"q{axis}" for axis in "xyzw"}


def _pose(prefix: str, rank: int) -> dict[str, Meaning]:
    place = _fields(f"{prefix}position.", rank, {"x": "x", "y": "y"})
    return place | _fields(f"{prefix}orientation.", rank, _QUATERNION)


def _twist(prefix: str, rank: int) -> dict[str, Meaning]:
    return _fields(f"{prefix}linear.", rank, {"x": "u", "y": "v"}) | _fields(f"{prefix}angular.", rank, {"z": "r"})


def _place(prefix: str) -> dict[str, Meaning]:
    return _fields(prefix, 2, {"latitude": "lat", "longitude": "lon"}, "ned")


_IMU = _fields("orientation.", 2, _QUATERNION) | _fields("angular_velocity.", 2, {"z": "r"})
_IMU |= _fields("linear_acceleration.", 2, {"x": "ax", "y": "ay"})
ENDINGS = _pose("pose.", 1) | _twist("twist.", 1) | _pose("", 2) | _IMU
"""Endings of the names of fields in flattened ROS messages; odometry before sensors."""
_COMPASS = Meaning("psi", "ned", 3, scale=math.pi / 180.0)

TYPES: Mapping[str, Mapping[str, Meaning]] = {
    "nav_msgs/Odometry": _pose("pose.pose.", 1) | _twist("twist.twist.", 1),
    "geometry_msgs/PoseStamped": _pose("pose.", 1),
    "geometry_msgs/PoseWithCovarianceStamped": _pose("pose.pose.", 1),
    "geometry_msgs/TwistStamped": _twist("twist.", 1),
    "geometry_msgs/TwistWithCovarianceStamped": _twist("twist.twist.", 1),
    "sensor_msgs/Imu": _IMU,
    "sensor_msgs/NavSatFix": _place(""),
    "gps_common/GPSFix": _place(""),
    "gps_msgs/GPSFix": _place(""),
    "geographic_msgs/GeoPoseStamped": _place("pose.position."),
    "geographic_msgs/GeoPointStamped": _place("position."),
    "mavros_msgs/VFR_HUD": {"heading": _COMPASS},
    "mavros_msgs/VfrHud": {"heading": _COMPASS},
    # SERVO_OUTPUT_RAW of MAVLink: 0 and 65535 [us] stand for an output that is not driven.
    "mavros_msgs/RCOut": {
        f"channels[{k}]": Meaning(f"pwm_{k + 1}", "ned", 2, f"channels[{k}]", within=(800.0, 2200.0)) for k in range(32)
    }
    | {"channels[]": Meaning("pwm_0", "ned", 2)},
    "heron_msgs/Drive": {
        field: Meaning(f"normalized_{side}", "ned", 2, field) for field, side in (("left", "port"), ("right", "stbd"))
    },
    "sensor_msgs/JointState": {},  # by the names of the joints, see `recognition`
    "std_msgs/Float64": {},  # commands, by the name of the topic
    "std_msgs/Float32": {},
}
"""ROS message types by package and name. The axes are those of REP-103 and REP-105; ranks put odometry first."""

JOINTS = "sensor_msgs/JointState"
COMMANDS = frozenset({"std_msgs/Float64", "std_msgs/Float32", "std_msgs/Int16", "std_msgs/Int32", "std_msgs/UInt16"})
"""Types of one number, whose topic tells what it is."""
_STANDARD = re.compile(
    "(actionlib|control|diagnostic|geographic|geometry|gps|map|mavros|nav|rosgraph|sensor|shape|std|stereo|tf2"
    "|trajectory|vision|visualization)_msgs|gps_common|rcl_interfaces"
)
"""Packages whose types are known: what is not in `TYPES` is no measurement of the vehicle (a marker, a path)."""
_EARTH = re.compile(r"(map|odom|world|earth|enu|ned|utm|local_origin|gps)(_ned|_enu)?")
_DOWN = re.compile(r"(^|.*_)(ned|frd)")
PREDICTED = re.compile("predict")
NOT_MEASURED = re.compile(r"cmd|command|setpoint|desired|reference|target|goal|predict|initial_?pose")
"""In the name of what is wanted or predicted of a vehicle; commands of thrusters may bear such names."""
_LEVEL = re.compile(r"(map|odom|world|enu|ned|utm|local_origin)(_ned|_enu)?")
"""Frames of the earth whose z axis is vertical; `earth` itself is not one, but its centre (REP-105)."""
_LEVEL_TOPIC = re.compile(r"velocity_local$|global_position/local$")
"""MAVROS gives these in ENU axes, and names the frame of the body (local_position.cpp, global_position.cpp)."""
_GLOBAL_TOPIC = re.compile(r"global_position/local$")
"""The fixes of the receiver as odometry of MAVROS: it fills in no rate of turn, and its own estimate is another."""
_ALONG = {"u": "x_dot", "v": "y_dot"}


def short_kind(kind: str) -> str:
    """Package and name of a type, as ROS 1 has it.

    >>> short_kind("nav_msgs/msg/Odometry")
    'nav_msgs/Odometry'
    """
    return kind.replace("/msg/", "/")


def is_known(kind: str) -> bool:
    """True when the type itself says what its numbers are, so that the names of its fields are not asked."""
    short = short_kind(kind)
    return short in TYPES or _STANDARD.fullmatch(short.partition("/")[0]) is not None


def meaning_of(name: Name, frame: str = "") -> Meaning | None:
    """Tell what the type of a message says of one of its numbers, None for nothing.

    Parameters
    ----------
    name : of the stream
    frame : in which the message says it is: a twist in a frame of the earth is no velocity ahead and to starboard; a
        frame whose name ends in `ned` or `frd` is one. In a level frame it is a velocity along `x` and `y`
    """
    found = TYPES.get(short_kind(name.kind), {}).get(name.field)
    if found is None or (command_kind(found.role) is None and NOT_MEASURED.search(name.topic.lower())):
        return None
    last = frame.strip("/").rpartition("/")[2].lower()
    told = on_topic(found.role, found.rank, name.topic)
    if told is None:
        return None
    if told[0] != found.role:
        return replace(found, role=told[0], rank=told[1])
    found = replace(found, rank=told[1])
    if found.role in _ALONG and _EARTH.fullmatch(last):
        if not _LEVEL.fullmatch(last):
            return None
        found = replace(found, role=_ALONG[found.role])
    return replace(found, axes="ned") if found.axes == "ros" and _DOWN.fullmatch(last) else found


def on_topic(role: str, rank: int, topic: str) -> tuple[str, int] | None:
    """What a role and its rank become in a topic whose name says more than its type; None for no measurement.

    >>> on_topic("u", 1, "/mavros/local_position/velocity_local"), on_topic("u", 1, "/odom")
    (('x_dot', 1), ('u', 1))
    >>> on_topic("x", 1, "/mavros/global_position/local"), on_topic("r", 1, "/mavros/global_position/local")
    (('x', 3), None)
    """
    topic = topic.lower()
    if _GLOBAL_TOPIC.search(topic):
        if role == "r":
            return None
        rank = 3
    return (_ALONG.get(role, role) if _LEVEL_TOPIC.search(topic) else role), rank


def is_earth_velocity(name: Name, frame: str) -> bool:
    """True when a stream would be a velocity of the body, were it not given in a frame of the earth."""
    return meaning_of(name, frame) is None and meaning_of(name) is not None


_OTHERS = re.compile(
    r"(?<![a-z])(cam(era)?|optical|aruco|april_?tag|tag|marker|fiducial|gimbal|buoy|obstacle|target|goal|waypoint|light"
    r"|lamp|led|other|neighbou?r|beacon|landmark|object|detect(ion|ed|or)?|intruder|ais|zed|realsense|lidar|radar)s?(?![a-z])"
)
"""Words, in topics and frames, of what is on board or beside the boat and moves otherwise than it."""
_BODY = re.compile(r"(base_link|base_footprint|body)(_frd|_flu)?")
"""Frames of the boat itself: a pose in one of them is that of something else."""
_POSES = ("geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")
_COLOURS = frozenset("rgb")


def colours(streams: Iterable[Stream]) -> set[int]:
    """The streams (by `id`) that are colours: an `r` with a `g` and a `b` beside it in one message is no yaw rate."""
    found: dict[str, dict[str, Stream]] = defaultdict(dict)
    for stream in streams:
        parent, _, last = stream.name.lower().replace("/", ".").rpartition(":")[2].rpartition(".")
        if last in _COLOURS:
            found[f"{stream.topic}:{parent}"][last] = stream
    return {id(one) for named in found.values() if named.keys() >= _COLOURS for one in named.values()}


def others(streams: Sequence[Stream]) -> dict[str, str]:
    """The topics that are of something else than the boat -> the word or frame that tells.

    >>> import numpy as np
    >>> def one(topic, frame):
    ...     return Stream(topic, "pose.position.x", np.zeros(1), np.zeros(1), np.ones(1, int), frame=frame)
    >>> others([one("/odom", "odom"), one("/pose", "cam_optical"), one("/buoy/pose", "map")])
    {'/pose': "its frame 'cam_optical'", '/buoy/pose': 'its name'}
    """
    result: dict[str, str] = {}
    for stream in streams:
        frame = stream.frame.lower().strip("/").rpartition("/")[2]
        relative = _BODY.fullmatch(frame) and stream.kind.replace("/msg/", "/") in _POSES
        if stream.topic in result:
            continue
        if _OTHERS.search(stream.topic.lower()):
            result[stream.topic] = "its name"
        elif relative or _OTHERS.search(frame):
            result[stream.topic] = f"its frame '{stream.frame}'"
    return result


_HEADINGS, _PLACES, _SPEEDS = (
    ({"psi"}, {"qw"}),
    ({"x", "y"}, {"lat", "lon"}),
    ({"u", "v"}, {"x_dot", "y_dot"}, {"sog", "cog"}),
)


def unneeded(own: Collection[str], roles: Collection[str]) -> set[str]:
    """Of the roles that another thing's messages have, those that the boat's `own` roles make needless.

    Where the boat's own messages tell a heading, and a place or a speed, nothing of another thing is taken; else only
    what they do not tell in any form.
    """
    known = set(own)
    told = [any(way <= known for way in ways) for ways in (_HEADINGS, _PLACES, _SPEEDS)]
    commanded = any(command_kind(role) for role in known)
    if told[0] and (told[1] or told[2]):
        return {role for role in roles if commanded or command_kind(role) is None}
    forms = [
        set().union(*ways) | ({"qx", "qy", "qz"} if ways is _HEADINGS else set())
        for ways in (_HEADINGS, _PLACES, _SPEEDS)
    ]
    needless = set().union(*(form for form, has in zip(forms, told, strict=True) if has))
    return {role for role in roles if role in needless or (commanded and command_kind(role) is not None)}
