"""Measured figures beside what is asked of them, as rows of a table."""

from dataclasses import dataclass, field
from typing import NamedTuple


class Row(NamedTuple):
    """What was measured, its figure, limit (none: told only) and unit.

    `least`: the limit is the least; `whole`: all that is to be measured for it was measured.
    """

    what: str
    value: float
    limit: float | None
    unit: str
    least: bool = False
    whole: bool = True


@dataclass(slots=True)
class Figures:
    """Rows of the table."""

    rows: list[Row] = field(default_factory=list)

    def tell(
        self, what: str, value: float, limit: float | None, unit: str, *, least: bool = False, whole: bool = True
    ) -> None:
        """Keep a figure, and print it; see `Row`."""
        self.rows.append(Row(what, value, limit, unit, least, whole))
        print(self.line(self.rows[-1]), flush=True)

    @staticmethod
    def line(row: Row) -> str:
        """A figure as a row of the table."""
        what, value, limit, unit, least, whole = row
        holds = "holds" if whole else "holds so far"
        verdict = "" if limit is None else "**broken**" if Figures.breaks(row) else holds
        asked = "" if limit is None else f"{'at least ' * least}{limit:g} {unit}"
        return f"| {what} | {value:.3g} {unit} | {asked} | {verdict} |"

    @staticmethod
    def breaks(row: Row) -> bool:
        """Whether a figure is beyond its limit."""
        return row.limit is not None and (row.value < row.limit if row.least else row.value >= row.limit)

    @property
    def broken(self) -> bool:
        """Whether a limit is broken."""
        return any(map(self.breaks, self.rows))
