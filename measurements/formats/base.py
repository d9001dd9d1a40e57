"""The interface of a log reader: what it is asked, and what it gives: streams of stamped numbers, of which vehicle.

Also the first look at a file: how a text table is written, its columns, and which of them holds the time in which unit.
"""

import codecs
import csv
import gzip
import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...physics.errors import LogError
from ...physics.motion import Array
from ..canonical import Output

EPOCH = 1e8
"""A first stamp above this [s] counts from an epoch (1973), not from the start of the log."""
PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9, "min": 1.0 / 60.0, "h": 1.0 / 3600.0}
"""Units of a time column, and how many of them are a second."""
_UNITS = (*PER_SECOND, "_ms", "_us", "_ns")
_UNIT = (
    r"(?P<s>s|secs?|seconds?)|(?P<ms>ms|msecs?|millis|milliseconds?)|(?P<us>us|[\u00b5\u03bc]s|usecs?|micros|"
    r"microseconds?)|(?P<ns>ns|nsecs?|nanos|nanoseconds?)|(?P<min>mins?|minutes?)|(?P<h>h|hrs?|hours?)"
)
_NAME = re.compile(
    r"(?P<_ns>%time)|[\W_]*(?:(?:unix|utc|gps|ros|rosbag|system|sample|log|elapsed|epoch|relative|header)[ _.]?)*"
    r"(?:ts|(?P<first>t|time)|time[ _]boot|time[ _]?stamp|stamp|elapsed(?:[ _]time)?|epoch|date[ _/-]?time|"
    r"(?P<date>date))"
    rf"[ _.]?[\[(]?(?:{_UNIT})?[\])]?|seconds|secs?|(?P<_ms>milliseconds|millis)|(?P<_us>microseconds|micros)",
    re.IGNORECASE,
)
"""`t`, `time`, `__time` (PlotJuggler), `%time` (rostopic, in ns), `Time (s)`, `timestamp_ms`, `TimeUS`, ..."""


@dataclass(frozen=True, slots=True)
class TimeColumn:
    """Where a table has its time.

    Attributes
    ----------
    name : of the column
    per_second : how many of its units are a second; None where nobody says, so that the size of its stamps tells
    date : column of the date, where the time is that of a day
    """

    name: str
    per_second: float | None = None
    date: str | None = None

    def ticks(self, first: float) -> float:
        """How many units of the column are a second, by its name or by the size of its first stamp.

        Stamps since 1970 tell it: those in milliseconds are a thousand times those in seconds, and so on; the ranges
        from 1973 on follow each other. Stamps that count from the start of a log are seconds.
        """
        if self.per_second is not None:
            return self.per_second
        fitting = [scale for scale in (1e9, 1e6, 1e3) if first >= EPOCH * scale]
        return fitting[0] if fitting else 1.0


def find_time(columns: Sequence[str], given: TimeColumn | None = None) -> TimeColumn | None:
    """Find the column that holds the time; None when there is none.

    Of several, `t` and `time` go before others, and the first before later ones.

    Parameters
    ----------
    given : what a channel map says of it; its unit goes before that in the name

    Examples
    --------
    >>> find_time(("x", "Time (ms)"))
    TimeColumn(name='Time (ms)', per_second=1000.0, date=None)
    >>> find_time(("Date", "Time", "x"))
    TimeColumn(name='Time', per_second=None, date='Date')
    """
    if given is not None:
        own = find_time((given.name,))
        by_name = None if own is None else own.per_second
        return replace(given, per_second=given.per_second or by_name) if given.name in columns else None
    found = {column: match for column in columns if (match := _NAME.fullmatch(column.strip()))}
    stamps = [column for column, match in found.items() if not match["date"]]
    dates = [column for column, match in found.items() if match["date"]]
    if not found:
        return None
    name = min(stamps or dates, key=lambda column: not found[column]["first"])
    unit = next((unit.strip("_") for unit, text in found[name].groupdict().items() if text and unit in _UNITS), None)
    return TimeColumn(name, PER_SECOND.get(unit or ""), dates[0] if stamps and dates else None)


_SEPARATORS = (",", ";", "\t")
_BLANKS = " "
"""The separator of a table whose columns are set apart by blanks, one or more."""
_MARKS = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16", codecs.BOM_UTF8: "utf-8-sig"}
"""First bytes of a text that tell its encoding; Excel's "Unicode text" is UTF-16."""
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)", re.IGNORECASE)
_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
_POINT = re.compile(r"[-+]?\d*\.\d+([eE][-+]?\d+)?")
_LOOKED_AT = 200
"""Rows in which a decimal comma is looked for: a column that is no whole number shows one in almost every row."""


@dataclass(frozen=True, slots=True)
class TextHeader:
    """How a text table is written.

    Attributes
    ----------
    separator : of its columns; a blank for columns set apart by blanks
    columns : their names, stripped; "column 1", "column 2" ... where the table has none; empty when it is no text
    remarks : lines before the names that begin with `#`, without that mark
    above : lines before the first row of numbers
    named : whether the table names its columns
    decimal : the decimal sign
    encoding : of the text
    """

    separator: str = ","
    columns: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    above: int = 1
    named: bool = True
    decimal: str = "."
    encoding: str = "utf-8-sig"


def read_header(content: bytes) -> TextHeader:
    """Tell how a text table is written by its first bytes; without columns where it is no text.

    Names may be quoted and hold the separator (RFC 4180, section 2.6). A table without names whose last remark has as
    many words as it has columns takes them for names: `numpy.savetxt` writes its header so.
    """
    encoding = next((name for mark, name in _MARKS.items() if content.startswith(mark)), "utf-8-sig")
    # The last character may be cut in two.
    lines = codecs.getincrementaldecoder(encoding)("replace").decode(content).splitlines()
    remarks = 0
    while remarks < len(lines) - 1 and lines[remarks].startswith("#"):
        remarks += 1
    line = lines[remarks] if lines else ""
    if "\ufffd" in line or not line.replace("\t", " ").isprintable():
        return TextHeader()
    rows = lines[remarks + 1 : remarks + 1 + _LOOKED_AT]
    separator = max(_SEPARATORS, key=lambda mark: len(_cells(line, mark)))
    if len(_cells(line, separator)) == 1 and len(line.split()) > 1:
        separator = _BLANKS
    elif separator == "," and len(line.split()) > 1 and all(map(_COMMA.fullmatch, line.split())):
        separator = _BLANKS  # numbers with a decimal comma, and blanks between them
    names = _cells(line, separator)
    told = tuple(remark.strip("# \r") for remark in lines[:remarks])
    above, named = remarks + 1, True
    if len(names) > 1 and any(names) and all(map(_NUMBER.fullmatch, filter(None, names))):
        rows, above, named = [line, *rows], remarks, False
        names = tuple(f"column {k}" for k in range(1, len(names) + 1))
        written = _cells(told[-1], separator if separator in told[-1] else _BLANKS) if told else ()
        if len(written) == len(names) and not any(map(_NUMBER.fullmatch, written)):
            names, told, named = written, told[:-1], True
    return TextHeader(separator, names, told, above, named, _decimal(rows, separator), encoding)


def first_numbers(content: bytes, header: TextHeader) -> dict[str, Array]:
    """The columns (n,) of the whole rows among the first bytes of a table, NaN where there is no number."""
    lines = codecs.getincrementaldecoder(header.encoding)("replace").decode(content).splitlines()
    rows = [_cells(line, header.separator) for line in lines[header.above : header.above + _LOOKED_AT]]
    whole = [row for row in rows if len(row) == len(header.columns)]
    return {name: np.array([_number(row[k], header.decimal) for row in whole]) for k, name in enumerate(header.columns)}


def _number(cell: str, decimal: str) -> float:
    try:
        return float(cell.replace(decimal, "."))
    except ValueError:
        return np.nan


def _cells(line: str, separator: str) -> tuple[str, ...]:
    """The cells of a line, stripped of blanks and quotes."""
    if separator == _BLANKS:
        return tuple(line.split())
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a cell of more than 131,072 letters is no name
        return (line,)
    return tuple(cell.strip().strip('"').strip() for cell in cells)


def _decimal(rows: list[str], separator: str) -> str:
    """The decimal sign of a table: a comma where numbers have one and none has a point."""
    if separator == ",":
        return "."
    cells = [cell for row in rows for cell in _cells(row, separator)]
    return "," if any(map(_COMMA.fullmatch, cells)) and not any(map(_POINT.fullmatch, cells)) else "."


EXPECTED = (
    "expected a CSV or Parquet table with the header 'time,topic,field,value' (or timestamp_ns for time), "
    "or one row per time stamp with a column 't' or 'time' [s] or 'timestamp_ns'"
)

_HEAD_BYTES = 65536
"""Bytes at the beginning of a file from which its format is told [B]: marks are some ten bytes, and the header of a
table with a thousand columns fits."""
EVERY = 1 << 22
"""Bytes between two words of progress [B]: a reader takes a fraction of a second for them."""
DEEPEST = 8
"""Levels of messages in messages, and of structs in structs, that are looked into: those of robots have four
(`pose.pose.position.x`, in a list), and each level more may multiply the fields of a damaged file."""


@dataclass(frozen=True, slots=True)
class Name:
    """What a file calls one sequence of numbers.

    Attributes
    ----------
    topic : of a bag or a long table, message of an autopilot's log; empty in a wide table
    field : of the message, with dots; or the column
    kind : type of the message, such as `nav_msgs/msg/Odometry` or `dataflash/ATT`; empty where the file tells none
    """

    topic: str
    field: str
    kind: str = ""

    @property
    def name(self) -> str:
        """The name that a channel map uses: `topic:field`, or the column."""
        return f"{self.topic}:{self.field}" if self.topic else self.field


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """One field of one topic (bags and long tables) or one column (wide tables), as written in the file.

    Attributes
    ----------
    topic, field, kind : see `Name`
    time : (n,) [s]
    value : (n,) in the file's own unit; NaN where the file holds no number
    row : (n,) line in the file, or number of the message, for messages
    frame : frame of reference in which a message says its values are, such as `base_link` or `map_ned`; mostly empty
    output : of a thruster's command, what the autopilot's parameters say of it
    """

    topic: str
    field: str
    time: Array
    value: Array
    row: NDArray[np.int64]
    kind: str = ""
    frame: str = ""
    output: Output | None = None

    @property
    def name(self) -> str:
        """The name that a channel map uses: `topic:field`, or the column."""
        return self.label.name

    @property
    def label(self) -> Name:
        """Topic, field and kind, without the numbers."""
        return Name(self.topic, self.field, self.kind)


class Craft(Enum):
    """A kind of vehicle; its value is what a sentence calls it."""

    BOAT = "a surface vessel"
    ROVER = "a rover or boat"
    COPTER = "a copter"
    PLANE = "a plane"
    SUBMARINE = "a submarine"
    AIRSHIP = "an airship"
    TRACKER = "an antenna tracker"

    @property
    def floats(self) -> bool:
        """True when it may be a surface vessel; ArduPilot's firmware of boats is that of rovers."""
        return self in (Craft.BOAT, Craft.ROVER)


@dataclass(frozen=True, slots=True)
class CraftEvidence:
    """A kind of vehicle, and the words of the log that tell it."""

    craft: Craft
    source: str

    @property
    def sentence(self) -> str:
        """What the log says, without an end."""
        none = "" if self.craft.floats else ", which is no surface vessel"
        return f"the log is of {self.craft.value}{none} ({self.source})"


@dataclass(frozen=True, slots=True)
class Recording:
    """What a reader found in a file, in the order of the file, and what it had to assume.

    Attributes
    ----------
    streams : what was read
    notes : what was assumed, converted, or lost at a break (see `torn`)
    unread : what the file holds beside, which nobody asked for
    start_ns : the file's own stamp of time zero of the streams [ns]; 0 where their time is that of the file
    out_of_step : by how much the streams may be out of step with each other, as far as the reader can tell [s]
    crafts : what kind of vehicle the log says it is of, by how its topics begin; empty where it says nothing
    clock : of a table, the column that holds its time
    """

    streams: tuple[Stream, ...]
    notes: tuple[str, ...] = ()
    unread: tuple[Name, ...] = ()
    start_ns: int = 0
    out_of_step: float = 0.0
    crafts: Mapping[str, CraftEvidence] = field(default_factory=dict)
    clock: str = ""


@dataclass(frozen=True, slots=True)
class Head:
    """The first look at a file or folder, from which the format is told.

    Attributes
    ----------
    path : the file or folder
    start : the first 64 KiB of the content, unpacked when it is gzip; empty for a folder
    gzipped : whether the content is gzip, whatever the file's name
    text : how it is written, as a text table; without columns where it is no text
    entries : names in the folder, sorted; None for a file
    time : what a channel map says of the column that holds the time
    """

    path: Path
    start: bytes
    gzipped: bool = False
    text: TextHeader = field(default_factory=TextHeader)
    entries: tuple[str, ...] | None = None
    time: TimeColumn | None = None

    @property
    def clock(self) -> TimeColumn | None:
        """The column of a text table that holds its time, None where there is none."""
        return find_time(self.text.columns, self.time)


def _silent(done: int, total: int) -> None:
    """Tell nobody."""


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked of a reader.

    Attributes
    ----------
    choose : told the names that a file holds, picks those to read; the others are named in `Recording.unread`. A
        reader calls it before it unpacks messages, so that what nobody wants costs nothing; a small table may ignore
        it. It may raise LogError, which the reader lets pass.
    progress : told the bytes done, and the bytes in all, now and then (every few MB)
    time : the column of a table that holds its time, as a channel map says it
    """

    choose: Callable[[Sequence[Name]], frozenset[Name]] = frozenset
    progress: Callable[[int, int], None] = _silent
    time: TimeColumn | None = None


@dataclass(frozen=True, slots=True)
class Format:
    """One log format.

    Attributes
    ----------
    name : as messages say it, after "a broken"
    matches : recognises it by the content (by the name only where the content has no mark)
    read : gives the recording, or raises LogError
    suffixes : usual endings of the file name, by which the command line tells a log from other words
    library : import name of the library that reads it, of the extra `logs` or of the core; empty where nothing is to
        be fenced. Whatever it raises is turned into a LogError at the door (`registry.read_recording`).
    marked : whether its content has a mark of its own; formats without one are asked after those with one
    table : whether it has columns, so that a channel map can say which of them holds the time
    """

    name: str
    matches: Callable[[Head], bool]
    read: Callable[[Head, Request], Recording]
    suffixes: tuple[str, ...] = ()
    library: str = ""
    marked: bool = True
    table: bool = False


def begins_with(*marks: bytes) -> Callable[[Head], bool]:
    """Recognise the files that begin with one of some bytes, unless these were packed."""
    return lambda head: head.start.startswith(marks) and not head.gzipped


def read_head(path: Path, time: TimeColumn | None = None) -> Head:
    """Look at the first bytes of the file `path`, or into the folder `path`.

    Parameters
    ----------
    time : what a channel map says of the column that holds the time

    Raises
    ------
    LogError
        when it is missing, cannot be opened, is neither file nor folder, is a broken gzip file, or stands for another
        file that Git LFS keeps elsewhere.
    """
    try:
        if not path.exists():
            raise LogError(f"{path}: no such file; expected a log (CSV, CSV.gz, Parquet, a bag, ...). Check the path.")
        if path.is_dir():
            return Head(path, b"", entries=tuple(sorted(entry.name for entry in path.iterdir())))
        if not path.is_file():
            # Opening a pipe that nobody writes to waits for ever.
            raise LogError(f"{path}: expected a file or a folder, got a pipe or a device. Save the log to a file.")
        with path.open("rb") as file:
            start = file.read(_HEAD_BYTES)
    except OSError as error:
        raise LogError(f"{path}: it cannot be opened ({error.strerror}). Check its permissions.") from error
    gzipped = start[:2] == b"\x1f\x8b"
    if gzipped:
        try:
            with gzip.open(path, "rb") as file:
                start = file.read(_HEAD_BYTES)
        except (OSError, EOFError, zlib.error) as error:
            raise LogError(f"{path}: a broken gzip file ({error}). Copy the log again.") from error
    check_pointer(start, path)
    return Head(path, start, gzipped, read_header(start), time=time)


def check_pointer(start: bytes, path: Path) -> None:
    """Refuse a Git LFS pointer, a text of three lines in the place of a file (git-lfs, docs/spec.md).

    Raises
    ------
    LogError
        with the size of the file that it stands for.
    """
    if start.startswith(b"version https://git-lfs.github.com/spec/"):
        size = re.search(rb"^size (\d+)", start, re.MULTILINE)
        text = f" of {int(size[1]) / 1e6:.3f} MB" if size else ""
        raise LogError(
            f"{path}: expected a log, got a Git LFS pointer: it stands for a file{text} that was not downloaded. Run "
            "'git lfs pull' in the repository, or download the file itself."
        )


class BrokenError(Exception):
    """The records of a file make no sense from here on: its reader stops there, and says so in a note."""


@contextmanager
def in_file(path: Path) -> Iterator[None]:
    """Say the file in an error about its content."""
    try:
        yield
    except LogError as error:
        told = error.typed
        raise LogError(told if told.startswith(str(path)) else f"{path}: {told}", error.mends) from error


def torn(done: int, total: int, why: str) -> str:
    """Say in a note that a file was read up to a break, at byte `done` of `total`.

    >>> torn(1_500_000, 2_000_000, "no index")
    'the file breaks off (no index): read up to there, 1.500 of 2.000 MB; what was recorded after it is lost'
    """
    read = f"{done / 1e6:.3f} of {total / 1e6:.3f} MB"
    return f"the file breaks off ({why}): read up to there, {read}; what was recorded after it is lost"


def some(names: Sequence[str], most: int = 12) -> str:
    """List names, not more than `most`."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return (", ".join(names[:most]) or "nothing") + more


def from_first(stamps: NDArray[np.int64], first: int) -> Array:
    """Seconds after `first` of the stamps [ns]; subtracting before the conversion keeps the nanoseconds."""
    return (stamps - first) / 1e9
