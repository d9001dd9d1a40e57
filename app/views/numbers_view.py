"""The corrected model: its numbers with their intervals, the verdict of the law, and sliders that predict anew."""

from nicegui import events, ui

from ...physics.in_words import number
from ...workflows.workbench_facts import Value
from ..session import Session
from .words import button, line, watching

_STEPS = 200
"""Places of a slider."""


def numbers_view(session: Session) -> None:
    """A row for each number that differs from the nominal model's."""
    place = ui.element("section").classes("card").props('aria-label="The corrected model"')
    shown: list[object] = []
    sliders: dict[str, tuple[ui.slider, ui.element]] = {}

    def refresh() -> None:
        fit = session.fit
        symbols = [] if fit is None else [value.symbol for value in fit.values]
        now: list[object] = [symbols, session.stand.names, bool(session.stand.moved)]
        if now == shown and fit is not None:
            for value in fit.values:  # the sliders stay under the hand that moves one
                sliders[value.symbol][1].set_text(number(value.after, 4))  # type: ignore[attr-defined]
            return
        shown[:] = now
        place.clear()
        sliders.clear()
        with place:
            _numbers(session, sliders)

    watching(session, place, refresh)


def _numbers(session: Session, sliders: dict[str, tuple[ui.slider, ui.element]]) -> None:
    fit = session.fit
    with ui.element("div").classes("row"):
        line("The corrected model", tag="h2").style("margin: 0; flex: 1")
        if session.stand.moved:
            button("Fitted values", session.unmove, label="Set all numbers to their fitted values")
    if fit is None or not fit.values:
        line(
            "Nothing is added yet: the model is as its file has it. Add an effect, and its numbers stand here.", "muted"
        )
        return
    if fit.verdict:
        good = fit.verdict == "pass"
        line(f"{'Lawful' if good else 'Breaks the law'}: {fit.law}", "small" if good else "small trouble")
    with ui.element("div").classes("numbers-row head"):
        for text in ("number", "as it was", "now", "95 % interval", "move it"):
            line(text, tag="span")
    for value in fit.values:
        _row(session, value, sliders)
    if session.stand.moved:
        line(
            "Numbers were moved by hand: the error is on rows that the fit has seen, and no interval holds.",
            "muted small",
        )


def _row(session: Session, value: Value, sliders: dict[str, tuple[ui.slider, ui.element]]) -> None:
    with ui.element("div").classes("numbers-row"):
        with ui.element("span"):
            line(value.symbol, "mono", "b")
            line(f" {value.what} [{value.unit}]" if value.unit else f" {value.what}", "muted small", "span")
        line(number(value.before, 4), tag="span")
        now = line(number(value.after, 4), tag="span")
        ends = value.ci95
        line(f"{number(ends[0], 4)} to {number(ends[1], 4)}" if ends else "", "muted", "span")
        step = (value.high - value.low) / _STEPS or 1.0

        async def act(event: events.GenericEventArguments) -> None:
            moved = event.args
            if isinstance(moved, int | float) and not isinstance(moved, bool):
                await session.move(value.symbol, min(max(float(moved), value.low), value.high))

        slider = ui.slider(min=value.low, max=value.high, step=step, value=value.after)
        slider.props(f'aria-label="Move {value.symbol}" dense').on("change", act, throttle=0.15)
        sliders[value.symbol] = slider, now
