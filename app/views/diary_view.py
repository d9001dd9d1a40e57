"""The hull diary of a fleet: what changed, all boats over their days, and the whole page to take away."""

from pathlib import Path

from nicegui import ui

from ..session import Session
from .words import button, watching


def diary_view(session: Session, tools: ui.element) -> None:
    """The top of the diary's page, with a button in the bar for all of it."""
    with tools:
        button("Take away", lambda: _take(session), lead=True, label="Take the page of the diary away")
    host = ui.element("section").classes("glance").props('aria-label="The hull diary"')

    def refresh() -> None:
        host.clear()
        if session.shown.diary is not None:
            with host:
                ui.html(session.shown.diary.glance, sanitize=False)  # our own page, in which every name is escaped

    watching(session, host, refresh)


def _take(session: Session) -> None:
    if session.shown.diary is not None:
        page = Path(session.shown.diary.page)
        ui.download.content(page.read_bytes(), page.name)
