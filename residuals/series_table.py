"""The rows of `series.csv` in memory, by their columns, without the half second that loading pandas would take."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, BinaryIO, overload

import numpy as np
from numpy.typing import NDArray

from ..physics.frames import Array

if TYPE_CHECKING:
    import pandas as pd

_AT_ONCE = 20_000
"""Rows that are text at one time: those of a long log never are together."""


@dataclass(frozen=True, slots=True, eq=False)
class SeriesTable:
    """Columns (n,) by name, all of one length."""

    columns: Mapping[str, NDArray[Any]]

    @classmethod
    def of(cls, frame: "pd.DataFrame") -> "SeriesTable":
        """The columns of a frame, as `RunFolder.series` has them."""
        found = {str(name): frame[name].to_numpy() for name in frame.columns}
        whole = {name for name, column in found.items() if column.dtype.kind in "iu" and name != "log"}
        return cls({name: column.astype(float) if name in whole else column for name, column in found.items()})

    def __len__(self) -> int:
        return next((column.size for column in self.columns.values()), 0)

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    @overload
    def __getitem__(self, wanted: str) -> NDArray[Any]: ...

    @overload
    def __getitem__(self, wanted: Sequence[str]) -> Array: ...

    def __getitem__(self, wanted: str | Sequence[str]) -> NDArray[Any]:
        """The column of a name (n,), or those of several as numbers (n, names)."""
        if isinstance(wanted, str):
            return self.columns[wanted]
        none = np.zeros((len(self), 0))
        return np.column_stack([none, *(self.columns[name].astype(float, copy=False) for name in wanted)])

    def rows(self, wanted: NDArray[Any] | slice) -> "SeriesTable":
        """Some of the rows."""
        return SeriesTable({name: column[wanted] for name, column in self.columns.items()})

    def frame(self) -> "pd.DataFrame":
        """The same as a frame of pandas, without a copy."""
        import pandas as pd

        return pd.DataFrame(dict(self.columns), copy=False)

    def write(self, stream: BinaryIO) -> None:
        """Write all as comma-separated text with a header; a number that is missing is an empty cell."""
        text = TextIOWrapper(stream, "utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for first in range(0, len(self), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            writer.writerows(zip(*(_cells(column[part]) for column in self.columns.values()), strict=True))
        text.detach()  # what remains is written, and the stream stays open


def _cells(column: NDArray[Any]) -> Sequence[object]:
    cells: list[object] = column.tolist()
    if column.dtype.kind == "f" and np.isnan(column).any():
        return ["" if cell != cell else cell for cell in cells]
    return cells
