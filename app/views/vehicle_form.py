"""Numbers of a vehicle in the browser: its file as a form with thrusters, and the corrected model with sliders."""

from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from math import degrees, radians

from nicegui import events, ui
from nicegui.elements.mixins.text_element import TextElement

from ...physics.presentation import number
from ...workflows.workbench_facts import Field, Form, Place, Source, Value, Wire
from ..session import Session
from .words import button, dialog, line, quantity, watching

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
        quantity(value.symbol, value.what, value.unit)
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


_BOXES = ("x ahead [m]", "y to starboard [m]", "pushes to [\N{DEGREE SIGN}]")
_TURNS = "0\N{DEGREE SIGN} pushes ahead, 90\N{DEGREE SIGN} to starboard. y is negative at port."


class ThrusterRows:
    """A row for each thruster, and a button that swaps the commands of two.

    Parameters
    ----------
    places, wires : of each thruster, in the same order
    changed : called after every change
    """

    def __init__(self, places: Sequence[Place], wires: Sequence[Wire], changed: Callable[[], Awaitable[None]]) -> None:
        self._before, self._changed = tuple(places), changed
        self._boxes: list[tuple[ui.number, ui.number, ui.number]] = []
        self._drives: list[tuple[ui.select, ui.checkbox]] = []
        commands = [wire.channel for wire in wires]
        with ui.element("div").classes("flow"):
            line("Thrusters", tag="h3").style("flex: 1")
            if len(places) == 2:
                button("Swap the two commands", self._swap)
        line(_TURNS, "muted small")
        for place, wire in zip(places, wires, strict=True):
            with ui.element("div").classes("numbers-row thruster-row"):
                line(place.name, "mono", "b")
                values = place.x, place.y, degrees(place.angle)
                boxes = [self._box(place.name, told, value) for told, value in zip(_BOXES, values, strict=True)]
                self._boxes.append((boxes[0], boxes[1], boxes[2]))
                drive = ui.select(commands, value=wire.by, label="driven by", on_change=self._changed)
                drive.props(f'dense outlined aria-label="{place.name} driven by"').classes("drive")
                turned = ui.checkbox("reversed", value=wire.turned, on_change=self._changed)
                self._drives.append((drive, turned.props(f'dense aria-label="{place.name} reversed"')))
        self._wires = tuple(wires)

    @property
    def places(self) -> tuple[Place, ...]:
        """Where the thrusters are; a box that is empty counts for what stood in it."""
        return tuple(
            Place(was.name, _value(x, was.x), _value(y, was.y), _angle(angle, was.angle))
            for was, (x, y, angle) in zip(self._before, self._boxes, strict=True)
        )

    @property
    def moved(self) -> bool:
        """True when any is elsewhere than before."""
        return self.places != self._before

    @property
    def wires(self) -> tuple[Wire, ...]:
        """What drives each of them."""
        return tuple(
            Wire(wire.channel, str(drive.value), bool(turned.value))
            for wire, (drive, turned) in zip(self._wires, self._drives, strict=True)
        )

    def _box(self, name: str, told: str, value: float) -> ui.number:
        box = ui.number(label=told, value=float(number(value, 6)), on_change=self._changed)
        return box.props(f'dense outlined debounce=300 aria-label="{name} {told}"')

    def _swap(self) -> None:
        (one, turned), (other, also) = self._drives
        one.value, other.value = other.value, one.value
        turned.value, also.value = also.value, turned.value


def _value(box: ui.number, before: float) -> float:
    """What stands in a box; what was before, to the last digit, where nothing else was typed."""
    typed = before if box.value is None else float(box.value)
    return before if typed == float(number(before, 6)) else typed


def _angle(box: ui.number, before: float) -> float:
    shown = _value(box, degrees(before))
    return before if shown == degrees(before) else radians(shown)


async def vehicle_form(session: Session) -> None:
    """A dialog; what is changed is read anew with the log."""
    client = ui.context.client  # what was pressed may be gone from the page when its turn has come
    form = await session.ask("form")
    source = session.shown.source
    if form is not None and source is not None and not client.is_deleted:
        with client:
            _VehicleForm(session, form, source)


class _VehicleForm:
    """The dialog while it is open."""

    def __init__(self, session: Session, form: Form, source: Source) -> None:
        self._session, self._source, self._told = session, source, ""
        self._changed: dict[str, float] = dict(source.changed)
        with dialog(900) as self._dialog:
            line("The vehicle", tag="h2").style("margin: 0")
            self._wrong = line("", "trouble small").props('role="alert"')
            self._wrong.set_visibility(visible=False)
            with ui.element("div").classes("scroll").style("max-height: 62vh; overflow-y: auto"):
                self._thrusters = ThrusterRows(form.places, form.wires, self._check)
                line("Numbers", tag="h3").style("margin-top: 12px")
                for field in form.numbers:
                    self._number(field)
            with ui.element("div").classes("flow"):
                button("Use these numbers", self._use, lead=True)
                button("Cancel", self._dialog.close)

    def _number(self, field: Field) -> None:
        with ui.element("div").classes("numbers-row form-row"):
            quantity(field.symbol, field.what, field.unit)

            async def change(event: events.ValueChangeEventArguments) -> None:
                if event.value is not None:
                    self._changed[field.symbol] = float(event.value)
                    await self._check()

            box = ui.number(value=float(number(field.value, 6)), on_change=change)
            box.props(f'dense outlined debounce=300 aria-label="{field.symbol}"')
            line(field.source, "muted small source", "span")

    async def _check(self) -> None:
        self._told = await self._session.ask("try_form", self._changed, self._thrusters.places, self._thrusters.wires)
        self._wrong.set_text(self._told or "")
        self._wrong.set_visibility(bool(self._told))

    async def _use(self) -> None:
        if self._told:
            return
        self._dialog.close()
        rows, source = self._thrusters, self._source
        wires = tuple(wire for wire in rows.wires if wire.turned or wire.by != wire.channel)
        places = rows.places if rows.moved else source.places
        # A log that was taken as it is may be whole now: its other errors are then corrected again.
        as_is = source.as_is and (places, wires) == (source.places, source.wires)
        changed = tuple(sorted(self._changed.items()))
        await self._session.change(replace(source, changed=changed, places=places, wires=wires, as_is=as_is))
