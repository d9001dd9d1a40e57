"""What `control` shows on the terminal: how near each model keeps the boat to its track, and at what price."""

from rich.console import RenderableType
from rich.text import Text

from ...steering.tracking import PERFECT, ControlRecord, Tracking
from .layout import BAD, FOUND, GOOD, Prose, plain_table, stacked

_MATTERS = 0.05
"""Share by which an error must differ to be coloured: what gusts and noise change it by from seed to seed."""


def control_tables(record: ControlRecord) -> RenderableType:
    """A table for each track, and what its columns are."""
    tracks = dict.fromkeys(result.track for result in record.results)
    legend = (
        "error: root mean square of the distance from the moving point. effort: of the commands, as a share of full. "
        "off lane: share of the time farther from the point than it moves in a second. step: median of the "
        f"controller's processor time. The model called {PERFECT} is the true boat itself."
    )
    return stacked([*(_table(record, track) for track in tracks), Prose(legend, "dim")])


def _table(record: ControlRecord, track: str) -> RenderableType:
    rows = [result for result in record.results if result.track == track]
    table = plain_table(f"{track}, {record.controller} ({record.speed:.2f} m/s)")
    table.add_column("model", no_wrap=True)
    for name in ("error [m]", f"against {rows[0].model}", "effort", "off lane", "at limit", "step [ms]", "failures"):
        table.add_column(name, justify="right")
    for place, row in enumerate(rows):
        figures = row.merit
        table.add_row(
            Text(row.model, style=FOUND if row.model == PERFECT else ""),
            f"{figures.rmse:.3f}",
            _against(row) if place else "",
            f"{figures.effort:.2f}",
            f"{100.0 * figures.off_lane:.0f} %",
            f"{100.0 * figures.at_limit:.0f} %",
            f"{figures.step:.1f}",
            _failures(row),
        )
    return table


def _against(row: Tracking) -> Text:
    share = row.against_first
    style = GOOD if share < -_MATTERS else BAD if share > _MATTERS else ""
    return Text(f"{100.0 * share:+.0f} %", style=style)


def _failures(row: Tracking) -> Text:
    if row.merit.lost:
        return Text("lost", style=BAD)
    return Text(str(row.merit.unsolved) if row.merit.unsolved else "none", style=BAD if row.merit.unsolved else "")
