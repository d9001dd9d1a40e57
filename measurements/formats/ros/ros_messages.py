"""Messages of a bag as streams: chosen topics unpacked, field by field, into plain arrays.

Messages in JSON, as MCAP files may have them, give the numbers in them by dotted names, whatever each message holds.
"""

import dataclasses
import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from operator import attrgetter
from typing import Any

import numpy as np

from ....physics.errors import LogError
from ....physics.reading import Plain, parse_json
from ..autopilots.mavlink import JsonTelemetry, MavlinkTopic
from ..base import DEEPEST, Name, Recording, Request, Stream
from ..unpacking import Allowance
from .ros_clock import CLOCK, ClockTopic, Stamps, agree, overtaken
from .ros_types import LONGEST_DEFINITION, LONGEST_LIST, MOST_FIELDS, MessageType, Table, frame_of, message_type

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


_MOST_SHAPES = 64
"""Shapes that the messages of a topic may have: each takes a table, and scans have a new one every time."""
_MOST_TOPICS = 10_000
"""Topics of a bag: one with everything in it has some hundred."""


class Collector:
    """Takes the messages of one bag, unpacks those that are chosen, and makes a `Recording` of them.

    Parameters
    ----------
    request : what is asked; its `choose` picks the fields
    distribution : ROS 2 distribution whose types are taken where the bag defines none
    mavlink : takes the JSON messages of a MAVLink server, which become no streams here; None to take them as any JSON
    """

    def __init__(self, request: Request, distribution: str = "", mavlink: JsonTelemetry | None = None) -> None:
        self._request = request
        self._distribution = distribution
        self._mavlink = mavlink
        self._topics: dict[tuple[str, str, str], _Taker | None] = {}
        self._by_id: dict[int, _Taker] = {}
        self._unread: dict[Name, None] = {}
        self._unknown: dict[str, str] = {}
        self._first: int | None = None
        self._allowance = Allowance(0)

    def new_file(self, packed: int) -> None:
        """Forget the connection numbers of the last file; topics go on. `packed` is the new one's size on disk."""
        self._by_id.clear()
        self._allowance = Allowance(packed)

    def connect(self, number: int, topic: str, kind: str, definition: str, language: str, encoding: str) -> bool:
        """Learn of a topic of the file, and tell whether its messages are wanted.

        Parameters
        ----------
        number : by which messages name it
        topic, kind : names of the topic and of its type
        definition, language : of the type, see `message_type`; a JSON Schema for json
        encoding : of the messages: ros1, cdr, json, or another, which is not read

        Raises
        ------
        LogError
            for more topics than any robot has.
        """
        key = (topic, kind, definition)
        if key not in self._topics:
            if len(self._topics) >= _MOST_TOPICS:
                raise LogError(f"expected at most {_MOST_TOPICS} topics, got more. Copy the log again, or cut it.")
            self._topics[key] = self._new(topic, kind, definition, language, encoding)
        found = self._topics[key]
        if found is None:
            self._by_id.pop(number, None)
            return False
        self._by_id[number] = found
        return True

    def unpacked(self, size: int) -> None:
        """Count the bytes that the file unpacks to; see `unpacking.check_unpacked`."""
        self._allowance.take(size)

    def message(self, number: int, received: int, raw: bytes | memoryview) -> None:
        """Take one message, received at a time [ns]; one that nobody wants is passed over."""
        topic = self._by_id.get(number)
        # Zero of the time is the first message of those that have no clock of their own.
        if not isinstance(topic, MavlinkTopic) and (self._first is None or received < self._first):
            self._first = received
        if topic is not None:
            self._allowance.count_message()
            topic.take(received, raw)

    def recording(self, notes: Sequence[str]) -> Recording:
        """Make streams of all that came; `notes` are those of the file.

        Raises
        ------
        LogError
            when messages of a chosen topic came, and not one of all could be unpacked.
        """
        topics = [topic for topic in self._topics.values() if isinstance(topic, _Topic | JsonTopic)]
        clocks = [topic.stamps for topic in self._topics.values() if isinstance(topic, ClockTopic)]
        broken = [f"{t.name}: {t.broken} broken messages left out" for t in topics if t.broken]
        taken = [topic for topic in topics if topic.stamps]
        if topics and not taken and broken:
            raise LogError(f"no message could be unpacked ({'; '.join(broken)}). Copy the log again.")
        stamps = [each for topic in taken for each in topic.stamps]
        times, first, clock, doubt = agree(stamps, self._first or 0, clocks)
        left = iter(times)
        streams = [one for topic in taken for one in topic.streams(list(islice(left, len(topic.stamps))))]
        unknown = [f"{topic}: left out, its type cannot be read ({why})" for topic, why in self._unknown.items()]
        return Recording(tuple(streams), (*notes, *clock, *broken, *unknown), tuple(self._unread), first, doubt)

    def _new(self, topic: str, kind: str, definition: str, language: str, encoding: str) -> "_Taker | None":
        if encoding == "json" and self._mavlink is not None and self._mavlink.knows(topic):
            return self._mavlink.connect(topic)
        if encoding == "json":
            return json_topic(topic, kind, definition, self._request, self._unread)
        if encoding not in ("ros1", "cdr"):
            self._unread[Name(topic, f"({encoding} messages)", kind)] = None
            return None
        try:
            what = message_type(kind, definition, language, encoding, self._distribution)
        except ImportError:
            raise
        except Exception as error:
            # A definition is a little program in the file; a broken one makes the parser fail in any way.
            return self._unreadable(topic, kind, error)
        if kind == CLOCK:
            return ClockTopic(topic, what.unpack)
        names = {path: Name(topic, path, kind) for path in what.scalars}
        names |= {path: Name(topic, f"{path}[]", kind) for path in what.lists}
        chosen = self._request.choose(list(names.values()))
        self._unread |= dict.fromkeys(name for name in names.values() if name not in chosen)
        wanted = [path for path, name in names.items() if name in chosen]
        if not wanted:
            return None
        try:
            what.compiled()
        except Exception as error:
            # The code that rosbags makes of a definition may fail as the definition itself.
            return self._unreadable(topic, kind, error)
        return _Topic(topic, what, wanted)

    def _unreadable(self, topic: str, kind: str, error: Exception) -> None:
        """Take note of a topic whose type cannot be read."""
        self._unread[Name(topic, "(type not readable)", kind)] = None
        self._unknown[topic] = f"{kind}: {str(error)[:120] or type(error).__name__}"


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
        self._tables: dict[Any, Table] = {}
        self._sequences = [path for path in what.sequences if path in self._wanted]
        self._only: Table | None = None
        self._rows = 0

    @property
    def stamps(self) -> list[Stamps]:
        """When the messages came, and when they say that they were sent; one for each table."""
        return [table.stamps(self.name) for table in self._filled]

    @property
    def _filled(self) -> list[Table]:
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
            order = overtaken(time)
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
                again = overtaken(time[order])
                order = order if again is None else order[again]
                time, value, row = time[order], value[order], row[order]
            made.append(Stream(self.name, field, time, value, row, self._what.kind, frame))
        return made

    def _table(self, message: Any) -> Table:
        """The table that a message belongs to; a new one for a message of a new shape."""
        names = tuple(message.name) if self._sequences and self._what.has_names else ()
        shape = names, *(len(attrgetter(path)(message)) for path in self._sequences)
        if shape not in self._tables:
            if len(self._tables) >= _MOST_SHAPES:
                raise ValueError("messages of too many shapes")
            self._tables[shape] = Table(message, self._what, self._wanted)
            if not self._sequences:
                self._only = self._tables[shape]
        return self._tables[shape]


_Taker = _Topic | JsonTopic | ClockTopic | MavlinkTopic
