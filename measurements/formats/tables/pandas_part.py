"""Tables as pandas reads them: whatever a text table holds, and any frame.

It is loaded where it is needed, for that takes a third of a second.
"""

import gzip
import warnings
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....physics.errors import LogError
from ....physics.frames import Array
from ....physics.printable import shown
from ..base import EXPECTED, Head, Request, in_file
from ..unpacking import TableText, check_table
from .tables import LAST, LONG_ROW, Stamps, Words, is_long, time_column

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

    def stamps(self, name: str) -> Stamps:
        """See `Part`."""
        import pandas as pd

        column = self.frame[name]
        clock = {"M": "datetime64[ns]", "m": "timedelta64[ns]"}.get(getattr(column.dtype, "kind", ""))
        if clock is not None:
            stamps: NDArray[Any] = column.to_numpy(clock).astype(np.int64)
            if column.hasnans:
                stamps = np.where(column.isna(), np.nan, stamps)
        else:
            integer = pd.api.types.is_integer_dtype(column) and not column.hasnans and column.max() < LAST
            stamps = column.to_numpy(np.int64, copy=True) if integer else _numbers(column)
            stamps = stamps if integer else np.where(stamps < LAST, stamps, np.nan)
        return Stamps(stamps, clock is not None, shown(column.iloc[0]))


@contextmanager
def text_parts(head: Head, names: tuple[str, ...], request: Request) -> Iterator[Iterator[FramePart]]:
    """The parts of a text table with columns of these names, one after the other.

    Raises
    ------
    LogError
        when the text cannot be read as a table, has no rows, or is larger than any.
    """
    import pandas as pd

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
                names=list(names),
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


def _counted(parts: Iterable["pd.DataFrame"], width: int, text: TableText, request: Request) -> Iterator[FramePart]:
    """The parts of a table, whose cells become numbers but for the time, topic and field, as they are read.

    Parameters
    ----------
    width : numbers that a row takes in memory
    """
    import pandas as pd

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
