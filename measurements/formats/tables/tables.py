"""The two table shapes, long and wide, cut into streams; shared by the text and the Parquet readers."""

import gzip
import warnings
import zlib
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ....physics.errors import LogError
from ....physics.file_marks import is_mark
from ....physics.frames import Array
from ....physics.printable import listed, shown
from ..base import EXPECTED, TIME_COLUMNS, Head, Name, Recording, Stream, in_file
from ..unpacking import TableText, check_table

LONG = ("topic", "field", "value")
"""Columns of a long table beside the time."""
_EPOCH = 1e8
"""A first stamp above this [s] counts from an epoch, not from the start of the log."""
_LAST = 2**63
"""No clock shows so many nanoseconds: a stamp beyond is broken."""
_MOST_COLUMNS = 10_000
"""Columns, or topics with their fields: a bag with everything in it has some thousand."""
LONG_ROW = 4
"""Numbers that a row of a long table takes in memory: time, value, and what sorts them."""
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


def read_text(head: Head) -> pd.DataFrame:
    """Read the text table as a frame with stripped column names; topic and field as categories.

    Raises
    ------
    LogError
        when the text cannot be read as a table, or is larger than any.
    """
    check_columns(head.columns, head.path)
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
            packed = head.path.stat().st_size if head.gzipped else None
            frame = _joined(parts, LONG_ROW if long else len(head.columns), packed)
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        if text.refusal is not None:
            raise LogError(f"{head.path}: {text.refusal}") from error
        raise LogError(f"{head.path}: not a readable table ({error}); {EXPECTED}.") from error
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise LogError(f"{head.path}: a broken gzip file ({error}). Copy the log again.") from error
    if frame.empty:
        raise LogError(f"{head.path}: a header but no rows; the log is empty. Was the recording stopped at once?")
    return frame


def check_columns(columns: tuple[str, ...], path: object) -> None:
    """Refuse a table with more columns than any log has.

    Raises
    ------
    LogError
        telling how many there are.
    """
    if len(columns) > _MOST_COLUMNS:
        raise LogError(f"{path}: expected a table of at most {_MOST_COLUMNS} columns, got {len(columns)}.")


def _joined(parts: Iterable[pd.DataFrame], width: int, packed: int | None) -> pd.DataFrame:
    """The parts of a table as one, whose cells are numbers but for the time, topic and field.

    Parameters
    ----------
    width : numbers that a row takes in memory
    packed : bytes of the file, where it is packed
    """
    known: dict[str, dict[Any, int]] = {}
    done: list[pd.DataFrame] = []
    rows = 0
    for part in parts:
        rows += len(part)
        check_table(rows * width, packed)
        time = time_column(tuple(part.columns))
        for name in part.columns:
            column = part[name]
            if isinstance(column.dtype, pd.CategoricalDtype):
                part[name] = _numbered(column, known.setdefault(name, {}))
            elif name != time and not pd.api.types.is_numeric_dtype(column):
                part[name] = _numbers(column.astype("category"))  # each word is looked at once
        done.append(part)
    frame = pd.concat(done, ignore_index=True) if len(done) != 1 else done[0]
    for name, codes in known.items():
        words = sorted(codes, key=str)
        places = {word: place for place, word in enumerate(words)}
        place = np.array([*(places[word] for word in codes), -1], dtype=np.int32)
        frame[name] = pd.Categorical.from_codes(place[frame[name].to_numpy()], dtype=pd.CategoricalDtype(words))
    return frame


def _numbered(column: pd.Series, known: dict[Any, int]) -> NDArray[np.int32]:
    """The words of a part of a column as numbers in the order in which `known` has met them; -1 for none."""
    for word in column.cat.categories:
        known.setdefault(word, len(known))
    if len(known) > _MOST_COLUMNS:
        raise LogError(f"expected a long table of at most {_MOST_COLUMNS} topics and fields, got more")
    codes = np.array([*(known[word] for word in column.cat.categories), -1], dtype=np.int32)
    return codes[column.cat.codes.to_numpy()]


def long_recording(frame: pd.DataFrame, path: object) -> Recording:
    """Cut a long table (time, topic, field, value) into one stream per topic and field."""
    time, start, notes = _seconds(frame, path)
    value = _numbers(frame["value"])
    topic, field = frame["topic"].astype("category").cat, frame["field"].astype("category").cat
    fields = len(field.categories)
    key = (topic.codes.to_numpy(np.int64) + 1) * (fields + 1) + field.codes.to_numpy(np.int64) + 1
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    if starts.size > _MOST_COLUMNS:
        raise LogError(f"{path}: expected a long table of at most {_MOST_COLUMNS} fields of topics, got {starts.size}.")
    streams = []
    for rows in np.split(order, starts[1:]):
        which_topic, which_field = divmod(int(key[rows[0]]), fields + 1)
        if which_field == 0:
            continue
        name = str(topic.categories[which_topic - 1]) if which_topic else ""
        streams.append(
            Stream(name.strip(), str(field.categories[which_field - 1]).strip(), time[rows], value[rows], rows + 2)
        )
    return Recording(tuple(streams), notes, start_ns=start)


def wide_recording(frame: pd.DataFrame, path: object, unread: tuple[Name, ...] = ()) -> Recording:
    """Cut a wide table (one row per time stamp) into one stream per column; `unread` are columns that it lacks."""
    time, start, notes = _seconds(frame, path)
    row = np.arange(len(frame), dtype=np.int64) + 2
    own = time_column(tuple(frame.columns))
    streams = [Stream("", str(name), time, _numbers(frame[name]), row) for name in frame.columns if name != own]
    return Recording(tuple(streams), notes, unread, start)


def with_remarks(recording: Recording, head: Head) -> Recording:
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


def _seconds(frame: pd.DataFrame, path: object) -> tuple[Array, int, tuple[str, ...]]:
    """Time of each row [s], the stamp at its zero [ns], and a note where that is not the file's own zero."""
    name = time_column(tuple(frame.columns))
    if name is None:
        raise LogError(f"{path}: no time column among {listed(frame.columns)}; {EXPECTED}.")
    column = frame[name]
    clock = {"M": "datetime64[ns]", "m": "timedelta64[ns]"}.get(getattr(column.dtype, "kind", ""))
    if clock is not None:
        stamps: NDArray = column.to_numpy(clock).astype(np.int64)
        if column.hasnans:
            stamps = np.where(column.isna(), np.nan, stamps)
        per_second = 1e9
    else:
        integer = pd.api.types.is_integer_dtype(column) and not column.hasnans and column.max() < _LAST
        stamps = column.to_numpy(np.int64) if integer else _numbers(column)
        stamps = stamps if integer else np.where(stamps < _LAST, stamps, np.nan)
        per_second = TIME_COLUMNS[name.lower()]
    finite = stamps[np.isfinite(stamps)]
    if finite.size == 0:
        raise LogError(f"{path}: column '{name}' holds no numbers, got {shown(column.iloc[0])}; {EXPECTED}.")
    first = finite.min()
    if first / per_second < _EPOCH:
        return stamps / per_second, 0, ()
    # Subtracting before the conversion to seconds keeps the nanoseconds of stamps since 1970.
    scale = int(1e9 / per_second)
    start = int(first) * scale + round((first - int(first)) * scale)
    start = start if start < _LAST else 0
    return (stamps - first) / per_second, start, (f"time counts from the first stamp, {name} = {first}",)
