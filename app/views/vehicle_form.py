"""The numbers of the vehicle file in a form: units, where each is from, and whether a hull can have them."""

from dataclasses import replace

from nicegui import ui

from ...physics.in_words import number
from ..session import Session
from .words import button, line


async def vehicle_form(session: Session) -> None:
    """A dialog; what is changed is read anew with the log."""
    fields = await session.ask("form")
    if fields is None or session.source is None:
        return
    changed: dict[str, float] = dict(session.source.changed)
    with ui.dialog() as dialog, ui.element("div").classes("card stack").style("max-width: min(96vw, 900px)"):
        line("The vehicle's numbers", tag="h2")
        wrong = line("", "trouble small").props('role="alert"')
        wrong.set_visibility(visible=False)
        with ui.element("div").classes("scroll").style("max-height: 62vh; overflow-y: auto"):
            for field in fields:
                with ui.element("div").classes("numbers-row").style("grid-template-columns: 2fr 1fr 2fr"):
                    with ui.element("span"):
                        line(field.symbol, "mono", "b")
                        unit = f" [{field.unit}]" if field.unit else ""
                        line(f" {field.what}{unit}", "muted small", "span")

                    async def check(event: object, symbol: str = field.symbol) -> None:
                        value = getattr(event, "value", None)
                        if value is None:
                            return
                        changed[symbol] = float(value)
                        told = await session.ask("try_form", changed)
                        wrong.set_text(told or "")
                        wrong.set_visibility(bool(told))

                    box = ui.number(value=float(number(field.value, 6)), on_change=check)
                    box.props(f'dense outlined debounce=300 aria-label="{field.symbol}"')
                    line(field.source, "muted small", "span").style("white-space: normal")

        async def use() -> None:
            if wrong.text or session.source is None:
                return
            dialog.close()
            await session.open(replace(session.source, changed=tuple(sorted(changed.items()))))

        with ui.element("div").classes("flow"):
            button("Use these numbers", use, lead=True)
            button("Cancel", dialog.close)
    dialog.open()
