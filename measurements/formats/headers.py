"""Headers of tables: how a text table is written, its columns, and which of them holds the time in which unit."""

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...physics.motion import Array

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
