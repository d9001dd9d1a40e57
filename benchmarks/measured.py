"""Measured figures beside what is asked of them, as rows of a table, part by part of a page."""

import os
import platform
import timeit
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from marked_section import write_section


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


def measure_parts(
    parts: Mapping[str, Callable[[Figures], None]], page: Path | None, kind: str, script: str, how: str = ""
) -> bool:
    """Measure part by part, and write each into a section of its own as soon as it is there.

    Parameters
    ----------
    parts : what measures each part, by its name
    page : whose sections are written anew; None for none
    kind : begins the names of the sections, such as Fleets
    how : what is said of how it was measured, in sentences

    Returns
    -------
    whether a limit is broken
    """
    broken = False
    for name, measure in parts.items():
        figures = Figures()
        loop = min(timeit.repeat("for i in range(10_000_000): x = i + i", number=1, repeat=3))
        measure(figures)
        broken |= figures.broken
        if page is not None:
            where = f"{os.cpu_count()} cores (Python {platform.python_version()}, {platform.system()})"
            told = f"`python {script}`, {where}; ten million additions in Python took {loop:.2f} s just before."
            rows = ("| what | figure | asked | |", "| --- | --- | --- | --- |", *map(figures.line, figures.rows))
            text = "\n".join((f"## {kind}: {name}", "", f"{told} {how}".strip(), "", *rows))
            write_section(page, f"{kind.lower()}, {name}", text, "# How long it takes")
    return broken
