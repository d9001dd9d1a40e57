"""Message types of ROS: the numbers a message holds, and the messages of one topic as a table."""

from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain
from operator import attrgetter
from typing import Any

import numpy as np

from ..base import DEEPEST
from .ros_clock import Stamps

MOST_FIELDS = 400
"""Numbers of one message that are read: the state of an autopilot has some hundred."""
LONGEST_DEFINITION = 2**20
"""Characters of a definition or a schema: the longest of ROS have some ten thousand."""
_LONGEST_ARRAY = 32
"""Numbers of an array of fixed length that are read: the outputs of an autopilot, not a covariance, which has 36."""
_MOST_ELEMENTS = 10_000
"""Fields and elements of a whole message, nested ones multiplied: more is made to fill memory, or no measurement."""
_LONGEST_SEQUENCE = 100_000
"""Numbers in one sequence that is still unpacked; a longer one is an image, or a broken length."""
_NOT_NUMBERS = ("string", "wstring", "wchar")
_FORMS = ("number", "array", "sequence")
"""What a message holds: a number, or several, of fixed length or not."""
_STAMPS = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_HEADER = "std_msgs/msg/Header"


@dataclass(frozen=True, slots=True)
class MessageType:
    """One message type as a bag defines it.

    Attributes
    ----------
    kind : such as `nav_msgs/msg/Odometry`
    scalars : dotted paths of all single numbers
    lists : dotted paths of the arrays of numbers of fixed length, and of the sequences
    sequences : the latter alone
    texts : fields of the message itself that are a text (a frame)
    has_names : whether the sequences belong to the names in a sequence `name` (JointState)
    has_header : whether its first field is a header with a stamp
    compiled : makes the code that unpacks, once; it takes 0.1 s, so only what is wanted is compiled
    unpack : message of the raw bytes
    """

    kind: str
    scalars: tuple[str, ...]
    lists: tuple[str, ...]
    sequences: tuple[str, ...]
    texts: tuple[str, ...]
    has_names: bool
    has_header: bool
    compiled: Callable[[], object]
    unpack: Callable[[bytes | memoryview], Any]


def message_type(kind: str, definition: str, language: str, encoding: str, distribution: str = "") -> MessageType:
    """Learn a message type from its definition in the bag, or from the standard types where the bag has none.

    Parameters
    ----------
    kind : name of the type
    definition : text of the definition, empty for none
    language : of the definition, "msg" or "idl"
    encoding : of the messages, "ros1" or "cdr"
    distribution : name of the ROS 2 distribution whose standard types are taken for want of a definition

    Raises
    ------
    Exception
        whatever rosbags raises for a definition that it cannot read; KeyError for an unknown type; ValueError for one
        that is too long, or of too many elements.
    """
    if len(definition) > LONGEST_DEFINITION:
        raise ValueError(f"a definition of {len(definition)} characters")
    store = _store(kind, definition, language, encoding, distribution)
    fields = store.fielddefs[kind][1]
    _elements(store, kind, {})
    leaves = list(_leaves(store, kind, "", 0))
    scalars, arrays, sequences = (tuple(path for path, of in leaves if of == form) for form in _FORMS)
    unpack = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
    texts = tuple(name for name, (_, what) in fields if isinstance(what, tuple) and what[0] == "string")
    has_names = any(name == "name" and _is_list_of_texts(what) for name, (_, what) in fields)
    has_header = bool(fields) and fields[0] == ("header", (2, _HEADER))
    code = partial(store.get_msgdef, kind), lambda raw: unpack(raw, kind)
    return MessageType(kind, scalars, arrays + sequences, sequences, texts, has_names, has_header, *code)


def _is_list_of_texts(what: Any) -> bool:
    return isinstance(what, tuple) and isinstance(what[0], tuple) and what[0][1][0] == "string"


@lru_cache(maxsize=128)
def _store(kind: str, definition: str, language: str, encoding: str, distribution: str) -> Any:
    """The types by which messages of one definition are unpacked; kept with their code from log to log."""
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if not definition:
        named = {store.value: store for store in Stores}
        standard = Stores.ROS1_NOETIC if encoding == "ros1" else named.get(f"ros2_{distribution}", Stores.LATEST)
        return get_typestore(standard)
    store = get_typestore(Stores.EMPTY)
    store.max_sequence_length = _LONGEST_SEQUENCE
    if language == "idl":
        types = {}
        bar = "=" * 80 + "\n"
        # A bundle of IDL files: after each bar a line "IDL: name", then the file.
        parts = [part.split("\n", 1)[1] for part in definition.split(bar)[1:]] if bar in definition else [definition]
        for part in parts:
            types.update(get_types_from_idl(part))
    else:
        types = get_types_from_msg(definition, kind)
    store.register(types)
    return store


def _elements(store: Any, kind: str, known: dict[str, int]) -> int:
    """Count the objects that one message of a type is made of at the least: arrays in arrays multiply.

    An array of numbers counts as one, for its bytes must be in the message; a text, or a type without a field, may take
    none. A sequence counts as one element of it.

    Raises
    ------
    ValueError
        for more than `_MOST_ELEMENTS`, or a type that holds itself.
    """
    from rosbags.interfaces import Nodetype

    if known.get(kind) == 0:
        raise ValueError(f"{kind} holds itself")
    if kind not in known:
        known[kind] = 0
        total = 1
        for _, (node, what) in store.fielddefs[kind][1]:
            inner, count = (node, what), 1
            if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                inner, length = what
                numbers = inner[0] == Nodetype.BASE and inner[1][0] not in _NOT_NUMBERS
                count = length if node == Nodetype.ARRAY and not numbers else 1
            total += count * (_elements(store, inner[1], known) if inner[0] == Nodetype.NAME else 1)
            if total > _MOST_ELEMENTS:
                raise ValueError(f"{kind} has more than {_MOST_ELEMENTS} elements")
        known[kind] = total
    return known[kind]


def _leaves(store: Any, kind: str, prefix: str, depth: int) -> Iterator[tuple[str, str]]:
    """Paths of the numbers in a type, each with the one of `_FORMS` that it has."""
    from rosbags.interfaces import Nodetype
    from rosbags.typesys.base import normalize_fieldname

    if depth > DEEPEST or kind in _STAMPS or kind == _HEADER:
        return
    found = 0
    for raw, (node, what) in store.fielddefs[kind][1]:
        path = prefix + normalize_fieldname(raw)
        if node == Nodetype.NAME:
            part = _leaves(store, what, f"{path}.", depth + 1)
        elif node == Nodetype.BASE:
            part = iter([(path, "number")] if what[0] not in _NOT_NUMBERS else [])
        else:
            (inner, of), length = what
            numbers = inner == Nodetype.BASE and of[0] not in _NOT_NUMBERS and "covariance" not in path
            whole = node == Nodetype.SEQUENCE
            keep = numbers and (whole or 0 < length <= _LONGEST_ARRAY)
            part = iter([(path, "sequence" if whole else "array")] if keep else [])
        for leaf in part:
            found += 1
            if found > MOST_FIELDS:
                return
            yield leaf


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
        lists = [path for path in what.lists if path in wanted]
        self._fields = list(self._scalars)
        for path in lists:
            self._fields += _element_names(message, what, path)
        self._frames = {text: str(getattr(message, text)) for text in what.texts}
        if what.has_header:
            self._frames["frame_id"] = str(message.header.frame_id)
        before = ["header.stamp.sec", "header.stamp.nanosec"] if what.has_header else []
        self._stamped = what.has_header
        self._ahead = len(self._absent) + len(before) + (self._mask is not None)
        paths = (*before, *([status] if self._mask else []), *self._scalars)
        self.get = _getter(paths, lists, tuple(self._absent))
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
        result = {field: table[:, self._ahead + k] for k, field in enumerate(self._fields)}
        if self._mask is not None:
            bad, masked = self._mask
            fixed = table[:, self._ahead - 1] > bad
            result |= {field: np.where(fixed, result[field], np.nan) for field in masked if field in result}
        for k, part in enumerate(self._absent.values()):
            known = table[:, k] != -1.0
            if not known.all():
                result |= {f: np.where(known, result[f], np.nan) for f in self._scalars if f.startswith(part)}
        return result

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
    few = [attrgetter(path) for path in paths]
    single = attrgetter(*paths) if len(paths) > 1 else lambda message: [part(message) for part in few]
    if not arrays and not marks:
        return single
    opening, rest = ([attrgetter(path) for path in part] for part in (marks, arrays))
    return lambda message: [
        *(part(message)[0] for part in opening),
        *single(message),
        *chain.from_iterable(part(message) for part in rest),
    ]
