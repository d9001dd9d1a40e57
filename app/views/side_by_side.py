"""Models side by side: their errors on the same rows, and the laws that they keep."""

from collections.abc import Mapping, Sequence

from nicegui import ui

from ...physics.in_words import listing, number
from ...workflows.workbench_facts import Rival
from ..session import Session
from ..shown import Shown
from .headline import stair_name
from .words import line, watching

_ERRORS = ("position [m]", "surge [m/s]", "sway [m/s]", "yaw [rad/s]")
_ACCELERATIONS = tuple(
    f"{axis} [{unit}/s\N{SUPERSCRIPT TWO}]" for axis, unit in (("surge", "m"), ("sway", "m"), ("yaw", "rad"))
)


def side_by_side(session: Session) -> None:
    """The models that the search compared; on another log, the shown model after every step."""
    place = ui.element("section").classes("card stack").props('aria-label="Models side by side"')
    shown: list[tuple[str, Sequence[Rival]]] = [("", ())]

    def refresh() -> None:
        told, rivals = now = _side_by_side(session.shown)
        place.set_visibility(bool(rivals))
        if now == shown[0]:
            return
        shown[0] = now
        place.clear()
        if rivals:
            with place:
                line("Models side by side", tag="h2").style("margin: 0")
                line(told, "muted small")
                rivals_table(rivals)

    watching(session, place, refresh)


def _side_by_side(shown: Shown) -> tuple[str, Sequence[Rival]]:
    """On which rows models stand side by side, and the models."""
    opened = shown.opened
    if shown.on_other and opened is not None:
        return opened.judged, [
            Rival(stair_name(fit), opened.horizon, fit.error, fit.acceleration, (), asked=False) for fit in shown.stairs
        ]
    told = "On all rows, each predicted by models that were made without it. Corrected: all that was found."
    return told, () if shown.searched is None else shown.searched.rivals


def rivals_table(rivals: Sequence[Rival]) -> None:
    """A row for each model: the errors of the headline and the laws, and folded those of accelerations."""
    line(f"Errors of {rivals[0].horizon:g} s predictions", "small")
    laws = any(r.asked for r in rivals)
    rows = [(r.name, *_numbers(r.error), *[_kept(r)] * laws) for r in rivals]
    _table(("model", *_ERRORS, *["laws"] * laws), rows)
    with ui.element("details").classes("small"):
        line("Errors of accelerations, from row to row", tag="summary")
        _table(("model", *_ACCELERATIONS), [(r.name, *_numbers(r.acceleration)) for r in rivals])


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    with ui.element("div").classes("scroll"), ui.element("table").classes("numbers"):
        for tag, row in (("th", heads), *(("td", row) for row in rows)):
            with ui.element("tr"):
                for text in row:
                    line(text, tag=tag)


def _numbers(errors: Mapping[str, float | None]) -> list[str]:
    return [number(value, 3) for value in errors.values()]


def _kept(rival: Rival) -> str:
    """What the laws say of a model."""
    if rival.broken:
        return f"breaks {listing(rival.broken)}"
    return "kept" if rival.asked else "not asked"
