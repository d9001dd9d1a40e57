"""MAVLink messages, of a telemetry log or as JSON in an MCAP file; `telemetry` says what they mean.

A telemetry log has a receive time [us since 1970, big endian] before each message. Messages are told and unpacked by
the definitions of pymavlink (dialect ardupilotmega), and taken only when their checksum holds.

JSON is what BlueOS records by itself of every run: a topic `mavlink/SYSTEM/COMPONENT/NAME` for each message that its
MAVLink server publishes, as `{"header": {...}, "message": {"type": NAME, ...}}`. Members of an enumeration are
`{"type": "MAV_TYPE_SURFACE_BOAT"}`, flags `{"bits": 129}` or their names between bars, texts a text or a list of
letters, and a field called `type` is `mavtype`. The same messages stand under `mavlink/out`, and single fields under
longer topics: both are passed over.
"""

import json
import mmap
import re
from array import array
from collections import defaultdict
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ....physics.motion import Array
from ..base import EVERY, Request, torn
from .autopilot import raw_names

_MARK = re.compile(rb"[\xfd\xfe]")
_PAYLOAD = {0xFE: 6, 0xFD: 10}
"""First byte of a message (MAVLink 1, MAVLink 2) -> where its payload begins."""
_SIGNED = 0x01
_SIGNATURE = 13
"""Flag of a message with a signature, and bytes of that (MAVLink 2, message signing)."""
_STAMP = 8
"""Bytes of the stamp that stands before each message of a telemetry log, microseconds since 1970."""
_KINDS = {"char": "S", "float": "f4", "double": "f8"}
"""What numpy calls those kinds of fields that it calls otherwise than MAVLink does."""
Key = tuple[int, int, int]
"""System, component and number of a message."""
MOTION = ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")
"""Messages that only a vehicle sends."""
NEEDED = frozenset(
    {*MOTION, "GPS_RAW_INT", "RAW_IMU", "SCALED_IMU", "SCALED_IMU2"}
    | {"SERVO_OUTPUT_RAW", "PARAM_VALUE", "HEARTBEAT", "STATUSTEXT", "BATTERY_STATUS", "SYS_STATUS", "MISSION_CURRENT"}
    | {"RPM", "ESC_TELEMETRY_1_TO_4", "ESC_STATUS"}
)
"""Messages of which `telemetry` makes channels."""


@dataclass(frozen=True, slots=True)
class Definition:
    """How pymavlink's definitions lay out one message: its fields on the wire, and the seed of its checksum."""

    name: str
    fields: tuple[str, ...]
    body: np.dtype
    seed: int


def _dialect() -> Any:
    """The module of the dialect; by name, since its 30,000 lines would be a tenth of what pyright reads."""
    return import_module("pymavlink.dialects.v20.ardupilotmega")


def known_messages() -> dict[int, Any]:
    """The messages that pymavlink knows, by number."""
    return _dialect().mavlink_map


@cache
def definition_of(number: int) -> Definition:
    """How the message `number` is laid out."""
    message = known_messages()[number]
    kinds = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    types = []
    for field, length in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
        kind = _KINDS.get(kinds[field]) or kinds[field].removesuffix("_t")
        if kind == "S":
            types.append((field, f"S{max(length, 1)}"))
        else:
            code = np.dtype(kind).newbyteorder("<")
            types += [(f"{field}[{k}]", code) for k in range(length)] if length else [(field, code)]
    return Definition(message.msgname, tuple(field for field, _ in types), np.dtype(types), message.crc_extra)


class Telemetry:
    """The messages of a telemetry log, found but not yet unpacked.

    Parameters
    ----------
    path : the file
    request : told of the progress
    """

    def __init__(self, path: Path, request: Request) -> None:
        self._known = known_messages()
        self._path = path
        self._offsets: dict[Key, array] = defaultdict(lambda: array("Q"))
        self._rows: dict[Key, tuple[Any, Array]] = {}
        self.notes: list[str] = []
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            self._scan(content, request)

    def messages(self) -> tuple[Key, ...]:
        """System, component and number of all messages that there are."""
        return tuple(self._offsets)

    def rows(self, key: Key) -> tuple[Any, Array]:
        """Unpack the messages of a key whose checksum holds: their bodies, and when they were received [s]."""
        if key not in self._rows:
            self._rows[key] = self._unpacked(key)
        return self._rows[key]

    def _unpacked(self, key: Key) -> tuple[Any, Array]:
        from pymavlink.generator.mavcrc import x25crc

        told = definition_of(key[2])
        size, seed = told.body.itemsize, bytes([told.seed])
        bodies, stamps = bytearray(), array("Q")
        with self._path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            for at in self._offsets.get(key, ()):
                start = at + _STAMP
                length, begin = content[start + 1], start + _PAYLOAD[content[start]]
                end = begin + length
                if length > size or x25crc(content[start + 1 : end] + seed).crc != content[end] | content[end + 1] << 8:
                    continue
                bodies += content[begin:end].ljust(size, b"\0")
                stamps.append(int.from_bytes(content[at:start], "big"))
        lost = len(self._offsets.get(key, ())) - len(stamps)
        if lost:
            self.notes.append(f"{told.name}: {lost} messages with a wrong checksum left out")
        return np.frombuffer(bytes(bodies), told.body), np.frombuffer(stamps, np.uint64).astype(float) / 1e6

    def _scan(self, content: mmap.mmap, request: Request) -> None:
        size, at, told, lost, places = len(content), 0, 0, 0, 0
        while at < size:
            found = message_at(content, at)
            if found is not None:
                length, key = found
                if key[2] in self._known:
                    self._offsets[key].append(at)
                at += length
                if at - told > EVERY:
                    told = at
                    request.progress(at, size)
                continue
            after = self._next(content, at + 1)
            if after < size:
                lost, places = lost + after - at, places + 1
            else:
                self.notes.append(torn(at, size, "what follows is no whole message"))
            at = after
        request.progress(size, size)
        if places:
            self.notes.append(f"{lost} bytes at {places} places are no message; they were skipped")

    def _next(self, content: mmap.mmap, at: int) -> int:
        """Find the next known message that another one, or the end, follows; the size where there is none."""
        for mark in _MARK.finditer(content, at + _STAMP):
            found = message_at(content, mark.start() - _STAMP)
            if found is not None and found[1][2] in self._known:
                after = mark.start() - _STAMP + found[0]
                if after == len(content) or message_at(content, after) is not None:
                    return mark.start() - _STAMP
        return len(content)


def message_at(content: bytes | mmap.mmap, at: int) -> tuple[int, Key] | None:
    """Length with the stamp, and key, of the message at a place; None where there is no whole one."""
    start = at + _STAMP
    if start + 8 > len(content):
        return None
    mark = content[start]
    if mark == 0xFE:
        length = _STAMP + content[start + 1] + 8
        key = content[start + 3], content[start + 4], content[start + 5]
    elif mark == 0xFD and start + 10 <= len(content):
        length = _STAMP + content[start + 1] + 12 + (_SIGNATURE if content[start + 2] & _SIGNED else 0)
        number = content[start + 7] | content[start + 8] << 8 | content[start + 9] << 16
        key = content[start + 5], content[start + 6], number
    else:
        return None
    return (length, key) if at + length <= len(content) else None


_TOPIC = re.compile(r"mavlink/(\d{1,3})/(\d{1,3})/([A-Z][A-Z0-9_]*)")
_ANY = re.compile(r"mavlink(_raw)?/.*")
_LARGEST = 1 << 16
"""Bytes of a message: the longest of MAVLink, 255 numbers with all their digits, has some 5,000."""
_LETTERS = re.compile(r"[\0\ufffd].*", re.DOTALL)


class MavlinkTopic:
    """The messages of one key as they come: a row of numbers each, texts beside them."""

    def __init__(self, key: Key) -> None:
        self.key, self.told = key, definition_of(key[2])
        self.received, self.numbers = array("q"), array("d")
        self.texts: list[bytes] = []
        self.broken = 0
        names = known_messages()[key[2]]
        text = {field for field in self.told.fields if self.told.body[field].kind == "S"}
        lengths = dict(zip(names.ordered_fieldnames, names.array_lengths, strict=True))
        self._text = next(iter(text), None)
        self._plan = [
            ("mavtype" if field == "type" else field, lengths[field])
            for field in names.ordered_fieldnames
            if field not in text
        ]
        self._width = sum(length or 1 for _, length in self._plan)

    def take(self, received: int, raw: bytes | memoryview) -> None:
        """Unpack a message; a broken one is counted."""
        try:
            if len(raw) > _LARGEST:
                raise ValueError("too large")
            message = json.loads(bytes(raw))["message"]
            row: list[float] = []
            for field, length in self._plan:
                if not length:
                    value = message.get(field, 0)
                    row.append(value if type(value) in (float, int) else _number(value))
                else:
                    values = message.get(field) or []
                    row += [_number(each) for each in [*values, *[0] * length][:length]]
            text = None if self._text is None else _letters(message.get(self._text, ""))
            self.numbers.extend(row)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError):
            del self.numbers[len(self.received) * self._width :]
            self.broken += 1
            return
        self.received.append(received)
        if text is not None:
            self.texts.append(text)

    def unpacked(self) -> tuple[Any, Array]:
        """The bodies as on the wire, and when they were received [s]."""
        body = np.zeros(len(self.received), self.told.body)
        matrix = np.frombuffer(self.numbers, float).reshape(len(self.received), self._width)
        fields = [field for field in self.told.fields if field != self._text]
        for k, field in enumerate(fields):
            kind = self.told.body[field]
            if kind.kind == "f":
                with np.errstate(over="ignore"):
                    body[field] = matrix[:, k]
            else:
                ends = np.iinfo(kind)
                body[field] = np.nan_to_num(matrix[:, k]).clip(ends.min, ends.max).astype(np.int64).astype(kind)
        if self._text is not None:
            body[self._text] = self.texts
        return body, np.frombuffer(self.received, np.int64) / 1e9


class JsonTelemetry:
    """The MAVLink messages of one recording of BlueOS; offers what `Telemetry` does.

    Parameters
    ----------
    request : its `choose` picks the messages that are unpacked beside those that become channels
    """

    def __init__(self, request: Request) -> None:
        self._request = request
        self._rows: dict[Key, MavlinkTopic] = {}
        self.notes: list[str] = []

    @staticmethod
    def knows(topic: str) -> bool:
        """True when a topic with JSON messages is one of the MAVLink server's."""
        return _ANY.fullmatch(topic) is not None

    def connect(self, topic: str) -> MavlinkTopic | None:
        """Learn of a topic; what takes its messages, None where they are not wanted."""
        key = _key(topic)
        if key is None:
            return None
        told, system = definition_of(key[2]), f"sys{key[0]}/"
        offered = [
            each
            for before in ("", system, f"{system}comp{key[1]}/")
            for each in raw_names(f"{before}{told.name}", f"mavlink/{told.name}", told.fields)
        ]
        if key not in self._rows:
            self._rows[key] = MavlinkTopic(key)
        return self._rows[key] if told.name in NEEDED or self._request.choose(offered) else None

    def messages(self) -> tuple[Key, ...]:
        """System, component and number of all messages that there are."""
        return tuple(self._rows)

    @property
    def moves(self) -> bool:
        """True when there are messages that only a vehicle sends, of its motion."""
        return any(definition_of(key[2]).name in MOTION for key in self._rows)

    def rows(self, key: Key) -> tuple[Any, Array]:
        """Bodies of the messages of a key, and when they were received [s]."""
        found = self._rows.get(key) or MavlinkTopic(key)
        if found.broken:
            self.notes.append(f"{found.told.name}: {found.broken} messages that are no JSON of MAVLink left out")
            found.broken = 0
        return found.unpacked()


def _key(topic: str) -> Key | None:
    """The key of the messages of a topic; None for one of single fields, or of a message that is not known."""
    match = _TOPIC.fullmatch(topic)
    if match is None or max(int(match[1]), int(match[2])) > 255 or match[3] not in _numbers_by_name():
        return None
    return int(match[1]), int(match[2]), _numbers_by_name()[match[3]]


@cache
def _numbers_by_name() -> dict[str, int]:
    return {message.msgname: number for number, message in known_messages().items()}


@cache
def _members() -> dict[str, int]:
    """The members of all enumerations, by name."""
    return {entry.name: value for kind in _dialect().enums.values() for value, entry in kind.items()}


def _number(value: Any) -> float:
    """A number of a message: as it stands, of an enumeration by its name, or of flags.

    Raises
    ------
    ValueError
        for what is none of these.
    """
    if value is None:
        return float("nan")
    if isinstance(value, dict):
        value = value["bits"] if "bits" in value else value["type"]
    if isinstance(value, str):
        names = [name.strip() for name in value.split("|") if name.strip()]
        return float(sum(_members()[name] for name in names))
    return float(value)


def _letters(value: Any) -> bytes:
    """A text, or the list of its letters or of their codes, up to its end."""
    if isinstance(value, list):
        value = "".join(chr(each) if isinstance(each, int) else str(each) for each in value[:256])
    return _LETTERS.sub("", str(value)).encode("latin-1", "replace")


Messages = Telemetry | JsonTelemetry
"""Readers of MAVLink messages."""
