"""Text tables: long ones (a bag flattened to time, topic, field, value) and wide ones (a row per time stamp).

pandas reads them part by part.
"""

import gzip
import warnings
import zlib
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import replace
from typing import TYPE_CHECKING

from ....physics.errors import LogError
from ....physics.files import is_mark
from ..base import EXPECTED, Format, Head, Recording, Request, TimeColumn, in_file
from ..unpacking import TableText, check_table
from .tables import LONG_ROW, check_columns, is_long, is_wide, long_recording, numbers_of, wide_recording

if TYPE_CHECKING:
    import pandas as pd


_PART = 2_000_000
"""Cells that are parsed at once, so that words in the place of numbers are not all in memory together."""


def _parts(head: Head, names: tuple[str, ...], clock: TimeColumn, request: Request) -> "Generator[pd.DataFrame]":
    """The parts of a text table with columns of these names, whose cells are numbers but for time, topic and field."""
    import pandas as pd

    how, rows = head.text, 0
    long, instants = is_long(how.columns, clock), {clock.name, clock.date}
    text = TableText(head.path, head.gzipped)
    try:
        with warnings.catch_warnings(), in_file(head.path), text:
            warnings.simplefilter("error", pd.errors.ParserWarning)
            text.look_through(how.separator)
            # A column of numbers and words; what is no number becomes NaN below.
            warnings.simplefilter("ignore", pd.errors.DtypeWarning)
            for part in pd.read_csv(
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
            ):
                rows += len(part)
                check_table(rows * (LONG_ROW if long else len(names)), text.packed)
                request.progress(*text.done)
                for name, column in part.items():
                    words = column.dtype != "category" and not pd.api.types.is_numeric_dtype(column)
                    if words and name not in instants:
                        part[name] = numbers_of(column.astype("category"))  # each word is looked at once
                if len(part):
                    yield part
            if not rows:
                raise LogError("a header but no rows; the log is empty. Was the recording stopped at once?")
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        if text.refusal is not None:
            raise LogError(f"{head.path}: {text.refusal}") from error
        raise LogError(f"{head.path}: not a readable table ({error}); {EXPECTED}.") from error
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise LogError(f"{head.path}: a broken gzip file ({error}). Copy the log again.") from error


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
    with closing(_parts(head, names, clock, request)) as parts:
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
