"""The report: one self-contained HTML page, a pure function of the files in a run folder."""

from collections.abc import Sequence

from ...measurements.statistics.second_processor import shared
from ...physics.file_marks import at_end
from ...physics.registry_members import objects_in
from ..run_contents import RunFolder
from . import chapters
from .chapters.base import Chapter
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

CHAPTERS = tuple(sorted(objects_in(chapters, Chapter), key=lambda chapter: chapter.place))
"""Every `Chapter` that a file of their folder holds, from the top of the page down."""


def page(run: RunFolder) -> str:
    """The HTML text of the report."""
    name = run.nominal.name
    sections = shared(lambda chapter: chapter.write(run), CHAPTERS)
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
