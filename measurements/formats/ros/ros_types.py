"""Message types of ROS: which numbers a message holds, by its definition, and how they are unpacked (rosbags)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ..base import DEEPEST

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
_STAMPS = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_HEADER = "std_msgs/msg/Header"


@dataclass(frozen=True, slots=True)
class MessageType:
    """One message type as a bag defines it.

    Attributes
    ----------
    kind : such as `nav_msgs/msg/Odometry`
    scalars : dotted paths of all single numbers
    arrays : dotted paths and lengths of the arrays of numbers of fixed length
    sequences : dotted paths of the sequences of numbers
    texts : fields of the message itself that are a text (a frame)
    has_names : whether the sequences belong to the names in a sequence `name` (JointState)
    has_header : whether its first field is a header with a stamp
    compiled : makes the code that unpacks, once; it takes 0.1 s, so only what is wanted is compiled
    unpack : message of the raw bytes
    """

    kind: str
    scalars: tuple[str, ...]
    arrays: tuple[tuple[str, int], ...]
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
    unpack = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
    return MessageType(
        kind,
        tuple(path for path, length in leaves if length is None),
        tuple((path, length) for path, length in leaves if length),
        tuple(path for path, length in leaves if length == 0),
        tuple(name for name, (_, what) in fields if isinstance(what, tuple) and what[0] == "string"),
        any(name == "name" and _is_list_of_texts(what) for name, (_, what) in fields),
        bool(fields) and fields[0] == ("header", (2, _HEADER)),
        lambda: store.get_msgdef(kind),
        lambda raw: unpack(raw, kind),
    )


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


def _leaves(store: Any, kind: str, prefix: str, depth: int) -> Iterator[tuple[str, int | None]]:
    """Paths of the numbers in a type; with None for a single one, a length for an array, 0 for a sequence."""
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
            part = iter([(path, None)] if what[0] not in _NOT_NUMBERS else [])
        else:
            (inner, of), length = what
            numbers = inner == Nodetype.BASE and of[0] not in _NOT_NUMBERS and "covariance" not in path
            whole = node == Nodetype.SEQUENCE
            keep = numbers and (whole or 0 < length <= _LONGEST_ARRAY)
            part = iter([(path, 0 if whole else length)] if keep else [])
        for leaf in part:
            found += 1
            if found > MOST_FIELDS:
                return
            yield leaf
