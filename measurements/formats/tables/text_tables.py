"""Text tables: long ones (a bag flattened to time, topic, field, value) and wide ones (a row per time stamp).

Small ones of numbers are read by Arrow, which loads five times faster, all others by pandas.
"""

import gzip
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....physics.errors import LogError, shown
from ....physics.files import is_mark
from ....physics.motion import Array
from ..base import EXPECTED, Format, Head, Recording, Request, TimeColumn, in_file
from ..unpacking import TableText, check_table
from .tables import LAST, LONG_ROW, Stamps, Words, check_columns, is_long, is_wide, long_recording, wide_recording

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


_SMALL = 2**24
"""Bytes of a file up to which the time to load a library counts more than memory and parsing."""
_NO_WORDS = frozenset({"na", "n/a", "nan", "none", "null"})
"""What pandas takes for a missing word, beside those that begin with no letter."""


@dataclass(frozen=True, slots=True)
class ArrowPart:
    """A whole table; see `Part`. `size` is that of its text [B]."""

    table: "pa.Table"
    size: int

    @property
    def columns(self) -> tuple[str, ...]:
        """See `Part`."""
        return tuple(self.table.column_names)

    def __len__(self) -> int:
        return self.table.num_rows

    def numbers(self, name: str) -> Array:
        """See `Part`."""
        column = self.table.column(name)
        if column.null_count == len(column):
            return np.full(len(column), np.nan)
        numbers, known = _values(column.combine_chunks())
        return np.where(known & np.isfinite(numbers), numbers, np.nan)

    def words(self, name: str) -> Words:
        """See `Part`."""
        column: Any = self.table.column(name).combine_chunks()
        return Words(tuple(column.dictionary.to_pylist()), _values(column.indices)[0].astype(np.int64))

    def stamps(self, clock: TimeColumn) -> Stamps:
        """See `Part`."""
        values = _values(self.table.column(clock.name).combine_chunks())[0]
        if values.dtype.kind == "f":
            values = np.where(np.isfinite(values) & (values < LAST), values, np.nan)
        return Stamps(values, False, shown(values[0]))


def _values(column: Any) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """The numbers of an array of Arrow (n,), and which of them there are; its own conversion would load pandas."""
    missing, numbers = column.buffers()
    rows = slice(column.offset, column.offset + len(column))
    values = np.frombuffer(numbers, dtype={"double": "f8"}.get(str(column.type), str(column.type)))[rows]
    if missing is None:
        return values, np.ones(len(column), bool)
    return values, np.unpackbits(np.frombuffer(missing, np.uint8), bitorder="little")[rows].astype(bool)


def small_table(head: Head, names: tuple[str, ...], clock: TimeColumn) -> ArrowPart | None:
    """A text table whose columns have these names; None where it takes pandas to tell what it holds.

    That is where it is packed or large, has words or nothing where numbers belong, or does not keep its form.
    """
    how = head.text
    plain = how.decimal == "." and how.encoding != "utf-16" and how.separator != " " and clock.date is None
    if head.gzipped or not plain or f"{how.separator} ".encode() in head.start:
        return None
    with in_file(head.path):
        text = head.path.read_bytes() if head.path.stat().st_size <= _SMALL else b""
    if not text or b"0x" in text or b"0X" in text:  # hexadecimal numbers are none elsewhere
        return None
    try:
        import pyarrow as pa
        from pyarrow import csv
    except ImportError:
        return None
    words = ("topic", "field") if is_long(how.columns, clock) else ()
    try:
        table = csv.read_csv(
            pa.BufferReader(text),
            csv.ReadOptions(use_threads=False, block_size=_SMALL + 1, skip_rows=how.above, column_names=list(names)),
            csv.ParseOptions(delimiter=how.separator),
            csv.ConvertOptions(column_types=dict.fromkeys(words, pa.dictionary(pa.int32(), pa.string()))),
        )
    except pa.ArrowInvalid:
        return None
    part = ArrowPart(table, len(text))
    return part if table.num_rows and _is_plain(part, words, clock.name) else None


def _is_plain(part: ArrowPart, words: tuple[str, ...], time: str) -> bool:
    """True when there are numbers in all columns but those of words, and no word is one that may stand for none."""
    import pyarrow as pa

    numbers = (pa.int64(), pa.float64(), pa.null())
    if part.table.column(time).null_count:
        return False
    columns = zip(part.columns, part.table.columns, strict=True)
    if any(column.type not in numbers for name, column in columns if name not in words):
        return False
    told = [word for name in words for word in part.words(name).names]
    return all((word[:1].isalpha() or word[:1] in {"/", "_"}) and word.lower() not in _NO_WORDS for word in told)


_PART = 2_000_000
"""Cells that are parsed at once, so that words in the place of numbers are not all in memory together."""


@dataclass(frozen=True, slots=True)
class FramePart:
    """A frame as a part of a table; see `Part`."""

    frame: "pd.DataFrame"

    @property
    def columns(self) -> tuple[str, ...]:
        """See `Part`."""
        return tuple(map(str, self.frame.columns))

    def __len__(self) -> int:
        return len(self.frame)

    def numbers(self, name: str) -> Array:
        """See `Part`."""
        return _numbers(self.frame[name])

    def words(self, name: str) -> Words:
        """See `Part`."""
        column = self.frame[name].astype("category").cat
        return Words(tuple(map(str, column.categories)), np.asarray(column.codes, dtype=np.int64))

    def stamps(self, clock: TimeColumn) -> Stamps:
        """See `Part`."""
        import pandas as pd

        column = self.frame[clock.name]
        if isinstance(column.dtype, pd.CategoricalDtype):
            column = column.astype(column.cat.categories.dtype)
        cell, daily = shown(column.iloc[0]), False
        words = not pd.api.types.is_numeric_dtype(column) and pd.api.types.is_string_dtype(column)
        if words and not np.isfinite(_numbers(column)).any():
            column, daily = _instants(column, None if clock.date is None else self.frame[clock.date])
        kind = {"M": "datetime64[ns]", "m": "timedelta64[ns]"}.get(getattr(column.dtype, "kind", ""))
        if kind is not None:
            stamps: NDArray[Any] = column.to_numpy(kind).astype(np.int64)
            if column.hasnans:
                stamps = np.where(column.isna(), np.nan, stamps)
        else:
            integer = pd.api.types.is_integer_dtype(column) and not column.hasnans and column.max() < LAST
            stamps = column.to_numpy(np.int64, copy=True) if integer else _numbers(column)
            stamps = stamps if integer else np.where(stamps < LAST, stamps, np.nan)
        return Stamps(stamps, kind is not None, cell, daily)


def _instants(time: "pd.Series", date: "pd.Series | None") -> "tuple[pd.Series, bool]":
    """Instants that are written in words, and whether they begin anew at midnight; NaT where a word is none.

    ISO 8601 with or without a zone, and what else pandas knows; a date with points has the day first (DIN 5008). With a
    date in a column of its own, the other one is the time of day; alone, it counts from midnight.
    """
    import pandas as pd

    words = time.astype("string").str.strip().str.replace(",", ".")
    hours = words.str.fullmatch(r"\d{1,2}:\d\d(:\d\d(\.\d*)?)?").fillna(False)
    if date is None and hours.any():
        words = words.where(~words.str.fullmatch(r"\d{1,2}:\d\d").fillna(False), words + ":00")
        return pd.to_timedelta(words.where(hours), errors="coerce"), True
    if date is not None:
        words = date.astype("string").str.strip() + " " + words
    found = pd.to_datetime(words, format="ISO8601", utc=True, errors="coerce")
    if found.isna().all():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what it tells of a form that it had to guess
            points = bool(words.str.match(r"\d{1,2}\.\d").fillna(False).any())
            found = pd.to_datetime(words, dayfirst=points, utc=True, errors="coerce")
    return found, False


@contextmanager
def text_parts(
    head: Head, names: tuple[str, ...], clock: TimeColumn, request: Request
) -> Iterator[Iterator[FramePart]]:
    """The parts of a text table with columns of these names, one after the other.

    Raises
    ------
    LogError
        when the text cannot be read as a table, has no rows, or is larger than any.
    """
    import pandas as pd

    how = head.text
    long = is_long(how.columns, clock)
    text = TableText(head.path, head.gzipped)
    try:
        with warnings.catch_warnings(), in_file(head.path), text:
            warnings.simplefilter("error", pd.errors.ParserWarning)
            text.look_through(how.separator)
            # A column of numbers and words; what is no number becomes NaN below.
            warnings.simplefilter("ignore", pd.errors.DtypeWarning)
            parts = pd.read_csv(
                text,  # type: ignore[arg-type]
                sep=r"\s+" if how.separator == " " else how.separator,
                decimal=how.decimal,
                encoding=how.encoding,
                skiprows=how.above,
                header=None,
                names=list(names),
                dtype=dict.fromkeys(("topic", "field"), "category") if long else None,  # type: ignore[arg-type]
                index_col=False,
                skipinitialspace=f"{how.separator} ".encode() in head.start,
                chunksize=max(_PART // len(names), 1),
            )
            words = (clock.name, *([clock.date] if clock.date else []))
            yield _counted(parts, LONG_ROW if long else len(names), text, words, request)
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        if text.refusal is not None:
            raise LogError(f"{head.path}: {text.refusal}") from error
        raise LogError(f"{head.path}: not a readable table ({error}); {EXPECTED}.") from error
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise LogError(f"{head.path}: a broken gzip file ({error}). Copy the log again.") from error


def _counted(
    parts: Iterable["pd.DataFrame"], width: int, text: TableText, instants: Sequence[str], request: Request
) -> Iterator[FramePart]:
    """The parts of a table, whose cells become numbers but for the time, topic and field, as they are read.

    Parameters
    ----------
    width : numbers that a row takes in memory
    instants : the columns of the time
    """
    import pandas as pd

    rows = 0
    for part in parts:
        rows += len(part)
        check_table(rows * width, text.packed)
        request.progress(*text.done)
        for name in part.columns:
            column = part[name]
            words = not isinstance(column.dtype, pd.CategoricalDtype) and not pd.api.types.is_numeric_dtype(column)
            if name not in instants and words:
                part[name] = _numbers(column.astype("category"))  # each word is looked at once
        if len(part):
            yield FramePart(part)
    if not rows:
        raise LogError("a header but no rows; the log is empty. Was the recording stopped at once?")


def _numbers(column: "pd.Series") -> Array:
    import pandas as pd

    if column.dtype == bool:
        return column.to_numpy(float)
    if isinstance(column.dtype, pd.CategoricalDtype):
        numbers = np.append(_numbers(pd.Series(column.cat.categories)), np.nan)
        return numbers[column.cat.codes.to_numpy()]
    numbers = np.asarray(pd.to_numeric(column, errors="coerce"), dtype=float)
    return np.where(np.isfinite(numbers), numbers, np.nan)


def read_text(head: Head, request: Request) -> Recording:
    """Read a text table, long or wide, part by part, so that only its numbers are ever in memory together.

    Raises
    ------
    LogError
        when the text cannot be read as a table, has no rows, or is larger than any.
    """
    columns, clock = head.text.columns, head.clock
    assert clock is not None  # else it is no table
    check_columns(columns, head.path)
    cut = long_recording if is_long(columns, clock) else wide_recording
    names = _unique(columns)
    small = small_table(head, names, clock)
    if small is not None:
        request.progress(small.size, small.size)
        return _with_remarks(cut([small], head.path, clock), head)
    with text_parts(head, names, clock, request) as parts:
        return _with_remarks(cut(parts, head.path, clock), head)


def _with_remarks(recording: Recording, head: Head) -> Recording:
    """Put the remarks above a table among its notes, but not the mark of the verb that wrote it."""
    notes = tuple(text for text in head.text.remarks if not is_mark(text))
    return replace(recording, notes=(*notes, *recording.notes)) if notes else recording


def _unique(columns: tuple[str, ...]) -> tuple[str, ...]:
    seen: dict[str, int] = {}
    names = []
    for column in columns:
        count = seen.get(column, 0)
        seen[column] = count + 1
        names.append(f"{column}.{count}" if count else column)
    return tuple(names)


def _of_shape(shape: Callable[[Sequence[str], TimeColumn | None], bool]) -> Callable[[Head], bool]:
    return lambda head: shape(head.text.columns, head.clock)


LONG_CSV = Format("long CSV", _of_shape(is_long), read_text, (".csv", ".gz"), marked=False, table=True)
WIDE_CSV = Format("wide CSV", _of_shape(is_wide), read_text, (".csv", ".gz"), marked=False, table=True)
