"""Words and parts that views share: buttons and short texts, and what stands on top of the bench."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import isawaitable
from typing import TypeVar

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from ...physics.presentation import listing, number, percent, words
from ...physics.vehicle import Vehicle
from ...workflows.workbench_facts import OWN_NUMBERS, Fit, Opened
from ..session import Session
from ..shown import Shown

Facts = TypeVar("Facts")


def button(
    text: str, act: Callable[[], object], *, lead: bool = False, label: str = "", once: bool = False
) -> ui.button:
    """A button that shows while what it does goes on.

    Parameters
    ----------
    label : its spoken name, where the text would not tell
    once : another press is passed over while what the first one does goes on, as of a double click
    """
    pressed = 0

    async def press() -> None:
        nonlocal pressed
        if once and pressed:
            return
        doing = act()
        if not isawaitable(doing):
            return
        pressed += 1
        made.classes(add="waiting").props("aria-busy=true")
        try:
            await doing
        finally:
            pressed -= 1
            if not pressed and not made.is_deleted:
                made.classes(remove="waiting").props(remove="aria-busy")

    made = ui.button(text, on_click=press, color=None).props("no-caps unelevated dense")
    made.classes("btn lead q-px-md" if lead else "btn plain q-px-sm")
    return made.props(f'aria-label="{label}"') if label else made


def line(text: str, cls: str = "", tag: str = "p") -> TextElement:
    """A line of text, as text: whatever a log or a file says, no markup of it is followed."""
    return TextElement(tag=tag, text=text).classes(cls)


def folded(summary: str, cls: str = "small") -> ui.element:
    """A part that is folded behind a line until somebody opens it."""
    details = ui.element("details").classes(cls)
    with details:
        line(summary, tag="summary")
    return details


def quantity(symbol: str, what: str, unit: str) -> None:
    """The symbol of a number of a vehicle, what it is, and its unit."""
    with ui.element("span"):
        line(symbol, "mono", "b")
        line(f" {what} [{unit}]" if unit else f" {what}", "muted small", "span")


def number_in(value: float | None, unit: str) -> str:
    """A number with its unit."""
    return "n/a" if value is None else f"{number(value, 2)} {unit}"


@contextmanager
def dialog(width: int = 0) -> Iterator[ui.dialog]:
    """A card over the page, which opens when it is built; of a width at most [px], where one is given."""
    with ui.dialog() as made, ui.element("div").classes("card stack") as card:
        if width:
            card.style(f"max-width: min(96vw, {width}px)")
        yield made
    made.open()


def watching(session: Session, host: ui.element, refresh: Callable[[], None]) -> None:
    """Show a part now and after every change, for as long as the element is there that holds it."""

    def show() -> None:
        if host.is_deleted or host.client.is_deleted:
            leave()
            return
        with host:
            refresh()

    leave = session.audience.watch(show)
    host.client.on_delete(leave)
    refresh()


def redrawn(session: Session, host: ui.element, facts: Callable[[], Facts], draw: Callable[[Facts], None]) -> None:
    """Draw a part of its facts now, and anew whenever these are others than before."""
    drawn: list[Facts] = []

    def refresh() -> None:
        now = facts()
        if drawn != [now]:
            drawn[:] = [now]
            host.clear()
            with host:
                draw(now)

    watching(session, host, refresh)


def in_a_line(vehicle: Vehicle) -> str:
    """What boat it is, and its mass."""
    told = f"{vehicle.name}: {vehicle.about}" if vehicle.about else vehicle.name
    return f"{told}, {number(vehicle.mass)} kg"


_NAMED = 3
"""Effects that a headline names; of more it says how many they are."""
_WITHOUT_OWN = (
    " The effects were found with the model's own numbers fitted, too, and here these are as the file has them: add "
    "the own numbers again, or all that was found."
)
"""Why an effect that is missing may not better the error alone."""
_OWN_FITTED = "own numbers fitted"
"""The step that fits the numbers of the vehicle file, as the tables of the command line call it."""
_UNITS = {"surge": "m/s", "sway": "m/s", "yaw": "rad/s"}


def headline(shown: Shown) -> str:
    """The error of the model that is shown, before and now; of the model as it was, what the search says of it."""
    opened, fit, searched = shown.opened, shown.fit, shown.searched
    if opened is None or fit is None:
        return ""
    if not shown.stand.names and not shown.stand.moved:
        text = f"{opened.log}: measured, and what the model {opened.vehicle} makes of it"
        return text if searched is None or shown.on_other else searched.headline
    before, now = opened.nominal.error.get("position"), fit.error.get("position")
    has, over = _with(shown), f"{opened.horizon:g} s predictions"
    if fit.lost:
        return f"{has}, {over} run away"
    if before is None or now is None:
        return f"{has}; the log is too short for {over}"
    return f"{has}, {over} err by {number_in(now, 'm')} instead of {number_in(before, 'm')}"


def search_sentence(shown: Shown) -> str:
    """What the search says, where the headline tells of another model, or of a log that it has not seen."""
    searched = shown.searched
    if searched is None or headline(shown) == searched.headline:
        return ""
    of = f" of {shown.fitted.opened.log}" if shown.on_other and shown.fitted is not None else ""
    return f"The search{of}: {searched.headline}"


def by_axis(opened: Opened, fit: Fit) -> str:
    """The errors of the speeds, before and now."""
    if fit.lost:
        return ""
    told = []
    for axis, unit in _UNITS.items():
        before, now = opened.nominal.error.get(axis), fit.error.get(axis)
        if before is None or now is None:
            continue
        ends = (
            number(before, 2) if fit is opened.nominal else f"{number(before, 2)} \N{RIGHTWARDS ARROW} {number(now, 2)}"
        )
        told.append(f"{axis} {ends} {unit}")
    return " \N{MIDDLE DOT} ".join(told)


def how_well(shown: Shown) -> str:
    """What the model that is shown does to the error, and on which rows."""
    opened, fit = shown.opened, shown.fit
    if opened is None or fit is None:
        return ""
    if shown.on_other:
        return _on_other(shown, opened, fit)
    told, left = _how_well(shown, opened, fit), listing([words(name) for name in shown.stand.left])
    without = f"Read without the correction of {left}; the search and its cards are of the log with it. "
    return f"{without * bool(left)}{told}"


def leans_on(shown: Shown) -> str:
    """Which numbers of the model that is shown nobody measured or gave, and the fit left as they were."""
    opened, fit = shown.opened, shown.fit
    if opened is None or fit is None:
        return ""
    fitted = {value.symbol for value in fit.values}
    assumed = [one for one in opened.assumed if not fitted.issuperset(one.symbols)]
    if not assumed:
        return ""
    names = listing([f"{one.what} ({one.sure})" if one.sure else one.what for one in assumed])
    return f"Assumed, not measured: {names}. All this leans on them: put in what you know."


def stair_name(fit: Fit) -> str:
    """What a step of the falling error added."""
    if not fit.names and fit.values == ():
        return "as it was"
    if fit.unseen and fit.names[-1] == OWN_NUMBERS:
        return _OWN_FITTED
    return f"+ {words(fit.names[-1])}" if fit.unseen else "moved by hand"


def _with(shown: Shown) -> str:
    """What the model that is shown has, at the beginning of a sentence."""
    names, searched = shown.stand.names, shown.searched
    if searched is not None and len(names) > 1 and set(names) == set(searched.found):
        told = "all that was found"
    elif len(names) > _NAMED:
        told = f"{len(names)} additions"
    else:
        told = listing([_OWN_FITTED if name == OWN_NUMBERS else words(name) for name in names])
    moved = "numbers moved by hand" if shown.stand.moved else ""
    return f"With {' and '.join(filter(None, [told, moved]))}"


def _how_well(shown: Shown, opened: Opened, fit: Fit) -> str:
    before, now = opened.nominal.error.get("position"), fit.error.get("position")
    searched, stand = shown.searched, shown.stand
    if fit.lost:
        return f"{fit.lost} of its predictions run away; taken out again, the model is as it was."
    if fit.names and before and now is not None:
        how = "every row predicted by a model that was fitted without it" if fit.unseen else "on rows that a fit saw"
        own = searched is not None and OWN_NUMBERS in searched.found and OWN_NUMBERS not in stand.names
        return f"{_change(before, now)} than the model as it was; {how}.{_WITHOUT_OWN * own}"
    if searched is not None and not stand.left:
        return "\n".join(searched.told)
    return f"{opened.seconds:.0f} s of measurement, predicted open loop again and again from what was measured."


def _on_other(shown: Shown, opened: Opened, fit: Fit) -> str:
    """What the model does to the error on a log that it was not fitted to."""
    before, now = opened.nominal.error.get("position"), fit.error.get("position")
    told = [opened.judged]
    if fit.lost and (fit.names or shown.stand.moved):
        told.insert(0, f"{fit.lost} of its predictions run away.")
    elif (fit.names or shown.stand.moved) and before and now is not None:
        told.insert(0, f"{_change(before, now)} than the model as it was.")
    if shown.searched is not None and shown.searched.hidden is not None:
        told.append("What only forces told of the sensors of the fitted log is not corrected in this one.")
    return " ".join(told)


def _change(before: float, now: float) -> str:
    """By how much an error is less or more."""
    return f"{percent(1.0 - now / before)} less" if now <= before else f"{percent(now / before - 1.0)} more"
