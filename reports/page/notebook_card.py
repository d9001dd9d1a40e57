"""What a notebook shows of findings beside their words: numbers with their intervals, and the force that lacks."""

import math
from typing import TYPE_CHECKING

from ...discovery.findings import Findings
from ...discovery.found_effects import FoundTerm
from ...physics.vehicle import Vehicle
from .markup import NOTHING, Html, element
from .style import LIGHT

if TYPE_CHECKING:
    import pandas as pd

_WIDTH, _HEIGHT, _MARGIN = 180.0, 14.0, 6.0
"""Size of an interval's drawing, and room for its marks at both ends [px]: a line of a table."""


def of_findings(findings: Findings) -> dict[str, str]:
    """The numbers of a card, each over its 95 % interval, by the label of its line."""
    label, terms = findings.in_play
    rows = [
        element("tr", element("td", term.in_words), element("td", interval_bar(term, null))) for term, null in terms
    ]
    return {label: element("table", *rows)} if rows else {}


def of_run(findings: Findings, series: "pd.DataFrame", nominal: Vehicle) -> dict[str, str]:
    """The same, and the force that the model lacks, where what was added explains it, as the page has it."""
    from .figures.missing_force import convincing, force_drawings  # matplotlib: not before somebody looks

    best = force_drawings(convincing(findings, series, nominal)[:1])
    paper = {"style": f"{' '.join(LIGHT.split())} --font: sans-serif; background: var(--card); width: 320px"}
    return of_findings(findings) | ({"force": element("div", *best, attributes=paper)} if best else {})


def interval_bar(term: FoundTerm, null: float) -> Html:
    """Draw a number as a disc on its 95 % interval, beside a tick where nothing would be missing."""
    ends = (term.value, term.value) if term.ci95 is None else (term.ci95.lower, term.ci95.upper)
    marks = [term.value, *ends, null]
    if not all(math.isfinite(mark) for mark in marks):
        return NOTHING
    least, span = min(marks), (max(marks) - min(marks)) or 1.0
    at, low, high, absent = (f"{_MARGIN + (_WIDTH - 2 * _MARGIN) * (mark - least) / span:.1f}" for mark in marks)
    middle = f"{_HEIGHT / 2:g}"
    wide = {"x1": low, "x2": high, "y1": middle, "y2": middle, "stroke": "#0072b2", "stroke-width": "3"}
    tick = {"x1": absent, "x2": absent, "y1": "1", "y2": f"{_HEIGHT - 1:g}", "stroke": "#d55e00", "stroke-width": "2"}
    disc = {"cx": at, "cy": middle, "r": "4", "fill": "#0072b2"}
    size = {"width": f"{_WIDTH:g}", "height": f"{_HEIGHT:g}", "role": "img", "aria-label": term.in_words}
    drawn = [element("line", attributes=tick), element("line", attributes=wide), element("circle", attributes=disc)]
    return element("svg", *drawn, attributes=size)
