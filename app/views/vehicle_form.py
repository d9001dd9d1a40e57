"""The vehicle file as a form: its thrusters and its numbers, and whether a hull can have them."""

from dataclasses import replace

from nicegui import ui

from ...physics.in_words import number
from ...workflows.workbench_facts import Field, Form, Source
from ..session import Session
from .thruster_rows import ThrusterRows
from .words import button, line


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
        with ui.dialog() as self._dialog, ui.element("div").classes("card stack").style("max-width: min(96vw, 900px)"):
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
        self._dialog.open()

    def _number(self, field: Field) -> None:
        with ui.element("div").classes("numbers-row form-row"):
            with ui.element("span"):
                line(field.symbol, "mono", "b")
                unit = f" [{field.unit}]" if field.unit else ""
                line(f" {field.what}{unit}", "muted small", "span")

            async def change(event: object) -> None:
                value = getattr(event, "value", None)
                if value is not None:
                    self._changed[field.symbol] = float(value)
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
