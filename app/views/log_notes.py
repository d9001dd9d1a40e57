"""What was found in the log itself, with its remedies."""

from nicegui import ui

from ...measurements.canonical import is_canonical
from ...workflows.workbench_facts import Opened
from ..session import Session
from .words import button, line, watching

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
    shown: list[object] = []

    def refresh() -> None:
        opened, source = session.shown.opened, session.shown.source
        if session.shown.on_other:
            source = None  # a repair is a step, and this log is no part of the steps
        if shown == [opened]:
            return
        shown[:] = [opened]
        place.clear()
        repaired = source is not None and source.original is not None
        if opened is None or not (repaired or opened.warnings or opened.checks or opened.notes):
            return
        with place, ui.element("div").classes("card stack"):
            ui.link_target(NOTES).classes("anchor")
            line("The log", tag="h2")
            if repaired:
                with ui.element("div").classes("flow small"):
                    line("This is the repaired log.", tag="span")
                    button("Back to the log as it was", session.unrepair, label="Go back to the log before its repair")
            for warning in opened.warnings:
                line(session.names.told(warning), "trouble small").style("padding-left: 10px; margin: 0")
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
                with ui.element("details").classes("small"):
                    line(f"{len(rest) + len(opened.notes)} notes", tag="summary")
                    for text in (*rest, *opened.notes):
                        line(session.names.told(text), "muted")

    watching(session, place, refresh)


def _sentence(text: str) -> str:
    """A part of what a check says as a sentence; the name of a channel keeps its small letter."""
    first = text.split(" ", 1)[0]
    begun = text if is_canonical(first) else f"{text[0].upper()}{text[1:]}"
    return f"{begun.rstrip('.')}."
