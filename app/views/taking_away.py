"""What a person takes away: page, model, findings, run folder, session, and the commands that do the same."""

from nicegui import ui

from ..session import Session
from .words import button, line

_THINGS = {
    "page": ("The report page", "one HTML file that opens anywhere"),
    "model": ("model.yaml", "the corrected vehicle file"),
    "findings": ("findings.json", "the findings for machines"),
    "run": ("The run folder", "everything, as a zip"),
}


def taking_away(session: Session) -> None:
    """A menu button in the bar."""
    with button("Take away", lambda: None, lead=True), ui.menu().props('aria-label="Take away"'):
        for what, (name, told) in _THINGS.items():
            item = ui.menu_item(on_click=lambda _, what=what: _take(session, what)).mark(f"take {what}")
            with item, ui.element("div"):
                line(name, tag="b")
                line(told, "muted small")
        with ui.menu_item(on_click=lambda: _for_another(session)).mark("export"), ui.element("div"):
            line("For another program", tag="b")
            line("Gazebo, C, Python, MATLAB, an autopilot ...", "muted small")
        with ui.menu_item(on_click=lambda: _save(session)).mark("save"), ui.element("div"):
            line("The session", tag="b")
            line("log, vehicle, steps and view, to go on later or elsewhere", "muted small")
        ui.separator()
        ui.menu_item("The commands that do the same", on_click=lambda: _commands(session))


async def _take(session: Session, what: str) -> None:
    path = await session.take(what)
    if path is None:
        ui.notify(session.errands.trouble, type="warning", multi_line=True)
        return
    ui.download.content(path.read_bytes(), path.name)


async def _save(session: Session) -> None:
    opened, path = session.shown.fitted, await session.save()
    if path is None or opened is None:
        ui.notify(session.errands.trouble, type="warning", multi_line=True)
        return
    log = session.names.in_file(session.names.told(opened.opened.log)).partition(".")[0]
    ui.download.content(path.read_bytes(), f"{log}.session.json")


async def _for_another(session: Session) -> None:
    """A dialog of the formats of exports, each with what it is."""
    formats = dict(await session.ask("formats") or ())
    if not formats:
        ui.notify(session.errands.trouble, type="warning", multi_line=True)
        return
    with ui.dialog() as dialog, ui.element("div").classes("card stack"):
        line("The model for another program", tag="h2")
        choice = ui.radio(formats, value=next(iter(formats))).props('aria-label="Format"').classes("formats")
        line("Every file says what is known about the model, and what the format cannot express.", "muted small")
        with ui.element("div").classes("flow"):
            button("Write and take", lambda: _take(session, str(choice.value)), lead=True)
            button("Close", dialog.close)
    dialog.open()


def _commands(session: Session) -> None:
    with ui.dialog() as dialog, ui.element("div").classes("card stack"):
        line("The same on the command line", tag="h2")
        ui.code(session.commands(), language="bash").classes("commands")
        button("Close", dialog.close)
    dialog.open()
