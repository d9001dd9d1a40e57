"""The corrected model: its numbers with their intervals, the verdict of the law, and sliders that predict anew."""

from contextlib import suppress

from nicegui import events, ui
from nicegui.elements.mixins.text_element import TextElement

from ...physics.in_words import number
from ...workflows.workbench_facts import Value
from ..session import Session
from .words import button, line, watching

_EVERY = 0.15
"""Seconds between predictions while a slider moves: a fit is shown before the next is asked for."""


def numbers_view(session: Session) -> None:
    """A row for each number that differs from the nominal model's."""
    place = ui.element("section").classes("card").props('aria-label="The corrected model"')
    shown: list[object] = []
    sliders: dict[str, tuple[ui.element, TextElement]] = {}

    def refresh() -> None:
        fit, stand = session.shown.fit, session.shown.stand
        symbols = [] if fit is None else [value.symbol for value in fit.values]
        now: list[object] = [symbols, stand.names, bool(stand.moved)]
        if now == shown and fit is not None:
            for value in fit.values:  # the sliders stay under the hand that moves one
                slider, told = sliders[value.symbol]
                told.set_text(number(value.after, 4))
                slider.props(f"value={value.after!r}")
            return
        shown[:] = now
        place.clear()
        sliders.clear()
        with place:
            _numbers(session, sliders)

    watching(session, place, refresh)


def _numbers(session: Session, sliders: dict[str, tuple[ui.element, TextElement]]) -> None:
    fit = session.shown.fit
    with ui.element("div").classes("flow"):
        line("The corrected model", tag="h2").style("margin: 0; flex: 1")
        if session.shown.stand.moved:
            button("Fitted values", session.unmove, label="Set all numbers to their fitted values")
    if fit is None or not fit.values:
        line(
            "Nothing is added yet: the model is as its file has it. Add an effect, and its numbers stand here.", "muted"
        )
        return
    line("Of the shown model, fitted with all that is in it now; cards have the numbers of the search.", "muted small")
    if fit.verdict:
        good = fit.verdict == "pass"
        line(f"{'Lawful' if good else 'Breaks the law'}: {fit.law}", "small" if good else "small trouble")
    with ui.element("div").classes("numbers-row head"):
        for text in ("number", "as it was", "now", "95 % interval", "move it"):
            line(text, tag="span")
    for value in fit.values:
        _row(session, value, sliders)
    if session.shown.stand.moved:
        line(
            "Numbers were moved by hand: on the fitted log the error is of rows that the fit has seen, and no interval "
            "holds.",
            "muted small",
        )


def _row(session: Session, value: Value, sliders: dict[str, tuple[ui.element, TextElement]]) -> None:
    with ui.element("div").classes("numbers-row"):
        with ui.element("span"):
            line(value.symbol, "mono", "b")
            line(f" {value.what} [{value.unit}]" if value.unit else f" {value.what}", "muted small", "span")
        line(number(value.before, 4), tag="span")
        now = line(number(value.after, 4), tag="span")
        ends = value.ci95
        line(f"{number(ends[0], 4)} to {number(ends[1], 4)}" if ends else "", "muted", "span")
        slider = ui.element("input").props(f'type=range aria-label="Move {value.symbol}" step=any')
        slider.props(f"min={value.low!r} max={value.high!r} value={value.after!r}")

        async def act(event: events.GenericEventArguments) -> None:
            with suppress(TypeError, ValueError):
                await session.move(value.symbol, min(max(float(event.args), value.low), value.high))

        slider.on("input", act, throttle=_EVERY, js_handler="(event) => emit(event.target.value)")
        sliders[value.symbol] = slider, now
