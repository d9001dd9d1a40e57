"""The sections that only paper has: what is missing as a table, what to record next, and where the appendix begins."""

from ...run_contents import RunFolder
from ...sureness import in_order
from ..markup import Html, element, render
from ..outcome import section_title
from .base import Chapter, Section
from .identifiability import advised
from .missing import effect_table, unnamed_terms

_MOST_EFFECTS = 8
"""Effects in the table: with the picture and the errors below it, so many leave the summary on two pages."""
_MOST_ADVICE = 3
"""Manoeuvres below the errors, surest use first: an hour on the water has no more."""


def in_numbers(run: RunFolder) -> Section | None:
    """The effects of the corrected model, each with its value, its 95 % interval and how sure it is."""
    chosen, unnamed = in_order(run.findings.added), run.findings.unnamed
    parts: list[Html] = [effect_table(chosen[:_MOST_EFFECTS], run.nominal)] * bool(chosen)
    if len(chosen) > _MOST_EFFECTS:
        parts.append(element("p", f"{len(chosen) - _MOST_EFFECTS} more stand in the appendix.", cls="facts"))
    parts += unnamed_terms(unnamed[:_MOST_EFFECTS]) if unnamed else []
    return _on_paper(section_title(run.findings, run.comparison), parts)


def record_next(run: RunFolder) -> Section | None:
    """The manoeuvres that would settle what the log leaves open."""
    advice = run.findings.advice[:_MOST_ADVICE]
    return _on_paper("What to record next", [advised(advice)] * bool(advice))


def _on_paper(title: str, parts: list[Html]) -> Section | None:
    return Section("", render(element("h2", title), *parts), "paper") if parts else None


IN_NUMBERS = Chapter(12, in_numbers)
RECORD_NEXT = Chapter(24, record_next)
APPENDIX = Chapter(26, lambda run: Section("", element("h1", "Appendix"), "paper appendix"))
