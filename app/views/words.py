"""Parts that views share: buttons, headings and short texts, each with a name for a screen reader."""

from collections.abc import Callable
from inspect import isawaitable

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from ...physics.presentation import number
from ...physics.vehicle import Vehicle
from ..session import Session


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


def number_in(value: float | None, unit: str, digits: int = 2) -> str:
    """A number with its unit."""
    return "n/a" if value is None else f"{number(value, digits)} {unit}".strip()


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


def in_a_line(vehicle: Vehicle) -> str:
    """What boat it is, and its mass."""
    told = f"{vehicle.name}: {vehicle.about}" if vehicle.about else vehicle.name
    return f"{told}, {number(vehicle.mass)} kg"
