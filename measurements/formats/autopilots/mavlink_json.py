"""MAVLink messages as JSON in an MCAP file: what BlueOS records by itself of every run.

Its recorder writes what its MAVLink server publishes: a topic `mavlink/SYSTEM/COMPONENT/NAME` for each message, as
`{"header": {...}, "message": {"type": NAME, ...}}`. Members of an enumeration are `{"type": "MAV_TYPE_SURFACE_BOAT"}`,
flags `{"bits": 129}` or their names between bars, texts a text or a list of letters, and a field called `type` is
`mavtype`. The same messages stand under `mavlink/out`, and single fields under longer topics: both are passed over.
"""

import json
import re
from array import array
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from ....physics.motion import Array
from ..base import Request
from .autopilot import raw_names
from .mavlink import MOTION, NEEDED, Definition, Key, definition_of, known_messages

_TOPIC = re.compile(r"mavlink/(\d{1,3})/(\d{1,3})/([A-Z][A-Z0-9_]*)")
_ANY = re.compile(r"mavlink(_raw)?/.*")
_LARGEST = 1 << 16
"""Bytes of a message: the longest of MAVLink, 255 numbers with all their digits, has some 5,000."""
_LETTERS = re.compile(r"[\0\ufffd].*", re.DOTALL)


class _Rows:
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
            del self.numbers[len(self.received) * self.width :]
            self.broken += 1
            return
        self.received.append(received)
        if text is not None:
            self.texts.append(text)

    @property
    def width(self) -> int:
        """Numbers of a row."""
        return sum(length or 1 for _, length in self._plan)

    def unpacked(self) -> tuple[Any, Array]:
        """The bodies as on the wire, and when they were received [s]."""
        body = np.zeros(len(self.received), self.told.body)
        matrix = np.frombuffer(self.numbers, float).reshape(len(self.received), self.width)
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
    """The MAVLink messages of one recording of BlueOS; offers what `mavlink.Telemetry` does.

    Parameters
    ----------
    request : its `choose` picks the messages that are unpacked beside those that become channels
    """

    def __init__(self, request: Request) -> None:
        self._request = request
        self._keys: dict[str, Key | None] = {}
        self._rows: dict[Key, _Rows] = {}
        self._takers: dict[int, _Rows] = {}
        self.notes: list[str] = []

    @staticmethod
    def knows(topic: str) -> bool:
        """True when a topic with JSON messages is one of the MAVLink server's."""
        return _ANY.fullmatch(topic) is not None

    def connect(self, number: int, topic: str) -> bool:
        """Learn of a topic, and tell whether its messages are wanted."""
        self._takers.pop(number, None)
        key = self._key(topic)
        if key is None:
            return False
        name, system = definition_of(key[2]).name, f"sys{key[0]}/"
        offered = [
            each
            for before in ("", system, f"{system}comp{key[1]}/")
            for each in raw_names(f"{before}{name}", f"mavlink/{name}", definition_of(key[2]).fields)
        ]
        if key not in self._rows:
            self._rows[key] = _Rows(key)
        if name not in NEEDED and not self._request.choose(offered):
            return False
        self._takers[number] = self._rows[key]
        return True

    def take(self, number: int) -> Callable[[int, bytes | memoryview], None] | None:
        """What takes the messages of a topic; None for one that is not wanted."""
        found = self._takers.get(number)
        return None if found is None else found.take

    def messages(self) -> tuple[Key, ...]:
        """System, component and number of all messages that there are."""
        return tuple(self._rows)

    @property
    def moves(self) -> bool:
        """True when there are messages that only a vehicle sends, of its motion."""
        return any(self.definition(key[2]).name in MOTION for key in self._rows)

    def definition(self, number: int) -> Definition:
        """How the message `number` is laid out."""
        return definition_of(number)

    def rows(self, key: Key) -> tuple[Any, Array]:
        """Bodies of the messages of a key, and when they were received [s]."""
        found = self._rows.get(key) or _Rows(key)
        if found.broken:
            self.notes.append(f"{found.told.name}: {found.broken} messages that are no JSON of MAVLink left out")
            found.broken = 0
        return found.unpacked()

    def _key(self, topic: str) -> Key | None:
        if topic not in self._keys:
            match = _TOPIC.fullmatch(topic)
            number = None if match is None else _numbers_by_name().get(match[3])
            small = match is not None and max(int(match[1]), int(match[2])) < 256
            self._keys[topic] = (
                (int(match[1]), int(match[2]), number) if match and small and number is not None else None
            )
        return self._keys[topic]


@cache
def _numbers_by_name() -> dict[str, int]:
    return {message.msgname: number for number, message in known_messages().items()}


@cache
def _members() -> dict[str, int]:
    """The members of all enumerations, by name."""
    from pymavlink.dialects.v20 import ardupilotmega

    return {entry.name: value for kind in ardupilotmega.enums.values() for value, entry in kind.items()}


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
