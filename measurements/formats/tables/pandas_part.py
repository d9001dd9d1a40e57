"""Tables as pandas reads them: whatever a text table holds, and any frame.

It is loaded where it is needed, for that takes a third of a second.
"""

import gzip
import warnings
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....physics.errors import LogError, shown
from ....physics.motion import Array
from ..base import EXPECTED, Head, Request, in_file
from ..time_columns import TimeColumn
from ..unpacking import TableText, check_table
from .tables import LAST, LONG_ROW, Stamps, Words, is_long

if TYPE_CHECKING:
    import pandas as pd

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
