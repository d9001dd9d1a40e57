"""MAVLink messages in a telemetry log: a receive time [us since 1970, big endian] before each one.

Messages are told and unpacked by the definitions of pymavlink (dialect ardupilotmega), and taken only when their
checksum holds. `telemetry` says what they mean.
"""

import mmap
import re
from array import array
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ....physics.motion import Array
from ..base import EVERY, Request, torn

_MARK = re.compile(rb"[\xfd\xfe]")
_PAYLOAD = {0xFE: 6, 0xFD: 10}
"""First byte of a message (MAVLink 1, MAVLink 2) -> where its payload begins."""
_SIGNED = 0x01
_SIGNATURE = 13
"""Flag of a message with a signature, and bytes of that (MAVLink 2, message signing)."""
_STAMP = 8
"""Bytes of the stamp that stands before each message of a telemetry log, microseconds since 1970."""
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


class Messages(Protocol):
    """What a reader of MAVLink offers, of a telemetry log or of JSON."""

    notes: list[str]

    def messages(self) -> tuple[Key, ...]:
        """System, component and number of all messages that there are."""
        ...

    def definition(self, number: int) -> Definition:
        """How the message `number` is laid out."""
        ...

    def rows(self, key: Key) -> tuple[Any, Array]:
        """Unpack the messages of a key: their bodies, and when they were received [s]."""
        ...


def known_messages() -> dict[int, Any]:
    """The messages that pymavlink knows, by number."""
    from pymavlink.dialects.v20 import ardupilotmega

    return ardupilotmega.mavlink_map


@cache
def definition_of(number: int) -> Definition:
    """How the message `number` is laid out."""
    message = known_messages()[number]
    parts = re.findall(r"(\d*)([a-zA-Z])", message.unpacker.format.lstrip("<"))
    types = []
    for field, (count, code) in zip(_expanded(message), _spread(parts), strict=True):
        types.append((field, f"S{count}" if code == "s" else f"<{code}"))
    fields = tuple(field for field, _ in types)
    return Definition(message.msgname, fields, np.dtype(types), message.crc_extra)


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
        self._offsets: dict[Key, array] = {}
        self._rows: dict[Key, tuple[Any, Array]] = {}
        self.notes: list[str] = []
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            self._scan(content, request)

    def messages(self) -> tuple[Key, ...]:
        """System, component and number of all messages that there are."""
        return tuple(self._offsets)

    def definition(self, number: int) -> Definition:
        """How the message `number` is laid out."""
        return definition_of(number)

    def rows(self, key: Key) -> tuple[Any, Array]:
        """Unpack the messages of a key whose checksum holds: their bodies, and when they were received [s]."""
        if key not in self._rows:
            self._rows[key] = self._unpacked(key)
        return self._rows[key]

    def _unpacked(self, key: Key) -> tuple[Any, Array]:
        from pymavlink.generator.mavcrc import x25crc

        told = self.definition(key[2])
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
                    offsets = self._offsets.get(key)
                    if offsets is None:
                        offsets = self._offsets[key] = array("Q")
                    offsets.append(at)
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


def _expanded(message: Any) -> list[str]:
    """Fields in the order of the wire, a number each; text as one."""
    names = []
    for field in message.ordered_fieldnames:
        place = message.fieldnames.index(field)
        length = message.array_lengths[message.ordered_fieldnames.index(field)]
        text = message.fieldtypes[place] == "char"
        names += [f"{field}[{k}]" for k in range(length)] if length and not text else [field]
    return names


def _spread(parts: list[tuple[str, str]]) -> list[tuple[int, str]]:
    """Codes of a struct format one by one; text keeps its length."""
    spread = []
    for count, code in parts:
        times = int(count or 1)
        spread += [(times, "s")] if code in "sc" else [(1, code)] * times
    return spread
