"""The page: a bar above, and below it the opening, the bench, or the hull diary of a fleet."""

from collections.abc import Mapping
from importlib import resources
from pathlib import Path

from nicegui import events, ui

from ..reports.page.markup import DARK, LIGHT
from ..workflows.workbench_facts import HullDiary, Source
from .session import Session
from .views.hero import hero, log_notes
from .views.missing_cards import MissingCards
from .views.motion_view import MotionView
from .views.opening import Opening, another_log, taking_away
from .views.side_by_side import Networks, side_by_side
from .views.vehicle_form import numbers_view, vehicle_form
from .views.words import button, line, redrawn, watching


class Page:
    """One tab.

    Parameters
    ----------
    session : what the tab works on
    vehicles : names of those that come with undertow, each with what it is
    first : what is opened at once; None for nothing
    paths : see `Opening`
    """

    def __init__(self, session: Session, vehicles: Mapping[str, str], first: Source | None, *, paths: bool) -> None:
        self._session, self._vehicles = session, vehicles
        self._kind, self._paths = "", paths
        self._source: Source | HullDiary | None = None
        ui.add_css(_css())
        ui.colors(primary="#0072b2")
        self._dark = ui.dark_mode(value=None)
        with ui.element("header").classes("bar"), ui.element("div"):
            line("undertow", "brand", "span")
            self._what = line("", "what small", "span")
            self._tools = ui.element("span").classes("flow")
            button("\N{CIRCLE WITH LEFT HALF BLACK}", self._toggle, label="Change between light and dark")
        self._place = ui.element("main").classes("bench")
        ui.keyboard(on_key=self._key)
        watching(session, self._place, self._refresh)
        if first is not None and session.shown.source is None:
            ui.timer(0.05, lambda: session.open(first), once=True)

    def _refresh(self) -> None:
        session = self._session
        opened, diary = session.shown.opened, session.shown.diary
        kind = "diary" if diary is not None else "bench" if opened is not None else "opening"
        what = "" if opened is None else session.names.with_user_names(f"{opened.log} with {opened.vehicle}")
        self._what.set_text(what if diary is None else f"the fleet {diary.fleet}")
        source = diary or session.shown.source
        if source != self._source:
            self._source = source
            ui.run_javascript("window.scrollTo({top: 0})")
        if kind != self._kind:
            self._kind = kind
            self._tools.clear()
            self._place.clear()
            with self._place:
                if kind == "opening":
                    hero(session)  # what goes on while nothing is open yet, and what went wrong
                    Opening(session, self._vehicles, paths=self._paths)
                elif kind == "diary":
                    self._diary()
                else:
                    self._bench()
        if kind == "bench":
            history = session.shown.history
            self._undo.set_enabled(history is not None and history.can_undo)
            self._redo.set_enabled(history is not None and history.can_redo)

    def _bench(self) -> None:
        session = self._session
        with self._tools:
            self._undo = button("Undo", session.undo, label="Undo the last step")
            self._redo = button("Redo", session.redo, label="Redo the step")
            button("Vehicle", lambda: vehicle_form(session), label="Look at the numbers of the vehicle", once=True)
            button("Open another", self._another, label="Open another log")
            taking_away(session)
        another_log(session, paths=self._paths)
        hero(session)
        with ui.element("div").classes("grid main"):
            MissingCards(session)
            with ui.element("div").classes("stack"):
                MotionView(session)
                numbers_view(session)
                log_notes(session)
                side_by_side(session)
                Networks(session)

    def _diary(self) -> None:
        with self._tools:
            button("Leave", lambda: self._session.shown.turn_to_fleet(None), label="Leave the fleet")
            button("Open another", self._another, label="Open a log, or another fleet")
            button("Take away", self._take_diary, lead=True, label="Take the page of the diary away")
        host = ui.element("section").classes("glance").props('aria-label="The hull diary"')

        def draw(diary: HullDiary | None) -> None:
            if diary is not None:
                ui.html(diary.glance, sanitize=False)  # our own page, in which every name is escaped

        redrawn(self._session, host, lambda: self._session.shown.diary, draw)

    def _take_diary(self) -> None:
        if self._session.shown.diary is not None:
            page = Path(self._session.shown.diary.page)
            ui.download.content(page.read_bytes(), page.name)

    def _another(self) -> None:
        with ui.dialog() as dialog, ui.element("div").style("max-width: min(96vw, 1000px)"):
            Opening(self._session, self._vehicles, paths=self._paths, leave=dialog.close)
        dialog.open()

    def _toggle(self) -> None:
        self._dark.set_value(self._dark.value is not True)

    async def _key(self, event: events.KeyEventArguments) -> None:
        if self._kind == "diary" or not event.action.keydown or not event.modifiers.ctrl:
            return
        if event.key == "z":
            await (self._session.redo() if event.modifiers.shift else self._session.undo())
        elif event.key == "y":
            await self._session.redo()


def _css() -> str:
    """The style sheet: the report page's colour roles, and the layout."""
    layout = (resources.files(__package__ or "undertow.app") / "workbench.css").read_text("utf-8")
    return f":root {{ {LIGHT} }} body.body--dark {{ {DARK} }} {layout}"
