"""MATLAB `.mat` files up to version 7 as tables: a time vector, and vectors as long as it, read through scipy.

A struct with a time vector of its own is a table by its dotted path; Simulink's "structure with time" and a saved
`timeseries` are read as what they mean. Elements are checked beforehand ("MAT-File Format", The MathWorks, chapter 1,
level 5): scipy 1.17 takes an element's type for an index unchecked, and a damaged one ends the process.
"""

import math
import mmap
import struct
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ....physics.errors import LogError, listed
from ....physics.motion import Array
from ....physics.reading import Plain
from ..base import DEEPEST, Format, Head, Recording, Request, Stream, TimeColumn, find_time, in_file
from ..unpacking import inflated, most_held
from .tables import wide_recording, without_names

_HEADER = 128
"""Bytes before the first element (MAT-File Format, level 5)."""
_MATRIX, _PACKED = 14, 15
"""Types of elements that are a matrix, and that are packed (MAT-File Format, level 5)."""
_NUMBERS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
"""Types of elements that hold numbers or text -> bytes of one."""
_CELL, _STRUCTS, _TEXT = 1, (2, 3), 4
"""Classes of a matrix that hold other matrices, or text; an object is saved as a struct is."""
_BEFORE = 6
"""Most elements that stand before the parts of a matrix."""
_DEPTH = 32
"""Levels of structs in structs: more than any log has, and few beside the calls that Python bears."""
_MOST_PARTS = 500_000
"""Matrices of a file: a struct array of 50,000 messages with 10 fields has so many, and each takes 1 kB in memory."""


def check_elements(path: Path) -> None:
    """Walk all elements of a file.

    Raises
    ------
    ValueError
        for an element of no known type, one that is longer than what holds it, one that claims more parts than it has,
        or more than `unpacking.most_held` lets packed variables hold.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        order = ">" if content[126:128] == b"MI" else "<"
        most = most_held(len(content))
        left, packed, walk = most, 0, _Walk(order)
        for kind, start, end in _elements(content, _HEADER, len(content), order):
            if kind == _PACKED:
                unpacked = inflated(content[start:end], left)
                left -= len(unpacked)
                before = walk.numbers
                walk.down(unpacked, 0, len(unpacked), 0)
                packed += walk.numbers - before
                if 8 * packed > most:
                    raise ValueError(f"its packed variables hold more than {most // 8} numbers")
            elif kind == _MATRIX:
                walk.down(content, start, end, 1)
            else:
                raise ValueError(f"an element of type {kind} where a variable is due")


class _Walk:
    """Goes down into the elements of matrices, and counts them.

    Attributes
    ----------
    numbers, parts : numbers and matrices seen so far
    """

    def __init__(self, order: str) -> None:
        self._order = order
        self.numbers = self.parts = 0

    def down(self, content: bytes | mmap.mmap, at: int, end: int, depth: int) -> None:
        """Look over the elements of a matrix, or of an unpacked variable (depth 0)."""
        numbers: list[bytes] = []
        parts, size = 0, end - at
        for kind, start, stop in _elements(content, at, end, self._order):
            if not parts and kind != _MATRIX and len(numbers) < _BEFORE:
                numbers.append(content[start:stop])
            if kind == _MATRIX:
                parts += 1
                self.parts += 1
                if depth > _DEPTH:
                    raise ValueError(f"structs in structs, more than {_DEPTH} deep")
                if self.parts > _MOST_PARTS:
                    raise ValueError(f"more than {_MOST_PARTS} matrices, cells or fields of structs")
                self.down(content, start, stop, depth + 1)
            elif kind in _NUMBERS:
                self.numbers += (stop - start) // _NUMBERS[kind]
            else:
                raise ValueError(f"an element of type {kind}")
        if depth:
            _check_count(numbers, parts, size, self._order)


def _check_count(numbers: list[bytes], parts: int, size: int, order: str) -> None:
    """Refuse a matrix that claims more parts than it has: scipy makes room for all of them before it reads one.

    Parameters
    ----------
    numbers : what stands before the parts: flags, dimensions, name, and of a struct the length of a field's name, and
        these names
    parts : matrices in this one
    size : of it [bytes]
    """
    if len(numbers) < 2 or len(numbers[0]) < 4:
        return
    mark = struct.unpack_from(f"{order}I", numbers[0])[0] & 0xFF
    many = math.prod(struct.unpack(f"{order}{len(numbers[1]) // 4}i", numbers[1][: len(numbers[1]) // 4 * 4]))
    most = size
    if mark == _CELL:
        most = parts
    elif mark in _STRUCTS and len(numbers) >= 5 and len(numbers[-2]) >= 4 and numbers[-1]:
        length = struct.unpack_from(f"{order}i", numbers[-2])[0]
        many *= len(numbers[-1]) // max(length, 1)
        most = parts
    elif mark not in (*_STRUCTS, _TEXT):
        return
    if many > most:
        raise ValueError(f"a cell array, struct or text of {many} parts in {size} bytes")


def _elements(content: bytes | mmap.mmap, at: int, end: int, order: str) -> Iterator[tuple[int, int, int]]:
    """Types of the elements that follow each other, and where the data of each begin and end."""
    while at < end:
        if at + 8 > end:
            raise ValueError("it ends within an element")
        kind, size = struct.unpack_from(f"{order}II", content, at)
        if kind >> 16:
            # Up to four bytes are held in the tag itself, with type and length in a half each.
            if kind >> 16 > 4:
                raise ValueError("a short element that is too long")
            yield kind & 0xFFFF, at + 4, at + 4 + (kind >> 16)
            at += 8
            continue
        stop = at + 8 + size
        if stop > end:
            raise ValueError("an element is longer than the file")
        yield kind, at + 8, stop
        at = stop if kind == _PACKED else stop + (-size) % 8  # packed elements are not padded


_TIMES = {"tout": TimeColumn("tout"), "T": None}
"""Names of which MATLAB's users mean something else than tables do: Simulink's time, and `T`, which may be anything."""
_FOREIGN = {
    b"\xff\xd8\xff": "a JPEG picture",
    b"\x89PNG": "a PNG picture",
    b"GIF8": "a GIF picture",
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a ZIP archive (or an office document)",
}
"""First bytes of files that are no log, and what these are. A .mat of version 4 has no mark of its own."""


@dataclass(slots=True)
class _Table:
    """A time vector and what is as long as it."""

    path: str
    clock: TimeColumn
    time: Array
    columns: dict[tuple[str, str], Array] = field(default_factory=dict)


def _read(head: Head, request: Request) -> Recording:
    from scipy.io import loadmat
    from scipy.io.matlab import matfile_version

    if head.start.startswith(b"MATLAB 7.3"):
        raise LogError(
            f"{head.path}: a MATLAB file of version 7.3 (HDF5), which is not read. In MATLAB: "
            "save('log.mat', 'variables', '-v7'), or write a table: writetable(T, 'log.csv')."
        )
    foreign = next((kind for mark, kind in _FOREIGN.items() if head.start.startswith(mark)), None)
    if foreign is not None:
        raise LogError(f"{head.path}: named .mat, but it is {foreign} and no MATLAB file. Give the log itself.")
    if matfile_version(head.path)[0] == 1:
        check_elements(head.path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        content = loadmat(head.path, simplify_cells=True)
    tables: list[_Table] = []
    left: list[str] = []
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    given = [] if head.time is None else _given(variables, head.time, str(head.path))
    _gather("", variables, given, tables, left)
    tables += given
    found = [_table(table, str(head.path)) for table in tables if table.columns]
    start = min((part.start_ns for part in found if part.start_ns), default=0)
    streams = [stream for part in found for stream in _since(start, part)]
    notes = [note for part in found for note in part.notes]
    if not streams and (matrices := _matrices(variables)):
        name, matrix = max(matrices.items(), key=lambda item: item[1].size)
        columns = {f"column {k + 1}": matrix[:, k] for k in range(matrix.shape[1])}
        with in_file(head.path):
            raise without_names(f"the matrix '{name}'", columns, None if len(matrices) == 1 else name)
    if not streams:
        raise LogError(
            f"{head.path}: expected a time vector (t, time, tout [s] or timestamp_ns) and vectors as long as it, got "
            f"{', '.join(left[:12]) or 'no numbers'}. A table or timeseries is an object that only MATLAB reads: save "
            "table2struct(T, 'ToScalar', true), or write it with writetable(T, 'log.csv')."
        )
    if left:
        notes.append(f"as long as no time vector, not read: {', '.join(left[:12])}{' ...' if len(left) > 12 else ''}")
    return Recording(tuple(streams), tuple(notes), start_ns=start)


def _since(start: int, part: Recording) -> Sequence[Stream]:
    """Streams of a table, whose time may count from its own first stamp, on the time that counts from `start` [ns]."""
    later = (part.start_ns - start) / 1e9 if part.start_ns else 0.0
    return [replace(stream, time=stream.time + later) for stream in part.streams] if later else part.streams


def _table(table: _Table, where: str) -> Recording:
    """Cut a table as any wide table is cut, then name its streams by the struct that holds them."""
    import pandas as pd

    columns = {str(k): value for k, value in enumerate(table.columns.values())}
    clock = replace(table.clock, name="time")
    found = wide_recording([pd.DataFrame({clock.name: table.time, **columns})], where, clock)
    named = [
        replace(stream, topic=topic, field=name)
        for stream, (topic, name) in zip(found.streams, table.columns, strict=True)
    ]
    notes = [f"{table.path}: {note}" if table.path else note for note in found.notes]
    return replace(found, streams=tuple(named), notes=tuple(notes))


def _gather(path: str, content: Plain, times: list[_Table], tables: list[_Table], left: list[str]) -> None:
    """Sort the vectors of a struct under the time vector next to them, or the nearest one above of their length."""
    own = [_Table(path, clock, value) for name, value in content.items() if (clock := _time_of(name, value))]
    tables += own
    times = [*own, *times]
    signal = _signal(content) if own and path else None
    if signal is not None:
        topic, _, name = path.rpartition(".")
        columns = _columns(name, signal)
        own[0].columns |= {(topic, column): value for column, value in columns if value.size == own[0].time.size}
        return
    for name, value in content.items():
        if _time_of(name, value) is not None:
            continue
        below = f"{path}.{name}" if path else name
        if name == "signals" and own:
            _simulink(path, value, own[0])
        elif isinstance(value, dict):
            if path.count(".") < DEEPEST:
                _gather(below, value, times, tables, left)
        elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
            for k, part in enumerate(list(np.ravel(np.asarray(value, dtype=object)))[:64]):
                if isinstance(part, dict):
                    _gather(f"{below}[{k}]", part, times, tables, left)
        else:
            for column, numbers in _columns(name, value):
                table = next((table for table in times if table.time.size == numbers.size), None)
                if table is None:
                    left.append(f"{below} {'x'.join(str(n) for n in value.shape)}")
                    break
                table.columns[path, column] = numbers


def _time_of(name: str, value: Any) -> TimeColumn | None:
    """The time that a vector is by its name; None where it is none."""
    numeric = isinstance(value, np.ndarray) and value.dtype.kind in "iuf" and value.ndim == 1 and value.size > 1
    return (_TIMES[name] if name in _TIMES else find_time((name,))) if numeric else None


def _given(variables: Plain, time: TimeColumn, where: str) -> list[_Table]:
    """The time that a channel map names: a vector, or a column of a matrix, by its number where there is one matrix.

    A matrix is then a table of columns "column 1", "column 2", ...

    Raises
    ------
    LogError
        where there is no such column.
    """
    matrices = _matrices(variables)
    found = {column: numbers for name, value in variables.items() for column, numbers in _columns(name, value)}
    if len(matrices) == 1:
        (matrix,) = matrices.values()
        found |= {f"column {k}": matrix[:, k - 1].astype(float) for k in range(1, matrix.shape[1] + 1)}
    if time.name not in found:
        there = listed(tuple(found)) or "no columns"
        raise LogError(f"{where}: the channel map takes time from '{time.name}', which is not among {there}.")
    table = _Table("", time, found[time.name])
    if time.name.startswith("column "):
        table.columns |= {("", name): value for name, value in found.items() if name.startswith("column ")}
        del table.columns["", time.name]
    return [table]


def _matrices(variables: Plain) -> dict[str, np.ndarray]:
    """The matrices of a file that may be tables without names: more rows than columns, and two columns at least."""
    return {
        name: value
        for name, value in variables.items()
        if isinstance(value, np.ndarray) and value.dtype.kind in "iuf" and value.ndim == 2
        if value.shape[0] > value.shape[1] > 1
    }


def _signal(content: Plain) -> np.ndarray | None:
    """Data of a struct that holds one signal: Time and Data, and nothing else that is as long."""
    found = [value for name, value in content.items() if name.lower() == "data"]
    return found[0] if len(found) == 1 and isinstance(found[0], np.ndarray) and found[0].dtype.kind in "biuf" else None


def _simulink(path: str, signals: Any, table: _Table) -> None:
    """Read the signals of Simulink's "structure with time": values and label of each."""
    listed = [signals] if isinstance(signals, dict) else list(np.ravel(np.asarray(signals, dtype=object)))
    for k, signal in enumerate(listed):
        if not isinstance(signal, dict) or not isinstance(signal.get("values"), np.ndarray):
            continue
        label = signal.get("label")
        name = label if isinstance(label, str) and label.strip() else f"signals[{k}]"
        for column, numbers in _columns(name, signal["values"]):
            if numbers.size == table.time.size:
                table.columns[path, column] = numbers


def _columns(name: str, value: Any) -> Iterator[tuple[str, Array]]:
    """Give a vector by its name, and the columns of a matrix (n, k) as name[0], name[1], ...; of others nothing."""
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "biuf" or value.size < 2:
        return
    if value.ndim == 1:
        yield name, value.astype(float)
    elif value.ndim == 2 and value.shape[1] <= 64:
        for k in range(value.shape[1]):
            yield f"{name}[{k}]", value[:, k].astype(float)


def _matches(head: Head) -> bool:
    return not head.gzipped and (head.start.startswith(b"MATLAB ") or head.path.suffix.lower() == ".mat")


MATLAB = Format("MATLAB", _matches, _read, (".mat",), library="scipy", table=True)
