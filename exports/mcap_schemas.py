"""The messages of `series.mcap`: JSON Schemas of undertow's own, and the well-known ones that Foxglove draws in 3D."""

from collections.abc import Mapping, Sequence
from typing import TypedDict

from ..physics.motion import FORCE_UNITS

EARTH, BOAT = "map", "boat"
"""The frames of 3D views, both with z up: x east and y north; x ahead and y to port."""
AXES_TOLD = f"numbers: NED/FRD, SI; poses, the path and the frames {EARTH} and {BOAT}: ENU/FLU (z up, REP-103)"
STATE = {
    "x": "north [m]",
    "y": "east [m]",
    "psi": "heading, clockwise from north [rad]",
    "u": "surge speed over ground [m/s]",
    "v": "sway speed over ground, positive to starboard [m/s]",
    "r": "yaw rate, positive to starboard [rad/s]",
}
RATES = {
    "u_dot": "surge acceleration, du/dt [m/s^2]",
    "v_dot": "sway acceleration, dv/dt [m/s^2]",
    "r_dot": "yaw acceleration, dr/dt [rad/s^2]",
}
_FORCE = {
    "X": f"surge force [{FORCE_UNITS[0]}]",
    "Y": f"sway force, positive to starboard [{FORCE_UNITS[1]}]",
    "N": f"yaw moment, positive to starboard [{FORCE_UNITS[2]}]",
}

# Texts, to be filled with a stamp (seconds, nanoseconds) and a place (x, y, and z and w of a quaternion about z)

_STAMP_TEXT = '"timestamp":{"sec":%d,"nsec":%d}'
_TURN_TEXT = '{"x":0.0,"y":0.0,"z":%r,"w":%r}'
_POINT_TEXT = '{"x":%r,"y":%r,"z":0.0}'
POSE_TEXT = f'{{"position":{_POINT_TEXT},"orientation":{_TURN_TEXT}}}'
POSE_IN_FRAME_TEXT = f'{{{_STAMP_TEXT},"frame_id":"{EARTH}","pose":{POSE_TEXT}}}'
PATH_TEXT = f'{{{_STAMP_TEXT},"frame_id":"{EARTH}","poses":[%s]}}'
FRAME_TRANSFORM_TEXT = (
    f'{{{_STAMP_TEXT},"parent_frame_id":"{EARTH}","child_frame_id":"BOAT",'
    f'"transform":{{"translation":{_POINT_TEXT},"rotation":{_TURN_TEXT}}}}}'
)


class Schema(TypedDict, total=False):
    """What of JSON Schema the messages need."""

    title: str
    type: str
    description: str
    minimum: int
    maximum: int
    properties: "dict[str, Schema]"
    items: "Schema"


def _object(title: str, properties: "Mapping[str, Schema]") -> Schema:
    return {"title": title, "type": "object", "properties": dict(properties)}


def _numbers(title: str, told: Mapping[str, str]) -> Schema:
    return _object(title, {name: {"type": "number", "description": text} for name, text in told.items()})


def measured_schema(channels: Sequence[str]) -> Schema:
    """The schema of what was measured, commands included."""
    commands = dict.fromkeys(channels, "command, in the unit of its name: pwm [us], normalized, rad_s or newton [N]")
    numbers = _numbers("undertow.Measured", STATE | RATES | commands).get("properties", {})
    return _object(
        "undertow.Measured", {**numbers, "part": {"type": "string", "description": "train, validation or test"}}
    )


_TEXT: Schema = {"type": "string"}
_TIME = _object(
    "time",
    {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999}},
)
_VECTOR = _numbers("foxglove.Vector3", {"x": "east [m]", "y": "north [m]", "z": "up [m]"})
_QUATERNION = _numbers("foxglove.Quaternion", dict.fromkeys("xyzw", "of the turn from the frame's axes"))
_POSE = _object("foxglove.Pose", {"position": _VECTOR, "orientation": _QUATERNION})

SCHEMAS: dict[str, Schema] = {
    "undertow.Predicted": _numbers("undertow.Predicted", STATE | RATES),
    "undertow.Force": _numbers("undertow.Force", _FORCE),
    "foxglove.PoseInFrame": _object("foxglove.PoseInFrame", {"timestamp": _TIME, "frame_id": _TEXT, "pose": _POSE}),
    "foxglove.PosesInFrame": _object(
        "foxglove.PosesInFrame", {"timestamp": _TIME, "frame_id": _TEXT, "poses": {"type": "array", "items": _POSE}}
    ),
    "foxglove.FrameTransform": _object(
        "foxglove.FrameTransform",
        {
            "timestamp": _TIME,
            "parent_frame_id": _TEXT,
            "child_frame_id": _TEXT,
            "transform": _object("foxglove.Transform", {"translation": _VECTOR, "rotation": _QUATERNION}),
        },
    ),
}
"""By name, all but that of what was measured, which depends on the commands."""
