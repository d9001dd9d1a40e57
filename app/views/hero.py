"""The top of the bench: what is missing, in a sentence, and the error that falls with every step."""

from time import monotonic
from typing import NamedTuple

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from ...physics.in_words import listing, number, percent, words
from ...workflows.workbench_facts import OWN_NUMBERS, Fit, Opened
from ..session import Session
from .vehicle_form import vehicle_form
from .words import button, line, number_in, watching

_LONG = 130
"""Characters from which a headline is set smaller: a verdict that explains itself."""
_WITHOUT_OWN = (
    " The effects were found with the model's own numbers fitted, too, and here these are as the file has them: add "
    "the own numbers as well, or all that was found."
)
"""Why an effect that is missing may not better the error alone."""
_BEYOND = 1.15
"""Share of the first error up to which a bar reaches: a step that makes it worse is seen to."""


def hero(session: Session) -> None:
    """The verdict, the two numbers, and a bar for every step."""
    host = ui.element("section").classes("card hero").props('aria-label="What is missing, and the error"')
    with host:
        with ui.element("div"):
            headline = line("", tag="h1").props('aria-live="polite"')
            count = ui.element("div").classes("count").mark("count")
            by_axis = line("", "small")
            told = line("", "told small")
            doubt = ui.element("div").classes("flow small doubt").props('role="note"')
            work = ui.element("div").classes("work").props('role="status"')
        stairs = _Stairs()
    trouble = ui.element("div").classes("card trouble flow").props('role="alert"')

    def refresh() -> None:
        searched, opened = session.shown.searched, session.shown.opened
        long = searched is not None and len(searched.headline) > _LONG
        headline.classes(add="long" if long else None, remove=None if long else "long")
        host.set_visibility(opened is not None or session.errands.work is not None)
        if searched is not None:
            headline.set_text(session.names.told(searched.headline))
        elif opened is not None:
            text = f"{opened.log}: measured, and what the model {opened.vehicle} makes of it"
            headline.set_text(session.names.told(text))
        _show_count(session, count)
        by_axis.set_text(_by_axis(session))
        told.set_text(_told(session))
        _show_doubt(session, doubt)
        _show_work(session, work)
        stairs.show(session)
        trouble.clear()
        trouble.set_visibility(bool(session.errands.trouble))
        with trouble:
            line(session.names.told(session.errands.trouble))
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


def _by_axis(session: Session) -> str:
    """The errors of the speeds, before and now."""
    fit, opened = session.shown.fit, session.shown.opened
    if fit is None or opened is None or fit.lost:
        return ""
    units, told = {"surge": "m/s", "sway": "m/s", "yaw": "rad/s"}, []
    for axis, unit in units.items():
        before, now = opened.nominal.error.get(axis), fit.error.get(axis)
        if before is None or now is None:
            continue
        ends = (
            number(before, 2) if fit is opened.nominal else f"{number(before, 2)} \N{RIGHTWARDS ARROW} {number(now, 2)}"
        )
        told.append(f"{axis} {ends} {unit}")
    return " \N{MIDDLE DOT} ".join(told)


def _told(session: Session) -> str:
    opened, fit = session.shown.opened, session.shown.fit
    if opened is None or fit is None:
        return ""
    told = _how_well(session, opened, fit)
    left = listing([words(name) for name in session.shown.stand.left])
    return f"Read without the correction of {left}; headline and cards are of the log with it. {told}" if left else told


def _how_well(session: Session, opened: Opened, fit: Fit) -> str:
    """What the present model does to the error."""
    before, now = opened.nominal.error.get("position"), fit.error.get("position")
    searched, stand = session.shown.searched, session.shown.stand
    if fit.lost:
        return f"{fit.lost} of its predictions run away; taken out again, the model is as it was."
    if fit.names and before and now is not None:
        change = f"{percent(1.0 - now / before)} less" if now <= before else f"{percent(now / before - 1.0)} more"
        how = "every row predicted by a model that was fitted without it" if fit.unseen else "moved by hand"
        own = searched is not None and OWN_NUMBERS in searched.found and OWN_NUMBERS not in stand.names
        return f"{change} than the model as it was; {how}.{_WITHOUT_OWN * own}"
    if searched is not None and not stand.left:
        return " ".join(searched.told)
    seconds = opened.seconds
    return f"{seconds:.0f} s of measurement, predicted open loop again and again from what was measured."


def _show_doubt(session: Session, place: ui.element) -> None:
    """What everything rests on and the log does not show, with the way to put it right."""
    place.clear()
    text = "" if session.shown.opened is None else session.shown.opened.doubt
    place.set_visibility(bool(text))
    if text:
        with place:
            line(session.names.told(text), tag="span").style("flex: 1 1 220px")
            button("Thrusters", lambda: vehicle_form(session), label="Look at sides and directions of the thrusters")


def _show_work(session: Session, place: ui.element) -> None:
    place.clear()
    work = session.errands.work
    if work is None:
        return
    behind = work.behind
    with place:
        known = "" if behind is None else " known"
        with ui.element("div").classes("meter" if known else "meter unknown"):
            ui.element("i").style(f"width: {100.0 * behind:.0f}%" if behind is not None else "")
        left = work.left
        so_far = f"{monotonic() - work.begun:.0f} s"
        line(f"{work.name} ({so_far}{f', about {left:.0f} s left' if left else ''})", tag="span")


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
            self._rows.pop().delete()
        for k, fit in enumerate(stairs):
            if k == len(self._rows):
                self._rows.append(self._row(first_one=k == 0))
            stair = self._rows[k]
            stair.name.set_text("as it was" if not fit.names else f"+ {words(fit.names[-1])}")
            share = min(fit.error["position"] / (first or 1.0), _BEYOND) / _BEYOND
            stair.fill.style(f"width: {100.0 * share:.2f}%")
            stair.number.set_text("runs away" if fit.lost else number_in(fit.error["position"], "m"))

    def _row(self, *, first_one: bool) -> "_Stair":
        with self._place:
            name = line("", "name", tag="span")
            track = ui.element("div").classes("track")
            with track:
                fill = ui.element("div").classes("fill first" if first_one else "fill").style("width: 100%")
            return _Stair(name, track, fill, line("", "num", tag="span"))


class _Stair(NamedTuple):
    """One step: its name, the bar with what fills it, and the number."""

    name: TextElement
    track: ui.element
    fill: ui.element
    number: TextElement

    def delete(self) -> None:
        """Take it from the page."""
        for element in (self.name, self.track, self.number):
            element.delete()
