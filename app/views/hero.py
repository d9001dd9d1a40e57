"""Top of the bench: the shown model in a sentence, the falling error, and what is wrong with the log."""

from time import monotonic
from typing import NamedTuple

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from ...measurements.canonical import is_canonical
from ...physics.presentation import number
from ...workflows.workbench_facts import Opened
from ..session import Session
from ..worker_client import Work
from .vehicle_form import vehicle_form
from .words import (
    button,
    by_axis,
    folded,
    headline,
    how_well,
    leans_on,
    line,
    number_in,
    redrawn,
    search_sentence,
    stair_name,
    watching,
)

_OPEN = ("defect", "warning")
"""Verdicts that are shown at once."""
NOTES = "the-log"
"""The place on the page to which the headline leads."""


def worst(opened: Opened) -> str:
    """The worst of what is wrong with the log, in a sentence; empty where nothing is."""
    bad = [check for check in opened.checks if check.verdict in _OPEN]
    told = [f"{bad[0].verdict.capitalize()} of the log: {bad[0].sentence.rstrip('.')}"] if bad else []
    more = f", and {len(bad) - 1} more" if len(bad) > 1 else ""
    told = told or [text.split(". ")[0].rstrip(".") for text in opened.warnings if text != opened.doubt]
    return f"{told[0]}{more}." if told else ""


def log_notes(session: Session) -> None:
    """Warnings above all, then what the checks say, folded where it is only good to know."""
    place = ui.element("section").classes("stack").props('aria-label="What was found in the log"')

    def draw(opened: Opened | None) -> None:
        source = None if session.shown.on_other else session.shown.source  # a repair is a step of the fitted log
        repaired = source is not None and source.original is not None
        if opened is None or not (repaired or opened.warnings or opened.checks or opened.notes):
            return
        with ui.element("div").classes("card stack"):
            ui.link_target(NOTES).classes("anchor")
            line("The log", tag="h2")
            if repaired:
                with ui.element("div").classes("flow small"):
                    line("This is the repaired log.", tag="span")
                    button("Back to the log as it was", session.unrepair, label="Go back to the log before its repair")
            for warning in opened.warnings:
                line(session.names.with_user_names(warning), "trouble small").style("padding-left: 10px; margin: 0")
            bad = [check for check in opened.checks if check.verdict in _OPEN]
            for check in bad:
                with ui.element("div").classes("check-note small"):
                    line(f"{check.verdict}: ", tag="i")
                    parts = filter(None, [check.sentence, check.consequence, check.remedy])
                    line(" ".join(map(_sentence, parts)), tag="span")
                    if check.mends:
                        line(f"Safe repair: {check.mends}", "muted")
            if any(check.mends for check in opened.checks) and source is not None and len(source.logs) == 1:
                button("Make the safe repairs", session.repair, label="Repair the log and open it again")
            rest = [check.sentence for check in opened.checks if check not in bad]
            if rest or opened.notes:
                with folded(f"{len(rest) + len(opened.notes)} notes"):
                    for text in (*rest, *opened.notes):
                        line(session.names.with_user_names(text), "muted")

    redrawn(session, place, lambda: session.shown.opened, draw)


def _sentence(text: str) -> str:
    """A part of what a check says as a sentence; the name of a channel keeps its small letter."""
    first = text.split(" ", 1)[0]
    begun = text if is_canonical(first) else f"{text[0].upper()}{text[1:]}"
    return f"{begun.rstrip('.')}."


_LONG = 130
"""Characters from which a headline is set smaller: a verdict that explains itself."""
_BEYOND = 1.15
"""Share of the first error up to which a bar reaches: a step that makes it worse is seen to."""


def hero(session: Session) -> None:
    """The verdict, the two numbers, and a bar for every step."""
    host = ui.element("section").classes("card hero").props('aria-label="What is missing, and the error"')
    with host:
        with ui.element("div"):
            title = line("", tag="h1").props('aria-live="polite"')
            count = ui.element("div").classes("count").mark("count")
            axes = line("", "small")
            told = line("", "told small")
            found = line("", "told small")
            _doubts(session)
            work = ui.element("div").classes("work").props('role="status"')
        stairs = _Stairs()
    trouble = ui.element("div").classes("card trouble flow").props('role="alert"')

    def refresh() -> None:
        opened, fit = session.shown.opened, session.shown.fit
        text = session.names.with_user_names(headline(session.shown))
        title.classes(replace="long" if len(text) > _LONG else "")
        title.set_text(text)
        host.set_visibility(opened is not None or session.errands.work is not None)
        _show_count(session, count)
        axes.set_text("" if opened is None or fit is None else by_axis(opened, fit))
        told.set_text(session.names.with_user_names(how_well(session.shown)))
        found.set_text(session.names.with_user_names(search_sentence(session.shown)))
        _show_work(session, work)
        stairs.show(session)
        trouble.clear()
        trouble.set_visibility(bool(session.errands.trouble))
        with trouble:
            line(session.names.with_user_names(session.errands.trouble))
            if session.errands.lost:
                button("Start again", session.again, lead=True)
            elif session.refused is not None:
                if len(session.refused.logs) == 1:
                    button("Make the safe repairs", session.repair, label="Repair the log and open it again")
                if session.forcible:
                    button("Take it as it is", session.open_as_is, label="Open the broken log as it is, and be warned")

    watching(session, host, refresh)
    with host:
        ui.timer(0.5, lambda: _show_work(session, work) if session.errands.work else None)


def _show_count(session: Session, place: ui.element) -> None:
    place.clear()
    opened, fit = session.shown.opened, session.shown.fit
    if opened is None or fit is None:
        return
    before, now = opened.nominal.error.get("position"), fit.error.get("position")
    with place:
        line(number_in(before, "m"), "was", tag="b")
        if fit is not opened.nominal:
            line("\N{RIGHTWARDS ARROW}", tag="i")
            line("runs away" if fit.lost else number_in(now, "m"), "now", tag="b").mark("now")
        line(f"position error of {opened.horizon:g} s predictions", "muted", tag="span")


def _doubts(session: Session) -> None:
    """What is wrong with the log, and what everything rests on and nobody knows, with the way to put it right.

    They are built anew only when they change: else who presses a button, and waits for his turn, would press another.
    """
    place = ui.element("div").classes("stack small")

    def facts() -> list[str]:
        opened = session.shown.opened
        return [] if opened is None else [worst(opened), opened.doubt, leans_on(session.shown)]

    def draw(told: list[str]) -> None:
        place.set_visibility(not told or any(told))
        for text, act in zip(told, (_to_notes, _to_thrusters, _to_numbers), strict=False):
            if text:
                with ui.element("div").classes("flow doubt").props('role="note"'):
                    line(session.names.with_user_names(text), tag="span").style("flex: 1 1 220px")
                    act(session)

    redrawn(session, place, facts, draw)


def _to_notes(_: Session) -> None:
    ui.link("See the notes", f"#{NOTES}")


def _to_thrusters(session: Session) -> None:
    button("Thrusters", lambda: vehicle_form(session), label="Look at sides and directions of the thrusters", once=True)


def _to_numbers(session: Session) -> None:
    button("Numbers", lambda: vehicle_form(session), label="Put in what is known of the vehicle", once=True)


def _show_work(session: Session, place: ui.element) -> None:
    place.clear()
    work = session.errands.work
    if work is None:
        return
    behind, now = work.behind, monotonic()
    with place:
        with ui.element("div").classes("meter unknown" if behind is None else "meter"):
            ui.element("i").style(f"width: {100.0 * behind:.0f}%" if behind is not None else "")
        waits = "; what you asked for waits for it" if session.waiting else ""
        line(f"{work.name} ({_so_far(work, now)}){waits}", tag="span")


def _so_far(work: Work, now: float) -> str:
    """How long it has taken, and how long it may take still."""
    left = work.left(now)
    text = f"{now - work.begun:.0f} s"
    if left is None:
        return text
    least, most = (number(max(end, 1.0), 1) for end in left)
    return f"{text}, about {least} s left" if least == most else f"{text}, {least} to {most} s left"


class _Stairs:
    """A bar for every step. Bars stay where they are and change their width, so that the eye sees them shrink."""

    def __init__(self) -> None:
        self._place = ui.element("div").classes("stairs").props('role="list" aria-label="Error after every step"')
        self._rows: list[_Stair] = []

    def show(self, session: Session) -> None:
        """Bring the bars up to date."""
        stairs = [fit for fit in session.shown.stairs if fit.error.get("position") is not None]
        first = stairs[0].error["position"] if stairs else 1.0
        while len(self._rows) > len(stairs):
            for part in self._rows.pop():
                part.delete()
        for k, fit in enumerate(stairs):
            if k == len(self._rows):
                self._rows.append(self._row(first_one=k == 0))
            stair = self._rows[k]
            stair.name.set_text(stair_name(fit))
            share = min(fit.error["position"] / (first or 1.0), _BEYOND) / _BEYOND
            stair.fill.style(f"width: {100.0 * share:.2f}%")
            stair.number.set_text("runs away" if fit.lost else number_in(fit.error["position"], "m"))

    def _row(self, *, first_one: bool) -> "_Stair":
        with self._place:
            name = line("", "name", tag="span")
            track = ui.element("div").classes("track")
            with track:
                fill = ui.element("div").classes("fill first" if first_one else "fill").style("width: 100%")
            return _Stair(name, fill, track, line("", "num", tag="span"))


class _Stair(NamedTuple):
    """One step: its name, what fills the bar, the bar, and the number."""

    name: TextElement
    fill: ui.element
    track: ui.element
    number: TextElement
