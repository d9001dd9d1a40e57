"""JSON messages of an MCAP file: the numbers in them, by dotted names, whatever each message holds."""

import dataclasses
import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....physics.reading import Plain, parse_json
from ..base import DEEPEST, Name, Request, Stream
from .ros_clock import Stamps, overtaken
from .ros_types import LONGEST_DEFINITION, LONGEST_LIST, MOST_FIELDS, frame_of

_LARGEST = 16 * 2**20
"""Bytes of one message that is still unpacked; a list of nothing takes some twenty times its text in memory."""
_NUMBERS = frozenset({"number", "integer", "boolean"})
_SECONDS, _NANOSECONDS = ("sec", "secs"), ("nsec", "nanosec", "nsecs")
_STAMPED = ("header", "timestamp", "stamp")
"""Members of a message that may hold its stamp, `{sec, nsec}`, as ROS and Foxglove write it."""


@dataclass(slots=True)
class _Column:
    """One field: its values, and the messages that bear it."""

    field: str
    values: array = dataclasses.field(default_factory=lambda: array("d"))
    rows: array = dataclasses.field(default_factory=lambda: array("q"))


class JsonTopic:
    """One topic with JSON messages; which numbers it has, its messages tell.

    Messages of one topic may differ in what they hold: a field has a row for each message that bears it.

    Parameters
    ----------
    name, kind : of the topic and of its schema
    request : its `choose` is asked for every new field
    unread : takes the names of the fields that are not chosen
    """

    def __init__(self, name: str, kind: str, request: Request, unread: dict[Name, None]) -> None:
        self.name = name
        self.broken = 0
        self._kind = kind
        self._request = request
        self._unread = unread
        self._fields: dict[str, _Column | None] = {}
        self._received = array("q")
        self._header = array("q")
        self._frames: dict[str, str] | None = None

    @property
    def stamps(self) -> list[Stamps]:
        """When the messages came, and when they say that they were made; nothing where no field is wanted."""
        if not any(self._fields.values()):
            return []
        header = np.frombuffer(self._header, np.int64) if any(self._header) else None
        return [Stamps(np.frombuffer(self._received, np.int64), header, self.name)]

    def take(self, received: int, raw: bytes | memoryview) -> None:
        """Unpack one message; a broken one, or one of more than 16 MB, is counted."""
        try:
            if len(raw) > _LARGEST:
                raise ValueError("too large")
            message = parse_json(bytes(raw), lenient=True)
            message = message if isinstance(message, dict) else {"value": message}
            found: dict[str, float] = {}
            stamped = {key: message.pop(key) for key in _STAMPED if isinstance(message.get(key), dict)}
            _gather(message, "", 0, found)
            stamp = _stamp(stamped)
            self._header.append(stamp)
        except (ValueError, OverflowError):
            self.broken += 1
            return
        row = len(self._received)
        self._received.append(received)
        if self._frames is None:
            self._frames = _texts(message, stamped, ("frame_id", "child_frame_id"))
        if not found.keys() <= self._fields.keys():
            self._learn([field for field in found if field not in self._fields])
        for field, value in found.items():
            column = self._fields.get(field)
            if column is not None:
                column.values.append(value)
                column.rows.append(row)

    def streams(self, times: Sequence[np.ndarray]) -> list[Stream]:
        """Make the streams, with the stamps [s] of the messages."""
        (time,) = times
        made = []
        for column in self._fields.values():
            if column is None:
                continue
            value, row = np.frombuffer(column.values), np.frombuffer(column.rows, np.int64)
            # Fields that every message bears share one array of stamps.
            at = time if row.size == time.size else time[row]
            order = overtaken(at)
            if order is not None:
                at, value, row = at[order], value[order], row[order]
            frame = frame_of(column.field, self._frames or {})
            made.append(Stream(self.name, column.field, at, value, row + 1, self._kind, frame))
        return made

    def _learn(self, fields: Sequence[str]) -> None:
        """Ask which of new fields are wanted."""
        room = MOST_FIELDS - len(self._fields)
        if len(fields) > room:
            self._unread[Name(self.name, "(more fields)", self._kind)] = None
        # JSON may spell half a character, which no report could name.
        names = {
            field: Name(self.name, field.encode("utf-8", "replace").decode(), self._kind) for field in fields[:room]
        }
        chosen = self._request.choose(list(names.values()))
        for field, name in names.items():
            self._fields[field] = _Column(name.field) if name in chosen else None
            if name not in chosen:
                self._unread[name] = None


def json_topic(name: str, kind: str, definition: str, request: Request, unread: dict[Name, None]) -> JsonTopic | None:
    """Start to read a topic; None where its schema names all its numbers and none of them is wanted.

    Parameters
    ----------
    name, kind, request, unread : see `JsonTopic`
    definition : JSON Schema of the messages; empty for none
    """
    try:
        declared = list(_declared(parse_json(definition[:LONGEST_DEFINITION], lenient=True), "", 0))
    except (ValueError, TypeError):
        # No schema, or one that leaves open what there is: the messages tell.
        return JsonTopic(name, kind, request, unread)
    names = [Name(name, field, kind) for field in declared[:MOST_FIELDS]]
    if request.choose(names):
        return JsonTopic(name, kind, request, unread)
    unread |= dict.fromkeys(names)
    return None


def _gather(value: Any, path: str, depth: int, found: dict[str, float]) -> None:
    """Find the numbers of a value, by dotted path; null and what is not finite are no number, but have a name."""
    if isinstance(value, int | float):
        found[path] = float(value)
    elif value is None:
        found[path] = math.nan
    elif isinstance(value, dict) and depth < DEEPEST:
        for key, part in value.items():
            _gather(part, f"{path}.{key}" if path else key, depth + 1, found)
    elif isinstance(value, list) and depth < DEEPEST and len(value) <= LONGEST_LIST:
        for k, part in enumerate(value):
            _gather(part, f"{path}[{k}]", depth + 1, found)


def _stamp(stamped: Plain) -> int:
    """The stamp of a message [ns], 0 where it has none."""
    for member in (stamped.get("header", {}).get("stamp"), stamped.get("timestamp"), stamped.get("stamp")):
        if isinstance(member, dict):
            sec, nsec = (next((member[k] for k in keys if k in member), None) for keys in (_SECONDS, _NANOSECONDS))
            if isinstance(sec, int) and isinstance(nsec, int):
                return sec * 1_000_000_000 + nsec
    return 0


def _texts(message: Plain, stamped: Plain, keys: Sequence[str]) -> dict[str, str]:
    """Texts of a message or of its header."""
    among = {**stamped.get("header", {}), **message}
    return {key: among[key] for key in keys if isinstance(among.get(key), str)}


def _declared(schema: Any, path: str, depth: int) -> Iterator[str]:
    """Names of the numbers that a JSON Schema speaks of.

    Raises
    ------
    ValueError
        where it leaves open what there may be: a reference, an alternative, an object without properties.
    """
    kind = schema.get("type") if isinstance(schema, dict) else None
    kinds = set(kind if isinstance(kind, list) else [kind]) - {"null"}
    if kinds == {"object"} and isinstance(schema.get("properties"), dict) and depth < DEEPEST:
        if schema.get("additionalProperties") or schema.get("patternProperties"):
            raise ValueError("an open schema")
        for key, part in schema["properties"].items():
            if depth or key not in _STAMPED:
                yield from _declared(part, f"{path}.{key}" if path else key, depth + 1)
    elif kinds == {"array"} and "items" in schema:
        yield from _declared(schema["items"], f"{path}[]", depth + 1)
    elif kinds and kinds <= _NUMBERS:
        yield path
    elif kinds != {"string"}:
        raise ValueError("an open schema")
