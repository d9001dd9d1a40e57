"""From the raw messages of a bag to streams: chosen topics are unpacked, field by field, into plain arrays."""

from array import array
from collections import Counter
from collections.abc import Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from ...physics.errors import LogError
from .base import Name, Recording, Request, Stream
from .ros_clock import DISORDER, Stamps, agree
from .ros_types import MessageType, message_type

_ABSENT = {
    "sensor_msgs/msg/Imu": {
        "orientation_covariance": "orientation",
        "angular_velocity_covariance": "angular_velocity",
        "linear_acceleration_covariance": "linear_acceleration",
    }
}
"""By sensor_msgs/Imu.msg, -1 as first element of a covariance says that the sensor does not measure that quantity."""
_NO_FIX = {"sensor_msgs/msg/NavSatFix": ("status.status", -1, ("latitude", "longitude", "altitude"))}
"""By sensor_msgs/NavSatStatus.msg, a status of -1 says that there is no fix; the position is then no number."""
_MOST_ELEMENTS = 64
_MOST_SHAPES = 64
_POSE = ("pose.", "position.", "orientation.")


class Collector:
    """Takes the messages of one bag, unpacks those that are chosen, and makes a `Recording` of them.

    Parameters
    ----------
    request : what is asked; its `choose` picks the fields
    distribution : ROS 2 distribution whose types are taken where the bag defines none
    """

    def __init__(self, request: Request, distribution: str = "") -> None:
        self._request = request
        self._distribution = distribution
        self._topics: dict[tuple[str, str, str], _Topic | None] = {}
        self._by_id: dict[int, _Topic] = {}
        self._unread: dict[Name, None] = {}
        self._unknown: dict[str, str] = {}
        self._first: int | None = None

    def new_file(self) -> None:
        """Forget the connection numbers of the last file; topics go on."""
        self._by_id.clear()

    def connect(self, number: int, topic: str, kind: str, definition: str, language: str, encoding: str) -> bool:
        """Learn of a topic of the file, and tell whether its messages are wanted.

        Parameters
        ----------
        number : by which messages name it
        topic, kind : names of the topic and of its type
        definition, language : of the type, see `message_type`
        encoding : of the messages: ros1, cdr, or another, which is not read
        """
        key = (topic, kind, definition)
        if key not in self._topics:
            self._topics[key] = self._new(topic, kind, definition, language, encoding)
        found = self._topics[key]
        if found is None:
            self._by_id.pop(number, None)
            return False
        self._by_id[number] = found
        return True

    def message(self, number: int, received: int, raw: bytes | memoryview) -> None:
        """Take one message, received at a time [ns]; one that nobody wants is passed over."""
        if self._first is None or received < self._first:
            self._first = received
        topic = self._by_id.get(number)
        if topic is not None:
            topic.take(received, raw)

    def recording(self, notes: Sequence[str]) -> Recording:
        """Make streams of all that came; `notes` are those of the file.

        Raises
        ------
        LogError
            when messages of a chosen topic came, and not one of all could be unpacked.
        """
        topics = [topic for topic in self._topics.values() if topic is not None]
        broken = [f"{t.name}: {t.broken} broken messages left out" for t in topics if t.broken]
        taken = [topic for topic in topics if topic.stamps]
        if topics and not taken and broken:
            raise LogError(f"no message could be unpacked ({'; '.join(broken)}). Copy the log again.")
        times, clock = agree([stamps for topic in taken for stamps in topic.stamps], self._first or 0)
        streams, at = [], 0
        for topic in taken:
            count = len(topic.stamps)
            streams += topic.streams(times[at : at + count])
            at += count
        unknown = [f"{topic}: left out, its type cannot be read ({why})" for topic, why in self._unknown.items()]
        return Recording(tuple(streams), (*notes, *clock, *broken, *unknown), tuple(self._unread))

    def _new(self, topic: str, kind: str, definition: str, language: str, encoding: str) -> "_Topic | None":
        if encoding not in ("ros1", "cdr"):
            self._unread[Name(topic, f"({encoding} messages)", kind)] = None
            return None
        try:
            what = message_type(kind, definition, language, encoding, self._distribution)
        except ImportError:
            raise
        except Exception as error:
            # A definition is a little program in the file; a broken one makes the parser fail in any way.
            self._unread[Name(topic, "(type not readable)", kind)] = None
            if self._request.choose([Name(topic, "", kind)]):
                self._unknown[topic] = f"{kind}: {str(error)[:120] or type(error).__name__}"
            return None
        names = {path: Name(topic, path, kind) for path in what.scalars}
        names |= {path: Name(topic, f"{path}[]", kind) for path, _ in what.arrays}
        names |= {path: Name(topic, f"{path}[]", kind) for path in what.sequences}
        chosen = self._request.choose(list(names.values()))
        self._unread |= dict.fromkeys(name for name in names.values() if name not in chosen)
        wanted = [path for path, name in names.items() if name in chosen]
        return _Topic(topic, what, wanted) if wanted else None


class _Topic:
    """One topic that is read: its type, and what came, in one table for every shape of its messages.

    Messages of one topic may differ in the lengths of their sequences, or in the names of their joints; those of one
    shape have the same columns.
    """

    def __init__(self, name: str, what: MessageType, wanted: Sequence[str]) -> None:
        self.name = name
        self.broken = 0
        self._what = what
        self._wanted = set(wanted)
        self._tables: dict[Any, _Table] = {}
        self._sequences = [path for path in what.sequences if path in self._wanted]
        self._only: _Table | None = None
        self._rows = 0

    @property
    def stamps(self) -> list[Stamps]:
        """When the messages came, and when they say that they were sent; one for each table."""
        return [table.stamps(self.name) for table in self._filled]

    @property
    def _filled(self) -> "list[_Table]":
        return [table for table in self._tables.values() if len(table.received)]

    def take(self, received: int, raw: bytes | memoryview) -> None:
        """Unpack one message; a broken one is counted."""
        try:
            message = self._what.unpack(raw)
            table = self._only or self._table(message)
            row = array("d", table.get(message))
        except Exception:
            # rosbags meets wrong bytes with struct.error, IndexError, MemoryError and others; all say the same.
            self.broken += 1
            return
        self._rows += 1
        table.received.append(received)  # first, for it refuses a stamp that is no whole number
        table.rows += row
        table.number.append(self._rows)

    def streams(self, times: Sequence[np.ndarray]) -> list[Stream]:
        """Make the streams, with the stamps [s] of each table."""
        parts: dict[str, list[tuple[np.ndarray, np.ndarray, np.ndarray, str]]] = {}
        for table, time in zip(self._filled, times, strict=True):
            steps = np.diff(time)
            # Messages overtake each other by a little; a clock that was set back is for the log's rules to refuse.
            overtaken = steps.size > 0 and -DISORDER < steps.min() < 0
            order = np.argsort(time, kind="stable") if overtaken else None
            row = np.frombuffer(table.number, np.int64)
            time, row = (time, row) if order is None else (time[order], row[order])
            for field, value in table.columns().items():
                value = value.copy() if order is None else value[order]
                parts.setdefault(field, []).append((time, value, row, table.frame(field)))
            table.rows = array("d")
        made = []
        for field, found in parts.items():
            time, value, row, frame = found[0]
            if len(found) > 1:
                time, value, row = (np.concatenate([part[k] for part in found]) for k in range(3))
                order = np.argsort(row, kind="stable")
                time, value, row = time[order], value[order], row[order]
            made.append(Stream(self.name, field, time, value, row, self._what.kind, frame))
        return made

    def _table(self, message: Any) -> "_Table":
        """The table that a message belongs to; a new one for a message of a new shape."""
        if not self._sequences:
            shape: Any = ()
        elif self._what.has_names:
            shape = (tuple(message.name), *(len(attrgetter(path)(message)) for path in self._sequences))
        else:
            shape = tuple(len(attrgetter(path)(message)) for path in self._sequences)
        if shape not in self._tables:
            if len(self._tables) >= _MOST_SHAPES:
                raise ValueError("messages of too many shapes")
            self._tables[shape] = _Table(message, self._what, self._wanted)
            if not self._sequences:
                self._only = self._tables[shape]
        return self._tables[shape]


class _Table:
    """The messages of one topic and shape, as rows of numbers."""

    def __init__(self, message: Any, what: MessageType, wanted: set[str]) -> None:
        self.rows = array("d")
        self.received = array("q")
        self.number = array("q")
        absent = _absent(message, what)
        self._scalars = [path for path in what.scalars if path in wanted and path.split(".")[0] not in absent]
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
        self._ahead = len(before) + (self._mask is not None)
        paths = (*before, *([status] if self._mask else []), *self._scalars)
        self.get = _getter(paths, arrays)
        self._width = self._ahead + len(self._fields)

    def stamps(self, name: str) -> Stamps:
        """Times of receipt, and of the header where there is one [ns]."""
        received = np.frombuffer(self.received, np.int64)
        if not self._stamped:
            return Stamps(received, None, name)
        table = self._matrix()
        return Stamps(received, table[:, 0].astype(np.int64) * 1_000_000_000 + table[:, 1].astype(np.int64), name)

    def columns(self) -> dict[str, np.ndarray]:
        """The values of each field."""
        table = self._matrix()
        found = {field: table[:, self._ahead + k] for k, field in enumerate(self._fields)}
        if self._mask is not None:
            bad, masked = self._mask
            fixed = table[:, self._ahead - 1] > bad
            found |= {field: np.where(fixed, found[field], np.nan) for field in masked if field in found}
        return found

    def frame(self, field: str) -> str:
        """The frame in which a field is given: that of the child for the twist of an odometry."""
        if "child_frame_id" in self._frames and not field.startswith(_POSE):
            return self._frames["child_frame_id"]
        return self._frames.get("frame_id", "")

    def _matrix(self) -> np.ndarray:
        return np.frombuffer(self.rows, float).reshape(-1, self._width)


def _absent(message: Any, what: MessageType) -> set[str]:
    """Parts of a message that the sender says it does not measure."""
    found = set()
    for covariance, part in _ABSENT.get(what.kind, {}).items():
        values = getattr(message, covariance, None)
        if values is not None and len(values) and values[0] == -1:
            found.add(part)
    return found


def _element_names(message: Any, what: MessageType, path: str) -> list[str]:
    count = len(attrgetter(path)(message))
    if count > _MOST_ELEMENTS:
        raise ValueError(f"{path} has {count} elements")
    if not what.has_names:
        return [f"{path}[{k}]" for k in range(count)]
    names = [str(name) for name in message.name]
    if count and len(names) != count:
        raise ValueError(f"{path} has {count} elements for {len(names)} names")
    twice = {name for name, times in Counter(names).items() if times > 1}
    return [f"{name}[{k}].{path}" if name in twice else f"{name}.{path}" for k, name in enumerate(names[:count])]


def _getter(paths: Sequence[str], arrays: Sequence[str]) -> Any:
    """A function that gives the numbers of a message in the order of the columns."""
    first = attrgetter(*paths) if paths else None
    one = len(paths) == 1
    if not arrays and first is not None and not one:
        return first
    rest = [attrgetter(path) for path in arrays]

    def get(message: Any) -> list[float]:
        row: list[float] = []
        if first is not None:
            found = first(message)
            row += [found] if one else found
        for part in rest:
            row.extend(part(message))
        return row

    return get
