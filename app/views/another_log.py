"""Which log the views show: that to which the model is fitted, or another one on which it is tried."""

from collections.abc import Callable

from nicegui import ui

from ...workflows.workbench_facts import Source
from ..session import Session
from .log_files import LogFiles
from .words import button, line, watching


def another_log(session: Session, *, paths: bool) -> None:
    """A line with both logs, and the way to try another.

    Parameters
    ----------
    paths : see `LogFiles`
    """
    place = ui.element("section").classes("flow small").props('aria-label="The log that is shown"')
    place.style("margin-top: 12px")
    shown: list[object] = []

    def refresh() -> None:
        fitted, other, on_other = session.shown.fitted, session.shown.other, session.shown.on_other
        names = [session.names.told(one.opened.log) for one in (fitted, other) if one is not None]
        if shown == [names, on_other]:
            return
        shown[:] = [names, on_other]
        place.clear()
        with place:
            if len(names) == 2:
                options = {False: f"{names[0]} (fitted)", True: f"{names[1]} (tried)"}
                choice = ui.toggle(options, value=on_other).props('dense no-caps unelevated aria-label="Log"')
                choice.on_value_change(lambda event: session.shown.look_at(other=bool(event.value)))
                button("Put away", session.put_away, label="Put the other log away")
            button("Try on another log", lambda: _dialog(session, paths=paths), label="Try the model on another log")

    watching(session, place, refresh)


def _dialog(session: Session, *, paths: bool) -> None:
    with ui.dialog() as dialog, ui.element("div").classes("card stack").style("max-width: min(96vw, 620px)"):
        _Trying(session, dialog.close, paths=paths)
    dialog.open()


class _Trying:
    """The dialog while it is open."""

    def __init__(self, session: Session, leave: Callable[[], object], *, paths: bool) -> None:
        self._session, self._leave = session, leave
        line("Try the model on another log", tag="h2").style("margin: 0")
        line(
            "A log of the same boat. The model predicts it as it is: nothing is fitted to this log, and the open one "
            "stays as you left it.",
            "muted small",
        )
        self._files = LogFiles(session, paths=paths, path_label="or the path of a log, a folder or a pattern")
        line("It is read with the channel map of the open log, unless you drop another beside it.", "muted small")
        with ui.element("div").classes("flow"):
            button("Predict", self._try, lead=True, label="Predict the other log")
            button("Cancel", leave)
            self._told = line("", "small", "span").props('role="status"')

    async def _try(self) -> None:
        files = self._files
        if not files.logs:
            self._told.set_text("Drop a log above, or give its path.")
            return
        source = Source(files.logs, channel_map=files.channel_map, frame=files.frame, as_is=files.as_is)
        await self._session.try_on(source, self._tried)

    def _tried(self) -> None:
        if self._told.is_deleted:
            return
        self._told.set_text(self._session.names.told(self._session.errands.trouble))
        if not self._session.errands.trouble:
            self._leave()
