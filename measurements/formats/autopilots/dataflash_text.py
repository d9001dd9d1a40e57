"""ArduPilot DataFlash logs as text (`.log`), a message a line, as ground stations convert them."""

import mmap
from array import array
from collections.abc import Collection
from pathlib import Path

import numpy as np

from ....physics.motion import Array
from ..base import EVERY, Format, Head, Recording, Request, begins_with
from . import ardupilot

_NO_NUMBERS = frozenset("nNZaM")
"""Format characters of fields that are no numbers."""


class DataFlashText(ardupilot.Messages):
    """The lines of a text log, found but not yet read into numbers; the values are scaled already.

    Parameters
    ----------
    path : the file
    request : told of the progress
    """

    def __init__(self, path: Path, request: Request) -> None:
        self._fields: dict[str, dict[str, int]] = {}
        self._numbers: dict[int, str] = {}
        self._units: dict[str, str] = {}
        self._lines: dict[str, array] = {}
        self._unpacked: dict[str, dict[str, Array]] = {}
        self._path = path
        self.notes: list[str] = []
        told = start = 0
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            while start < len(content):
                end = content.find(b"\n", start)
                end = len(content) if end < 0 else end
                comma = content.find(b",", start, min(start + 8, end))
                name = content[start:comma].decode("ascii", "replace") if comma > 0 else ""
                if name == "FMT":
                    self._define(_words(content[start:end]))
                elif name == "FMTU":
                    words = _words(content[start:end])
                    if len(words) > 3 and words[2].isdecimal():
                        self._units[self._numbers.get(int(words[2]), "")] = words[3]
                elif name in self._fields:
                    self._lines.setdefault(name, array("Q")).append(start)
                start = end + 1
                if start - told > EVERY:
                    told = start
                    request.progress(start, len(content))
        self.kinds = {n: ardupilot.Kind(tuple(self._fields[n]), self._sensor_field(n)) for n in self._lines}

    def _sensor_field(self, name: str) -> str | None:
        place = self._units.get(name, "").find("#") + 1
        fields = self._fields[name]
        if place:
            return next((field for field, at in fields.items() if at == place), None)
        return next((field for field in ("I", "C") if fields.get(field) == 2 and name not in self._units), None)

    def columns(self, name: str, fields: Collection[str]) -> dict[str, Array]:
        """See `Messages`; all fields are read at once."""
        if name not in self._unpacked:
            fields = self._fields[name]
            rows = [words for words in self._rows(name) if len(words) > max(fields.values(), default=0)]
            self._unpacked[name] = {
                field: np.array([float(words[at]) if _is_number(words[at]) else np.nan for words in rows])
                for field, at in fields.items()
            }
        return self._unpacked[name]

    def parameters(self) -> list[tuple[str, float]]:
        """Give the PARM messages, in their order."""
        result = []
        for words in self._rows("PARM"):
            # TimeUS, Name, Value and more; before 2015 Name and Value alone.
            at = 1 if len(words) > 1 and not _is_number(words[1]) else 2
            if len(words) > at + 1 and _is_number(words[at + 1]):
                result.append((words[at], float(words[at + 1])))
        return result

    def texts(self) -> list[str]:
        """Give the MSG messages, in their order, after the stamp that logs have since 2015."""
        rows = [words[1:] for words in self._rows("MSG")]
        return [",".join(words[1:] if words and _is_number(words[0]) else words) for words in rows]

    def _define(self, words: list[str]) -> None:
        if len(words) < 6 or not words[1].isdecimal() or words[3] in self._fields:
            return
        columns, codes = words[5:], words[4]
        if len(columns) == len(codes):
            places = enumerate(zip(columns, codes, strict=True), 1)
            self._fields[words[3]] = {column: at for at, (column, code) in places if code not in _NO_NUMBERS}
            self._numbers[int(words[1])] = words[3]

    def _rows(self, name: str) -> list[list[str]]:
        if name not in self._lines:
            return []
        with self._path.open("rb") as file:
            rows = []
            for start in self._lines[name]:
                file.seek(start)
                rows.append(_words(file.readline(4096)))
        return rows


def _words(line: bytes) -> list[str]:
    return [word.strip() for word in line.decode("utf-8", "replace").split(",")]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _read(head: Head, request: Request) -> Recording:
    return ardupilot.recording(DataFlashText(head.path, request), request, str(head.path))


DATAFLASH_TEXT = Format("ArduPilot text", begins_with(b"FMT,"), _read, (".log",))
