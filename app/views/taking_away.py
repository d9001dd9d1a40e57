"""What a person takes away: the page, the model, the findings, the run folder, and the commands that do the same."""

from nicegui import ui

from ..session import Session
from .words import button, line

_THINGS = {
    "page": ("The report page", "one HTML file that opens anywhere"),
    "model": ("model.yaml", "the corrected vehicle file"),
    "findings": ("findings.json", "the findings for machines"),
    "javascript": ("model.js", "the corrected model in JavaScript, no library"),
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
        ui.separator()
        ui.menu_item("The commands that do the same", on_click=lambda: _commands(session))


async def _take(session: Session, what: str) -> None:
    path = await session.take(what)
    if path is None:
        ui.notify(session.trouble, type="warning", multi_line=True)
        return
    ui.download.content(path.read_bytes(), path.name)


def _commands(session: Session) -> None:
    with ui.dialog() as dialog, ui.element("div").classes("card stack"):
        line("The same on the command line", tag="h2")
        ui.code(session.commands(), language="bash").style("max-width: min(90vw, 900px)")
        button("Close", dialog.close)
    dialog.open()
