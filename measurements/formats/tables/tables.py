"""The two table shapes, long and wide, cut into streams; shared by the text and the Parquet readers."""

import gzip
import warnings
import zlib
from array import array
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ....physics.errors import LogError
from ....physics.file_marks import is_mark
from ....physics.frames import Array
from ....physics.printable import listed, shown
from ..base import EXPECTED, TIME_COLUMNS, Head, Name, Recording, Request, Stream, in_file
from ..unpacking import TableText, check_table

LONG = ("topic", "field", "value")
"""Columns of a long table beside the time."""
EPOCH = 1e8
"""A first stamp above this [s] counts from an epoch, not from the start of the log."""
_LAST = 2**63
"""No clock shows so many nanoseconds: a stamp beyond is broken."""
_MOST_COLUMNS = 10_000
"""Columns, or topics with their fields: a bag with everything in it has some thousand."""
LONG_ROW = 4
"""Numbers that a row of a long table takes in memory: time, value, and what sorts them."""
_HEADER = 2
"""Line of the first row, below the header."""
_PART = 2_000_000
"""Cells that are parsed at once, so that words in the place of numbers are not all in memory together."""


def time_column(columns: tuple[str, ...]) -> str | None:
    """Find the first column that holds the time, None when there is none."""
    return next((column for column in columns if column.lower() in TIME_COLUMNS), None)


def is_long(columns: tuple[str, ...]) -> bool:
    """Whether the columns are those of a flattened bag."""
    return time_column(columns) is not None and set(LONG) <= set(columns)


def is_wide(columns: tuple[str, ...]) -> bool:
    """Whether the columns are one time column and channels."""
    return time_column(columns) is not None and len(columns) > 1 and not is_long(columns)


def read_text(head: Head, request: Request) -> Recording:
    """Read a text table, long or wide, part by part, so that only its numbers are ever in memory together.

    Raises
    ------
    LogError
        when the text cannot be read as a table, has no rows, or is larger than any.
    """
    check_columns(head.columns, head.path)
    with _parts(head, request) as parts:
        cut = long_recording if is_long(head.columns) else wide_recording
        return _with_remarks(cut(parts, head.path), head)


@contextmanager
def _parts(head: Head, request: Request) -> Iterator[Iterator[pd.DataFrame]]:
    """The parts of a text table as frames with stripped column names; topic and field as categories."""
    long = is_long(head.columns)
    text = TableText(head.path, head.gzipped)
    try:
        with warnings.catch_warnings(), in_file(head.path), text:
            warnings.simplefilter("error", pd.errors.ParserWarning)
            text.look_through(head.separator)
            # A column of numbers and words; what is no number becomes NaN below.
            warnings.simplefilter("ignore", pd.errors.DtypeWarning)
            parts = pd.read_csv(
                text,  # type: ignore[arg-type]
                sep=head.separator,
                encoding="utf-8-sig",
                skiprows=len(head.remarks),
                header=0,
                names=list(_unique(head.columns)),
                dtype=dict.fromkeys(("topic", "field"), "category") if long else None,  # type: ignore[arg-type]
                index_col=False,
                skipinitialspace=f"{head.separator} ".encode() in head.start,
                chunksize=max(_PART // len(head.columns), 1),
            )
            yield _counted(parts, LONG_ROW if long else len(head.columns), text, request)
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        if text.refusal is not None:
            raise LogError(f"{head.path}: {text.refusal}") from error
        raise LogError(f"{head.path}: not a readable table ({error}); {EXPECTED}.") from error
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise LogError(f"{head.path}: a broken gzip file ({error}). Copy the log again.") from error


def check_columns(columns: tuple[str, ...], path: object) -> None:
    """Refuse a table with more columns than any log has.

    Raises
    ------
    LogError
        telling how many there are.
    """
    if len(columns) > _MOST_COLUMNS:
        raise LogError(f"{path}: expected a table of at most {_MOST_COLUMNS} columns, got {len(columns)}.")


def _counted(parts: Iterable[pd.DataFrame], width: int, text: TableText, request: Request) -> Iterator[pd.DataFrame]:
    """The parts of a table, whose cells become numbers but for the time, topic and field, as they are read.

    Parameters
    ----------
    width : numbers that a row takes in memory
    """
    rows = 0
    for part in parts:
        rows += len(part)
        check_table(rows * width, text.packed)
        request.progress(*text.done)
        time = time_column(tuple(part.columns))
        for name in part.columns:
            column = part[name]
            words = not isinstance(column.dtype, pd.CategoricalDtype) and not pd.api.types.is_numeric_dtype(column)
            if name != time and words:
                part[name] = _numbers(column.astype("category"))  # each word is looked at once
        if len(part):
            yield part
    if not rows:
        raise LogError("a header but no rows; the log is empty. Was the recording stopped at once?")


def long_recording(parts: Iterable[pd.DataFrame], path: object) -> Recording:
    """Cut a long table (time, topic, field, value), given in parts, into one stream per topic and field.

    Fields of one message come at the same instants; their streams share one array of stamps.
    """
    column = _TimeColumn(path)
    found: defaultdict[tuple[str, str], _Rows] = defaultdict(_Rows)
    done = 0
    for part in parts:
        stamps, value, earlier = column.take(part), _numbers(part["value"]), np.zeros(0)
        for label, rows in _by_name(part, path):
            earlier = _shared(earlier, stamps[rows])
            found[label].add(earlier, value[rows], rows + (done + _HEADER))
        _check_fields(len(found), path)
        done += len(part)
    streams: list[Stream] = []
    for (topic, name), rows in sorted(found.items(), key=lambda item: item[0]):
        time = column.seconds(np.concatenate(rows.stamps))
        time = _shared(streams[-1].time, time) if streams else time
        value, line = np.frombuffer(rows.value), np.frombuffer(rows.line, dtype=np.int64)
        streams.append(Stream(topic.strip(), name.strip(), time, value, line))
    return Recording(tuple(streams), column.notes, start_ns=column.start_ns)


@dataclass(slots=True)
class _Rows:
    """The rows of a stream of a long table: stamps part by part, values and lines in memory that grows with them."""

    stamps: list[NDArray[Any]] = field(default_factory=list)
    value: "array[float]" = field(default_factory=lambda: array("d"))
    line: "array[int]" = field(default_factory=lambda: array("q"))

    def add(self, stamps: NDArray[Any], value: Array, line: NDArray[np.int64]) -> None:
        """Take the rows of a part."""
        self.stamps.append(stamps)
        self.value.frombytes(value.tobytes())
        self.line.frombytes(line.tobytes())


def _shared(earlier: NDArray[Any], later: NDArray[Any]) -> NDArray[Any]:
    """One array in the place of two that are equal."""
    return earlier if np.array_equal(earlier, later) else later


def _by_name(part: pd.DataFrame, path: object) -> Iterator[tuple[tuple[str, str], NDArray[np.int64]]]:
    """The rows of each field of a topic in a part of a long table; rows that name no field are none's."""
    topic, name = part["topic"].astype("category").cat, part["field"].astype("category").cat
    fields = len(name.categories)
    # Numbers of two bytes are sorted ten times as fast.
    most = (len(topic.categories) + 1) * (fields + 1)
    key = (topic.codes.to_numpy(np.int64) + 1) * (fields + 1) + name.codes.to_numpy(np.int64) + 1
    order = np.argsort(key.astype(np.int16) if most < 2**15 else key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    _check_fields(starts.size, path)
    for rows in np.split(order, starts[1:]):
        if not rows.size:
            continue
        which_topic, which_field = divmod(int(key[rows[0]]), fields + 1)
        if which_field:
            told = str(topic.categories[which_topic - 1]) if which_topic else ""
            yield (told, str(name.categories[which_field - 1])), rows


def _check_fields(count: int, path: object) -> None:
    if count > _MOST_COLUMNS:
        raise LogError(f"{path}: expected a long table of at most {_MOST_COLUMNS} fields of topics, got {count}.")


def wide_recording(parts: Iterable[pd.DataFrame], path: object, unread: tuple[Name, ...] = ()) -> Recording:
    """Cut a wide table (one row per time stamp), given in parts, into one stream per column.

    Parameters
    ----------
    unread : columns that it lacks
    """
    column = _TimeColumn(path)
    stamps: list[NDArray[Any]] = []
    pieces: dict[str, list[Array]] = {}
    for part in parts:
        stamps.append(column.take(part))
        for name in part.columns:
            if name != column.name:
                pieces.setdefault(str(name), []).append(_numbers(part[name]))
    time = column.seconds(np.concatenate(stamps))
    row = np.arange(time.size, dtype=np.int64) + _HEADER
    streams = [Stream("", name, time, np.concatenate(pieces.pop(name)), row) for name in list(pieces)]
    return Recording(tuple(streams), column.notes, unread, column.start_ns)


def _with_remarks(recording: Recording, head: Head) -> Recording:
    """Put the remarks above a table among its notes, but not the mark of the verb that wrote it."""
    notes = tuple(text for text in head.remarks if not is_mark(text))
    return replace(recording, notes=(*notes, *recording.notes)) if notes else recording


def _unique(columns: tuple[str, ...]) -> tuple[str, ...]:
    seen: dict[str, int] = {}
    names = []
    for column in columns:
        count = seen.get(column, 0)
        seen[column] = count + 1
        names.append(f"{column}.{count}" if count else column)
    return tuple(names)


def _numbers(column: pd.Series) -> Array:
    if column.dtype == bool:
        return column.to_numpy(float)
    if isinstance(column.dtype, pd.CategoricalDtype):
        numbers = np.append(_numbers(pd.Series(column.cat.categories)), np.nan)
        return numbers[column.cat.codes.to_numpy()]
    numbers = np.asarray(pd.to_numeric(column, errors="coerce"), dtype=float)
    return np.where(np.isfinite(numbers), numbers, np.nan)


class _TimeColumn:
    """The time column of a table that is read in parts.

    Attributes
    ----------
    name : of the column; known once a part was taken
    """

    def __init__(self, path: object) -> None:
        self.name = ""
        self._path, self._firsts, self._cell = path, [], ""
        self._per_second = 1e9

    def take(self, part: pd.DataFrame) -> NDArray[Any]:
        """The stamps of a part as the file has them, in whole numbers where it has such."""
        name = time_column(tuple(part.columns))
        if name is None:
            raise LogError(f"{self._path}: no time column among {listed(part.columns)}; {EXPECTED}.")
        column = part[name]
        clock = {"M": "datetime64[ns]", "m": "timedelta64[ns]"}.get(getattr(column.dtype, "kind", ""))
        if clock is not None:
            stamps: NDArray[Any] = column.to_numpy(clock).astype(np.int64)
            if column.hasnans:
                stamps = np.where(column.isna(), np.nan, stamps)
        else:
            integer = pd.api.types.is_integer_dtype(column) and not column.hasnans and column.max() < _LAST
            stamps = column.to_numpy(np.int64, copy=True) if integer else _numbers(column)
            stamps = stamps if integer else np.where(stamps < _LAST, stamps, np.nan)
            self._per_second = TIME_COLUMNS[name.lower()]
        self.name, self._cell = name, self._cell or shown(column.iloc[0])
        self._firsts.append(np.fmin.reduce(stamps))
        return stamps

    @property
    def _first(self) -> Any:
        """The smallest stamp of all parts."""
        first = np.fmin.reduce(self._firsts)
        if np.isnan(first):
            raise LogError(f"{self._path}: column '{self.name}' holds no numbers, got {self._cell}; {EXPECTED}.")
        return first

    @property
    def _from_first(self) -> bool:
        """Whether the time counts from the first stamp, for it counts from an epoch in the file."""
        return bool(self._first / self._per_second >= EPOCH)

    @property
    def notes(self) -> tuple[str, ...]:
        """A note where the time's zero is not the file's own."""
        told = f"time counts from the first stamp, {self.name} = {self._first}"
        return (told,) if self._from_first else ()

    @property
    def start_ns(self) -> int:
        """The file's stamp of the zero of the time [ns]."""
        if not self._from_first:
            return 0
        first, scale = self._first, int(1e9 / self._per_second)
        start = int(first) * scale + round((first - int(first)) * scale)
        return start if start < _LAST else 0

    def seconds(self, stamps: NDArray[Any]) -> Array:
        """The time of stamps [s], known once all parts were taken."""
        # Subtracting before the conversion to seconds keeps the nanoseconds of stamps since 1970.
        found: Array = (stamps - self._first if self._from_first else stamps) / self._per_second
        return found
