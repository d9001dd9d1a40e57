"""The messages of one topic and shape as a table of numbers, a column for each field."""

from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from .ros_clock import Stamps
from .ros_types import MessageType

_ABSENT = {
    "sensor_msgs/msg/Imu": {
        "orientation_covariance": "orientation.",
        "angular_velocity_covariance": "angular_velocity.",
        "linear_acceleration_covariance": "linear_acceleration.",
    },
    "nav_msgs/msg/Odometry": {"twist.covariance": "twist."},
}
"""By sensor_msgs/Imu.msg, -1 as first element of a covariance says that the sensor does not measure that quantity;
MAVROS marks a twist in the same way. It may change from message to message; where it is said, there is no number."""
_NO_FIX = {"sensor_msgs/msg/NavSatFix": ("status.status", -1, ("latitude", "longitude", "altitude"))}
"""By sensor_msgs/NavSatStatus.msg, a status of -1 says that there is no fix; the position is then no number."""
LONGEST_LIST = 64
"""Elements of a list that are told apart: joints and thrusters; a longer one is a scan or a picture."""
_POSE = ("pose.", "position.", "orientation.")


class Table:
    """The messages of one topic and shape, as rows of numbers."""

    def __init__(self, message: Any, what: MessageType, wanted: set[str]) -> None:
        self.rows = array("d")
        self.received = array("q")
        self.number = array("q")
        self._scalars = [path for path in what.scalars if path in wanted]
        self._absent = {
            mark: part
            for mark, part in _ABSENT.get(what.kind, {}).items()
            if any(path.startswith(part) for path in self._scalars) and _first_of(message, mark) is not None
        }
        status, bad, masked = _NO_FIX.get(what.kind, ("", 0, ()))
        self._mask = (bad, masked) if status in what.scalars and set(masked) & set(self._scalars) else None
        arrays = [path for path, _ in what.arrays if path in wanted] + [p for p in what.sequences if p in wanted]
        self._fields = list(self._scalars)
        for path in arrays:
            self._fields += _element_names(message, what, path)
        self._frames = {text: str(getattr(message, text)) for text in what.texts}
        if what.has_header:
            self._frames["frame_id"] = str(message.header.frame_id)
        before = ["header.stamp.sec", "header.stamp.nanosec"] if what.has_header else []
        self._stamped = what.has_header
        self._ahead = len(self._absent) + len(before) + (self._mask is not None)
        paths = (*before, *([status] if self._mask else []), *self._scalars)
        self.get = _getter(paths, arrays, tuple(self._absent))
        self._width = self._ahead + len(self._fields)

    def stamps(self, name: str) -> Stamps:
        """Times of receipt, and of the header where there is one [ns]."""
        received = np.frombuffer(self.received, np.int64)
        if not self._stamped:
            return Stamps(received, None, name)
        table = self._matrix()[:, len(self._absent) :]
        return Stamps(received, table[:, 0].astype(np.int64) * 1_000_000_000 + table[:, 1].astype(np.int64), name)

    def columns(self) -> dict[str, np.ndarray]:
        """The values of each field."""
        table = self._matrix()
        found = {field: table[:, self._ahead + k] for k, field in enumerate(self._fields)}
        if self._mask is not None:
            bad, masked = self._mask
            fixed = table[:, self._ahead - 1] > bad
            found |= {field: np.where(fixed, found[field], np.nan) for field in masked if field in found}
        for k, part in enumerate(self._absent.values()):
            known = table[:, k] != -1.0
            if not known.all():
                found |= {f: np.where(known, found[f], np.nan) for f in self._scalars if f.startswith(part)}
        return found

    def frame(self, field: str) -> str:
        """The frame in which a field is given."""
        return frame_of(field, self._frames)

    def _matrix(self) -> np.ndarray:
        return np.frombuffer(self.rows, float).reshape(-1, self._width)


def frame_of(field: str, frames: Mapping[str, str]) -> str:
    """Tell the frame of a field: by the texts `frame_id` and `child_frame_id` of its message."""
    if "child_frame_id" in frames and not field.startswith(_POSE):
        return frames["child_frame_id"]
    return frames.get("frame_id", "")


def _first_of(message: Any, path: str) -> float | None:
    """The first element of an array in a message; None where a type of that name has no such array."""
    try:
        return float(attrgetter(path)(message)[0])
    except (AttributeError, IndexError, TypeError, ValueError):
        return None


def _element_names(message: Any, what: MessageType, path: str) -> list[str]:
    count = len(attrgetter(path)(message))
    if count > LONGEST_LIST:
        raise ValueError(f"{path} has {count} elements")
    if not what.has_names:
        return [f"{path}[{k}]" for k in range(count)]
    names = [str(name) for name in message.name]
    if count and len(names) != count:
        raise ValueError(f"{path} has {count} elements for {len(names)} names")
    twice = {name for name, times in Counter(names).items() if times > 1}
    return [f"{name}[{k}].{path}" if name in twice else f"{name}.{path}" for k, name in enumerate(names[:count])]


def _getter(paths: Sequence[str], arrays: Sequence[str], marks: Sequence[str]) -> Any:
    """A function that gives the numbers of a message in the order of the columns: first those that open an array."""
    first = attrgetter(*paths) if paths else None
    one = len(paths) == 1
    if not arrays and not marks and first is not None and not one:
        return first
    rest = [attrgetter(path) for path in arrays]
    opening = [attrgetter(path) for path in marks]

    def get(message: Any) -> list[float]:
        row: list[float] = [part(message)[0] for part in opening]
        if first is not None:
            found: Any = first(message)
            row += [found] if one else found
        for part in rest:
            row.extend(part(message))
        return row

    return get
