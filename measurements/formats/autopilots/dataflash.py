"""ArduPilot DataFlash logs (`.bin`): where the messages lie, and their columns; `ardupilot` says what they mean.

The layout of every message is told by FMT messages in the log itself, a character a field. pymavlink's index is not
used: it ends the whole process at the first byte that is no message (`panic` in its dfindexer.c), and a log that breaks
off or is damaged must be read up to there.
"""

import mmap
import struct
from array import array
from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ....physics.motion import Array
from ..base import EVERY, Format, Head, Recording, Request, begins_with, torn
from . import ardupilot
from .autopilot import numbers

_MARK = b"\xa3\x95"
_FMT = 128
"""Type of the message that tells the layout of another (ArduPilot, LogStructure.h)."""
_FMT_BODY = struct.Struct("<BB4s16s64s")
_FMT_LENGTH = 3 + _FMT_BODY.size
"""With two bytes of mark and one of type."""
_NUMBERS = dict(zip("bBhHiIqQgfdMcCeEL", "bBhHiIqQefdbhHiIi", strict=True))
"""How Python's `struct` names the kind of number that a character of FMT stands for (ArduPilot, LogStructure.h)."""
_TEXTS = {"n": 4, "N": 16, "Z": 64, "a": 64}
"""Bytes of those that stand for texts; `a` is an array of 32 short numbers, which no channel is made of."""
_DIVISORS = {"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7}
"""What the number is divided by, for characters of numbers with decimals."""
_SENSOR = "#"
"""Unit, in FMTU, of the field that says which sensor or which filter a message is of."""
_PAGE = 528
"""A log may end in so many equal bytes, the rest of its last page; they are no break."""
_PART = 1 << 14
"""Messages that are unpacked together; of a rare type they may lie on a page of the file each."""


@dataclass(frozen=True, slots=True)
class Layout:
    """How one type of message lies in the file.

    Attributes
    ----------
    name : of the type
    length : with its header of three bytes
    fields : their names
    body : what follows the header, a field each
    divisors : what each field is divided by, one where it is taken as it is
    """

    name: str
    length: int
    fields: tuple[str, ...]
    body: np.dtype
    divisors: dict[str, float]

    @property
    def numeric(self) -> tuple[str, ...]:
        """Those of the fields that are numbers."""
        return tuple(field for field in self.fields if self.body[field].kind != "S")


class DataFlash(ardupilot.Messages):
    """The messages of a DataFlash file, found but not yet unpacked.

    Parameters
    ----------
    path : the file
    request : told of the progress
    """

    def __init__(self, path: Path, request: Request) -> None:
        self._layouts: dict[int, Layout] = {}
        self._offsets: dict[int, array] = defaultdict(lambda: array("q"))
        self.notes: list[str] = []
        with path.open("rb") as file:
            self._map = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        self._content = np.frombuffer(self._map, np.uint8)
        self._scan(self._map, request)
        self._numbers = {layout.name: kind for kind, layout in self._layouts.items() if self._offsets.get(kind)}
        sensors = self._sensor_fields()
        self.kinds = {
            name: ardupilot.Kind(self._layouts[kind].numeric, sensors.get(name)) for name, kind in self._numbers.items()
        }

    def bodies(self, name: str, field: str | None = None) -> Any:
        """Unpack all messages of a type, or one of their fields, as they lie in the file."""
        parts = [rows if field is None else rows[field].copy() for rows in self._parts(name)]
        return np.concatenate(parts)

    def _parts(self, name: str) -> Iterator[Any]:
        """Unpack the messages of a type part by part, so that neither they nor the file need be held as a whole."""
        body = self._layouts[self._numbers[name]].body
        windows = np.lib.stride_tricks.sliding_window_view(self._content, body.itemsize)
        offsets = np.frombuffer(self._offsets[self._numbers[name]], dtype=np.int64)
        for at in range(0, offsets.size, _PART):
            yield np.ascontiguousarray(windows[offsets[at : at + _PART] + 3]).view(body)[:, 0]
            _release(self._map, self._content.size)

    def columns(self, name: str, fields: Collection[str]) -> dict[str, Array]:
        """See `Messages`."""
        divisors = self._layouts[self._numbers[name]].divisors
        parts: dict[str, list[Array]] = {field: [] for field in fields}
        for rows in self._parts(name):
            for field, column in parts.items():
                column.append(numbers(rows[field]) / divisors[field])
        return {field: np.concatenate(parts.pop(field)) for field in list(parts)}

    def parameters(self) -> list[tuple[str, float]]:
        """Give the PARM messages, in their order."""
        if not self._has("PARM", "Name", "Value"):
            return []
        rows = self.bodies("PARM")
        return [(name.decode("latin-1"), float(value)) for name, value in zip(rows["Name"], rows["Value"], strict=True)]

    def texts(self) -> list[str]:
        """Give the MSG messages, in their order."""
        if not self._has("MSG", "Message"):
            return []
        return [text.decode("latin-1") for text in self.bodies("MSG", "Message").tolist()]

    def _has(self, name: str, *fields: str) -> bool:
        return name in self._numbers and set(fields) <= set(self._layouts[self._numbers[name]].fields)

    def _scan(self, content: mmap.mmap, request: Request) -> None:
        lengths = [0] * 256
        lengths[_FMT] = _FMT_LENGTH
        head = struct.Struct("<HB").unpack_from
        mark = int.from_bytes(_MARK, "little")
        size, at, told, lost, places = len(content), 0, 0, 0, 0
        latest: array | None = None
        while at + 3 <= size:
            found, kind = head(content, at)
            length = lengths[kind]
            if found == mark and length and at + length <= size:
                if kind == _FMT:
                    self._define(content[at + 3 : at + length], lengths)
                latest = self._offsets[kind]
                latest.append(at)
                at += length
                if at - told > EVERY:
                    told = at
                    _release(content, at)
                    request.progress(at, size)
                continue
            start, at = at, _next_message(content, at + 1, lengths)
            if at == size and _is_padding(content[start : start + _PAGE + 1]):
                continue
            if found != mark and latest is not None:
                # A message that nothing follows was cut, and what stands in its place may be anything.
                latest.pop()
            if at == size:
                self.notes.append(torn(start, size, "what follows is no whole message"))
            else:
                lost, places = lost + at - start, places + 1
            latest = None
        if at < size and not _is_padding(content[at:size][: _PAGE + 1]):
            self.notes.append(torn(at, size, "the last message is cut short"))
        request.progress(size, size)
        if places:
            self.notes.append(f"{lost} bytes at {places} places are no message; they were skipped")

    def _define(self, body: bytes, lengths: list[int]) -> None:
        """Take the layout of a type; the first one stays, because a later one that differs is damaged."""
        kind, length, *texts = _FMT_BODY.unpack(body)
        if kind in self._layouts:
            return
        try:
            name, characters, columns = (text.split(b"\0")[0].decode("ascii") for text in texts)
            fields = columns.split(",") if columns else []
            types = [f"S{_TEXTS[one]}" if one in _TEXTS else f"<{_NUMBERS[one]}" for one in characters]
            layout = np.dtype(list(zip(fields, types, strict=True)))
        except (ValueError, KeyError, TypeError):
            return
        if layout.itemsize + 3 != length or not layout.itemsize:
            return
        scales = [_DIVISORS.get(one, 1.0) for one in characters]
        self._layouts[kind] = Layout(name, length, tuple(fields), layout, dict(zip(fields, scales, strict=True)))
        lengths[kind] = length

    def _sensor_fields(self) -> dict[str, str]:
        """Find the field that tells the sensor, by FMTU; by the usual names in logs that have no units."""
        units = {}
        if self._has("FMTU", "FmtType", "UnitIds"):
            units = {int(row["FmtType"]): row["UnitIds"].decode("latin-1") for row in self.bodies("FMTU")}
        result = {}
        for name, kind in self._numbers.items():
            fields, body = self._layouts[kind].fields, self._layouts[kind].body
            place = units[kind].find(_SENSOR) if kind in units else 1 if fields[1:2] in (("I",), ("C",)) else -1
            if 0 <= place < len(fields) and body[fields[place]].kind in "iu":
                result[name] = fields[place]
        return result


def _next_message(content: mmap.mmap, at: int, lengths: list[int]) -> int:
    """Find the next message that another one, or the end, follows; the size where there is none."""
    size = len(content)
    while True:
        at = content.find(_MARK, at)
        if at < 0 or at + 3 > size:
            return size
        length = lengths[content[at + 2]]
        after = at + length
        if length and (after == size or content[after : after + 2] == _MARK):
            return at
        at += 1


def _release(content: mmap.mmap, size: int) -> None:
    """Let go of the pages of a file that were read; the system reads them again where they are asked for."""
    if hasattr(mmap, "MADV_DONTNEED"):
        content.madvise(mmap.MADV_DONTNEED, 0, size)


def _is_padding(rest: bytes) -> bool:
    return len(rest) <= _PAGE and len(set(rest)) == 1


def _read(head: Head, request: Request) -> Recording:
    return ardupilot.recording(DataFlash(head.path, request), request, str(head.path))


DATAFLASH = Format("ArduPilot DataFlash", begins_with(_MARK + bytes([_FMT])), _read, (".bin",), library="numpy")
