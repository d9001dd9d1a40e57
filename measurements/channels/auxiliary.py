"""Auxiliary channels: what a log has beside motion and thruster commands, kept in `Log.auxiliary`.

Steering outputs, battery, currents and revolutions of motors, the autopilot's mode and its waypoint. No check looks at
them and no vehicle needs them.
"""

import re
from collections.abc import Sequence

import numpy as np

from ..canonical import Channel, auxiliary_unit
from ..formats.autopilots.autopilot import AUTOPILOTS
from ..formats.base import Name, Stream
from .message_types import short_kind
from .recognition import recognise, side_in

_TYPES = {
    ("sensor_msgs/BatteryState", "voltage"): ("battery_voltage", 1.0),
    ("sensor_msgs/BatteryState", "current"): ("battery_current", -1.0),
    ("mavros_msgs/WaypointList", "current_seq"): ("waypoint", 1.0),
}
"""Fields of ROS messages: the channel and its scale; by sensor_msgs/BatteryState a discharge is negative."""
_BATTERY = {"battery", "batt", "bat"}
_VOLTAGE, _CURRENT = {"voltage", "volt", "volts"}, {"current", "curr", "amps", "amperes"}
_STEER = {"steer", "steering", "rudder", "helm", "outboard"}
_ACTUATOR = {"thruster", "thrusters", "thrust", "motor", "pod", "propeller", "outboard", "actuator", "engine", "esc"}
_ACTUATOR |= {"fin"}
_ANGLE = {"azimuth", "angle", "azimuthing", "pos"}
"""`/wamv/thrusters/left/pos` turns an azimuth thruster of VRX."""
_ELSEWHERE = {"satellite", "sat", "gps", "gnss", "sun", "antenna", "lidar", "radar", "sonar", "camera", "gimbal"}
_PLAIN = {"mode": "mode", "flight_mode": "mode", "nav_state": "mode", "waypoint": "waypoint", "wp_seq": "waypoint"}
"""Whole names of columns that count something."""
_LEFT_OUT = {"cmd", "command", "data", "raw", "output", "value", "position", "state", "deg", "rad", *_ANGLE}
"""Words that tell nothing of which one it is."""


def auxiliary_of(name: Name) -> tuple[str, float] | None:
    """The auxiliary channel that a stream is by its type or name, and its scale; None where it is none.

    >>> auxiliary_of(Name("", "thruster_azimuth_angle")), auxiliary_of(Name("", "gps_satellite_azimuth"))
    (('steering_thruster', 1.0), None)
    """
    if auxiliary_unit(name.field) is not None:
        return name.field, 1.0
    if name.kind.startswith(AUTOPILOTS):
        return None  # their readers know the messages
    known = _TYPES.get((short_kind(name.kind), name.field))
    if known is not None or recognise(name) is not None:
        return known
    if not name.topic and name.field.lower() in _PLAIN:
        return _PLAIN[name.field.lower()], 1.0
    words = [word for word in re.split(r"[^a-z0-9]+", re.sub(r"([a-z])([A-Z])", r"\1_\2", name.name).lower()) if word]
    role = _by_words(words)
    return None if role is None else (role, 1.0)


def _by_words(words: list[str]) -> str | None:
    """What the words of a name say together."""
    has = set(words)
    if has & _ELSEWHERE:
        return None
    if has & _BATTERY and has & (_VOLTAGE | _CURRENT):
        return "battery_voltage" if has & _VOLTAGE else "battery_current"
    if has & _STEER or (has & _ACTUATOR and has & _ANGLE):
        return _which("steering", words, {"steer", "steering"})
    if "rpm" in has:
        return _which("rpm", words, {"rpm"})
    return _which("motor_current", words, _CURRENT | {"motor"}) if has & _CURRENT and has & _ACTUATOR else None


def _which(kind: str, words: list[str], of_kind: set[str]) -> str:
    """The kind with the side or the words that tell one from another."""
    which = side_in(" ".join(words)) or "_".join(word for word in words if word not in _LEFT_OUT | of_kind)
    return f"{kind}_{which}" if which else kind


def auxiliary_channels(streams: Sequence[Stream]) -> dict[str, Channel]:
    """The auxiliary channels among streams: finite values at rising stamps, the first stream of each name."""
    result: dict[str, Channel] = {}
    for stream in streams:
        told = auxiliary_of(stream.label)
        if told is None or told[0] in result:
            continue
        known = np.isfinite(stream.value) & np.isfinite(stream.time)
        time, last = np.unique(stream.time[known][::-1], return_index=True)
        if time.size:
            value = told[1] * stream.value[known][::-1][last]
            result[told[0]] = Channel(told[0], time, value, stream.name)
    return result
