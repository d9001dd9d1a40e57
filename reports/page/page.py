"""The report: one self-contained HTML page, a pure function of the files in a run folder."""

from collections.abc import Sequence

from ...physics.marks import at_end
from ..run_contents import RunFolder
from .chapters.agreement import agreement
from .chapters.equations import equations
from .chapters.how_it_was_made import made
from .chapters.identifiability import identified
from .chapters.laws import laws
from .chapters.missing import missing_effects
from .chapters.models import models
from .chapters.parameters import calibrated, data, energy, parameter_table
from .chapters.verdict import falling_error, headline
from .chapters.where_it_fails import where_it_fails
from .markup import Html, element, render
from .style import CSS

VERB = "report"
TITLE = "undertow: "
"""How the title of every page begins."""
WAVE = Html(
    '<svg viewBox="0 0 32 18" aria-hidden="true"><g fill="none" stroke-width="2.4" stroke-linecap="round">'
    '<path d="M2 6q5-6 10 0t10 0 8-2" stroke="var(--before)"/>'
    '<path d="M2 13q5-6 10 0t10 0 8-2" stroke="var(--after)"/></g></svg>'
)


def page(run: RunFolder) -> str:
    """The HTML text of the report."""
    name = run.nominal.name
    sections = [
        headline(run),
        falling_error(run),
        agreement(run),
        where_it_fails(run),
        missing_effects(run),
        equations(run),
        parameter_table(run),
        calibrated(run),
        energy(run),
        models(run),
        laws(run),
        identified(run),
        data(run),
        made(run),
    ]
    return document(name, f"what the model of {name} is missing", sections)


def document(title: str, subject: str, sections: Sequence[Html]) -> str:
    """A whole page: the style sheet in its head, the sign of undertow on top, the sections, and a mark at the end."""
    brand = element("div", WAVE, element("b", "undertow"), element("span", subject), cls="brand")
    head = element(
        "head",
        Html('<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'),
        element("title", f"{TITLE}{title}"),
        element("style", Html(CSS)),
    )
    body = element("body", element("main", brand, *sections))
    text = "<!doctype html>\n" + render(element("html", head, body, attributes={"lang": "en"})) + "\n"
    return at_end(VERB, text.encode("utf-8")).decode("utf-8")
