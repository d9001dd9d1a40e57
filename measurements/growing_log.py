"""A log that is still being written: its lines as they come, as motions that go on where the last one ended.

The latest half minute is kept in memory.
"""

import gzip
import io
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..physics.errors import LogError, RequestError, shown
from ..physics.motion import RUN_UP, Array, Motion
from ..physics.vehicle import Vehicle
from .channels.channel_map import TIME, Entry, read_channel_map, time_of
from .channels.mapping import map_channels
from .formats.base import EPOCH, EXPECTED, Stream, TimeColumn, find_time, read_header
from .formats.tables.tables import LONG, is_long, is_wide
from .log import Log
from .log_options import Reading
from .preparation.needs import require
from .preparation.prepare import WEAK, motion_on, native_rate, reference, usable_spans
from .preparation.resampling import even_grid

_ONCE = 1 << 16
"""Bytes that are read at once [B]: some hundred rows, whose motion stays in little memory."""
_LOOK = 0.05
"""Time between two looks at a file that has not grown [s]: of a row at 20 Hz."""
_LONGEST = 1 << 20
"""Bytes without an end of a line after which this is no table [B]."""
STDIN = "-"
"""The name of standard input."""


def growing_lines(name: str, follow: bool = False, idle: float | None = None) -> Iterator[list[str]]:
    """Lines of a text file, or of standard input, as many as there are at a time; none when it has not grown.

    A last line without an end is waited for while the file is followed, and left out in the end: it is half-written. In
    a file that is not followed it is a line.

    Parameters
    ----------
    name : path, or `-`
    follow : wait for more at the end of a file
    idle : end when there was nothing new for so long [s]; None for never. Of standard input whoever writes decides

    Raises
    ------
    LogError
        when the file is missing or cannot be followed, becomes shorter, or holds no lines.
    RequestError
        for standard input with `follow`.
    """
    if name == STDIN:
        if follow:
            raise RequestError("adapt: --follow waits for a file to grow; standard input is read to its end anyway")
        pipe = sys.stdin.buffer
        read = pipe.read1 if isinstance(pipe, io.BufferedReader) else pipe.read  # what there is, without waiting
        yield from _lines(_parts(read), "standard input", False)
        return
    path = Path(name)
    if path.is_dir():
        raise LogError(
            f"{path}: expected a CSV log, got a folder; name the file in it that grows, or - for standard input."
        )
    if not path.is_file():
        raise LogError(f"{path}: no such file; expected a CSV log, or - for standard input. Check the path.")
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        if packed and follow:
            raise LogError(f"{path}: a gzip file cannot be followed as it grows; write the log as plain CSV.")
        if packed:
            with gzip.open(file, "rb") as inner:
                yield from _lines(_parts(inner.read), name, False)
            return
        yield from _lines(_grown(file, path, idle) if follow else _parts(file.read), name, follow)


def _parts(read: Callable[[int], bytes]) -> Iterator[bytes]:
    return iter(partial(read, _ONCE), b"")


def _grown(file: BinaryIO, path: Path, idle: float | None) -> Iterator[bytes]:
    last = time.monotonic()
    while idle is None or time.monotonic() - last < idle:
        part = file.read(_ONCE)
        if part:
            last = time.monotonic()
            yield part
            continue
        if path.stat().st_size < file.tell():
            raise LogError(f"{path}: the log became shorter while it was followed. Was it written anew? Start again.")
        yield b""
        time.sleep(_LOOK)


def _lines(parts: Iterator[bytes], where: str, follow: bool) -> Iterator[list[str]]:
    rest = b""
    for part in parts:
        *whole, rest = (rest + part).split(b"\n")
        if len(rest) > _LONGEST:
            raise LogError(f"{where}: expected lines of a CSV table, got {len(rest)} bytes without an end of a line.")
        yield [line.decode("utf-8", "replace").rstrip("\r") for line in whole]
    if rest.strip() and not follow:
        yield [rest.decode("utf-8", "replace")]


@dataclass(slots=True)
class _Column:
    """The latest values of a stream, in the order in which they were written."""

    time: list[float] = field(default_factory=list)
    value: list[float] = field(default_factory=list)
    line: list[int] = field(default_factory=list)

    def stream(self, topic: str, name: str, like: Stream | None) -> Stream:
        """As readers give it; the fields of a message, and the columns of a row, share one array of stamps."""
        stamps = np.array(self.time)
        if like is not None and np.array_equal(like.time, stamps):
            stamps = like.time
        return Stream(topic, name, stamps, np.array(self.value), np.array(self.line, dtype=np.int64))

    def cut(self, before: float) -> None:
        """Forget what is older, but for the last of it: a command that was sent once is still in force."""
        kept = int(np.searchsorted(self.time, before)) - 1
        if kept > 0:
            del self.time[:kept], self.value[:kept], self.line[:kept]


class GrowingTable:
    """Rows of a table, long or wide, as streams of the latest values.

    Parameters
    ----------
    where : the file, for messages
    clock : what a channel map says of the column of the time

    Attributes
    ----------
    notes : what was assumed and skipped, and not asked for yet; see `take_notes`
    skipped : rows that could not be read
    newest : latest stamp of all streams [s]
    start_ns : the file's own stamp of time zero [ns]; 0 where its time is that of the file
    """

    def __init__(self, where: str, clock: TimeColumn | None = None) -> None:
        self.where, self.skipped, self.newest, self.start_ns = where, 0, -np.inf, 0
        self.notes: list[str] = []
        self._columns: dict[tuple[str, str], _Column] = {}
        self._names: tuple[str, ...] = ()
        self._separator, self._line, self._long = ",", 0, False
        self._first: float | int | None = None
        self._given, self._time, self._per_second = clock, TimeColumn(""), 1.0

    def take(self, lines: list[str]) -> None:
        """Take the next lines.

        Raises
        ------
        LogError
            when the header is that of no table, or time runs backwards.
        """
        for line in lines:
            self._line += 1
            text = line.removeprefix("\ufeff") if self._line == 1 else line
            if not text.strip() or (not self._names and text.startswith("#")):
                continue
            if not self._names:
                self._header(text)
            else:
                self._row(text)

    def streams(self) -> list[Stream]:
        """The latest values of every stream that has some."""
        result: list[Stream] = []
        for name, column in sorted(self._columns.items()):
            if column.time:
                result.append(column.stream(*name, result[-1] if result else None))
        return result

    def cut(self, before: float) -> None:
        """Forget what is older [s], but for the last value of it of each stream."""
        for column in self._columns.values():
            column.cut(before)

    def take_notes(self) -> list[str]:
        """The notes since the last time."""
        notes, self.notes = self.notes, []
        return notes

    def _header(self, text: str) -> None:
        header = read_header(text.encode())
        self._separator, names = header.separator, header.columns
        clock = find_time(names, self._given)
        if clock is None or not (is_long(names, clock) or is_wide(names, clock)):
            raise LogError(f"{self.where}: line {self._line}: {EXPECTED}, got {shown(text)}.")
        self._names, self._long = names, is_long(names, clock)
        self._time, self._clock = clock, names.index(clock.name)
        if self._long:
            self._places = tuple(names.index(name) for name in LONG)

    def _row(self, text: str) -> None:
        cells = [cell.strip().strip('"') for cell in text.split(self._separator)]
        if len(cells) != len(self._names):
            self._skip(f"expected {len(self._names)} values, got {len(cells)}")
            return
        try:
            stamp = self._seconds(cells[self._clock])
        except (ValueError, OverflowError):
            self._skip(f"expected a time, got {shown(cells[self._clock])}")
            return
        if self._long:
            topic, name, value = (cells[k] for k in self._places)
            if not name:
                self._skip("expected a field, got none")
                return
            self._add((topic, name), stamp, _number(value))
        else:
            for k, name in enumerate(self._names):
                if k != self._clock:
                    self._add(("", name), stamp, _number(cells[k]))
        self.newest = max(self.newest, stamp)

    def _add(self, name: tuple[str, str], stamp: float, value: float) -> None:
        column = self._columns.setdefault(name, _Column())
        if column.time and stamp < column.time[-1]:
            raise LogError(
                f"{self.where}: time runs backwards at line {self._line}: {stamp:.6f} s after {column.time[-1]:.6f} s "
                f"in {':'.join(filter(None, name))}. A log that is followed must be written in the order of time; "
                "was the clock set, or the recording started anew? Start again from there."
            )
        column.time.append(stamp)
        column.value.append(value)
        column.line.append(self._line)

    def _seconds(self, cell: str) -> float:
        try:
            stamp: float | int = int(cell)
        except ValueError:
            stamp = float(cell)
        if not abs(stamp) < 2**63:
            raise ValueError(cell)
        if self._first is None:
            self._per_second = self._time.ticks(stamp)
            self._first = stamp if stamp / self._per_second >= EPOCH else 0
            if self._first:
                self.notes.append(f"time counts from the first stamp, {self._names[self._clock]} = {self._first}")
                self.start_ns = int(self._first * int(1e9 / self._per_second))
        return (stamp - self._first) / self._per_second

    def _skip(self, why: str) -> None:
        self.skipped += 1
        if self.skipped == 1:
            self.notes.append(f"line {self._line}: {why}; the row is skipped, and so are others like it")


def _number(cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        return np.nan
    return value if np.isfinite(value) else np.nan


_MARGIN = 5.0
"""Time that is kept beyond the longest history of commands [s]: of a stretch that is long enough to be one."""
_SILENT = 5.0
"""Time for which a log grows without a motion before this is told [s]."""


class GrowingLog:
    """Motions of a log as it grows, as `prepare` makes them for the weak form, each row once.

    A row is ready when the next one is there: a command that is averaged over the step about a stamp is then known.

    Parameters
    ----------
    where : the file, for messages
    vehicle : whose thrusters name the commands
    reading : axes, channel map and namespace
    least : how much of the log must be new for motions to be made of it [s]: to make them costs the same for all rows

    Attributes
    ----------
    table : its rows
    log : the latest channels, None before there are any
    """

    def __init__(self, where: str, vehicle: Vehicle, reading: Reading, least: float = 0.0) -> None:
        self._where, self._vehicle, self._reading, self._least = where, vehicle, reading, least
        given = {} if reading.channel_map is None else read_channel_map(Path(reading.channel_map))
        self.table = GrowingTable(where, time_of(given))
        self.log: Log | None = None
        self._entries: dict[str, Entry | None] = {name: entry for name, entry in given.items() if name != TIME}
        self._step = self._begin = 0.0
        self._last: float | None = None  # stamp of the last row that was given
        self._silent = False

    @property
    def seconds(self) -> float:
        """How much of the log was written since its first motion was asked for [s]."""
        times = [stream.time[0] for stream in self.table.streams()]
        return float(self.table.newest - min(times)) if times else 0.0

    def begin(self) -> tuple[str, ...]:
        """Decide on channels and rate by what is there; from now on motions can be asked for. Gives the notes.

        Raises
        ------
        LogError
            when the vehicle cannot be followed by these channels.
        """
        streams = self.table.streams()
        if not streams:
            raise LogError(f"{self._where}: a header but no rows, or nothing at all; is the log being written?")
        mapped = map_channels(streams, self._reading.frame, self._entries, self._where, (), self._reading.namespace)
        self._entries = mapped.entries
        self.log = Log(Path(self._where), mapped.channels, mapped.notes, mapped.unused, mapped.entries)
        require(self.log, self._vehicle)
        self._step, self._begin = 1.0 / native_rate(self.log), float(reference(self.log).time[0])
        return mapped.notes

    def motions(self, ended: bool = False) -> list[Motion]:
        """What was written since the last time, in gap-free stretches; the first goes on where the last one ended.

        Parameters
        ----------
        ended : nothing more will be written

        Raises
        ------
        LogError
            when a value cannot be what its channel says.
        """
        if not ended and self._last is not None and self.table.newest < self._last + self._least + self._step:
            return []
        streams = self.table.streams()
        frame, namespace = self._reading.frame, self._reading.namespace
        channels = map_channels(streams, frame, self._entries, self._where, (), namespace).channels
        self.log = log = Log(Path(self._where), channels, entries=self._entries)
        result = []
        for start, end in usable_spans(log, self._vehicle, WEAK)[0]:
            ready = end if ended else end - self._step
            goes_on = self._last is not None and start <= self._last + 0.5 * self._step
            grid: Array = even_grid(reference(log).time, (start, end), self._step)
            if goes_on and self._last is not None:
                count = int(np.floor((ready - self._last) / self._step + 1e-6))
                grid = self._last + self._step * np.arange(1.0, count + 1.0)
            grid = grid[grid <= ready + 1e-6 * self._step]
            if self._last is not None:
                grid = grid[grid > self._last + 1e-6 * self._step]
            if grid.size < 2:
                continue
            motion = motion_on(log, self._vehicle, WEAK, (start, end), grid, self._step)
            result.append(replace(motion, minutes=(grid - self._begin) / 60.0))
            self._last = float(grid[-1])
        self._forget(bool(result))
        return result

    def _forget(self, grown: bool) -> None:
        """Keep what the next rows need; of a channel that is silent, tell once."""
        newest, last = self.table.newest, self._last
        kept = newest if last is None else last
        self.table.cut(min(kept, newest - _MARGIN) - RUN_UP - _MARGIN)
        late = self._begin if last is None else last
        if newest - late > _SILENT and not (grown or self._silent) and self.log is not None:
            late_ones = [n for n, c in self.log.channels.items() if newest - c.time[-1] > 0.5 * _SILENT]
            why = f"{' '.join(late_ones)} said nothing since" if late_ones else "no stretch without gaps is long enough"
            self.table.notes.append(f"t = {newest:.1f} s: nothing to follow since t = {late:.1f} s: {why}")
        self._silent = not grown and (self._silent or newest - late > _SILENT)
