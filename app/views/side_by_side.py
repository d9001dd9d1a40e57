"""Models side by side: their errors on the same rows, and the laws that they keep."""

from collections.abc import Sequence

from nicegui import ui

from ...physics.in_words import listing, number
from ...workflows.workbench_facts import Rival, Searched
from ..session import Session
from .words import line, watching

_HEAD = (
    "model",
    "position, 10 s predictions [m]",
    "surge [m/s\N{SUPERSCRIPT TWO}]",
    "sway [m/s\N{SUPERSCRIPT TWO}]",
    "yaw [rad/s\N{SUPERSCRIPT TWO}]",
    "laws",
)


def side_by_side(session: Session) -> None:
    """The models that the search compared."""
    place = ui.element("section").classes("card stack").props('aria-label="Models side by side"')
    shown: list[Searched | None] = [None]

    def refresh() -> None:
        searched = session.shown.searched
        place.set_visibility(searched is not None and bool(searched.rivals))
        if searched is shown[0]:
            return
        shown[0] = searched
        place.clear()
        if searched is not None:
            with place:
                line("Models side by side", tag="h2").style("margin: 0")
                line(
                    "On all rows, each predicted by models that were made without it. Corrected: all that was found.",
                    "muted small",
                )
                with ui.element("div").classes("scroll"):
                    rivals_table(searched.rivals)

    watching(session, place, refresh)


def rivals_table(rivals: Sequence[Rival]) -> None:
    """A row for each model."""
    with ui.element("table").classes("numbers"):
        with ui.element("tr"):
            for head in _HEAD:
                line(head, tag="th")
        for rival in rivals:
            with ui.element("tr"):
                line(rival.name, tag="td")
                for value in rival.error.values():
                    line(number(value, 3), tag="td")
                kept = "kept" if rival.asked else "not asked"
                line(f"breaks {listing(rival.broken)}" if rival.broken else kept, tag="td")
