"""Measured figures beside what is asked of them, as rows of a table."""

from dataclasses import dataclass, field


@dataclass(slots=True)
class Figures:
    """Rows of the table: what was measured, figure, limit (none: told only), unit, whether the limit is the least."""

    rows: list[tuple[str, float, float | None, str, bool]] = field(default_factory=list)

    def tell(self, what: str, value: float, limit: float | None, unit: str, *, least: bool = False) -> None:
        """Keep a figure, and print it."""
        self.rows.append((what, value, limit, unit, least))
        print(self.line(self.rows[-1]), flush=True)

    @staticmethod
    def line(row: tuple[str, float, float | None, str, bool]) -> str:
        """A figure as a row of the table."""
        what, value, limit, unit, least = row
        verdict = "" if limit is None else "**broken**" if Figures.breaks(row) else "holds"
        asked = "" if limit is None else f"{'at least ' * least}{limit:g} {unit}"
        return f"| {what} | {value:.3g} {unit} | {asked} | {verdict} |"

    @staticmethod
    def breaks(row: tuple[str, float, float | None, str, bool]) -> bool:
        """Whether a figure is beyond its limit."""
        _, value, limit, _, least = row
        return limit is not None and (value < limit if least else value >= limit)

    @property
    def broken(self) -> bool:
        """Whether a limit is broken."""
        return any(map(self.breaks, self.rows))
