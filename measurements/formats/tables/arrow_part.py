"""Small text tables of nothing but numbers as Arrow reads them, in a fifth of the time in which pandas is loaded."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....physics.errors import shown
from ....physics.motion import Array
from ..base import Head, in_file
from ..time_columns import TimeColumn
from .tables import LAST, Stamps, Words, is_long

if TYPE_CHECKING:
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
            csv.ReadOptions(
                use_threads=False,
                block_size=_SMALL + 1,
                skip_rows=how.above,
                column_names=list(names),
            ),
            csv.ParseOptions(delimiter=how.separator),
            csv.ConvertOptions(column_types=dict.fromkeys(words, pa.dictionary(pa.int32(), pa.string()))),
        )
    except pa.ArrowInvalid:
        return None
    part = ArrowPart(table, len(text))
    return part if table.num_rows and _is_plain(part, words, clock.name) else None


def _is_plain(part: ArrowPart, words: tuple[str, ...], time: str) -> bool:
    """Whether there are numbers in all columns but those of words, and no word is one that may stand for none."""
    import pyarrow as pa

    numbers = (pa.int64(), pa.float64(), pa.null())
    if part.table.column(time).null_count:
        return False
    columns = zip(part.columns, part.table.columns, strict=True)
    if any(column.type not in numbers for name, column in columns if name not in words):
        return False
    told = [word for name in words for word in part.words(name).names]
    return all((word[:1].isalpha() or word[:1] in {"/", "_"}) and word.lower() not in _NO_WORDS for word in told)
