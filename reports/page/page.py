"""The report: one self-contained HTML page, a pure function of the files in a run folder."""

from collections.abc import Sequence

from ...measurements.statistics.second_processor import shared
from ...physics.file_marks import at_end
from ...physics.registry_members import objects_in
from ..run_contents import RunFolder
from . import chapters
from .chapters.base import Chapter, Section
from .chapters.play import script_digest
from .markup import NOTHING, Html, element, render
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
    told = [(chapter, section) for chapter, section in zip(CHAPTERS, sections, strict=True) if section is not None]
    return document(name, f"what the model of {name} is missing", [_in_place(*one) for one in told], _contents(told))


def _in_place(chapter: Chapter, section: Section) -> Html:
    """A section under its title, folded where its chapter is; links to it open it."""
    if not section.title:
        return element("section", section.body, cls=section.cls) if section.cls else section.body
    title, anchor = element("h2", section.title), element("a", attributes={"id": _anchor(chapter)})
    if chapter.folded:
        body = element("details", element("summary", title), anchor, section.body, cls="folded")
    else:
        body = render(anchor, title, section.body)
    return element("section", body, cls=section.cls)


def _contents(told: Sequence[tuple[Chapter, Section]]) -> Html:
    """The titles as links, at the side of the page where there is room."""
    links = []
    for chapter, section in told:
        short, to = section.title.partition(":")[0], {"href": f"#{_anchor(chapter)}"}
        links += [element("a", short, cls="detail" * chapter.folded, attributes=to)] * bool(short)
    return element("nav", *links, cls="contents", attributes={"aria-label": "contents"})


def _anchor(chapter: Chapter) -> str:
    return f"chapter-{chapter.place}"


def document(title: str, subject: str, sections: Sequence[Html], contents: Html = NOTHING, *, verb: str = VERB) -> str:
    """A whole page: the style sheet in its head, the sign of undertow on top, the sections, and a mark at the end.

    A policy forbids it to load anything, and to run any script but its own.
    """
    brand = element("div", WAVE, element("b", "undertow"), element("span", subject), cls="brand")
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src '{script_digest()}'"
    head = element(
        "head",
        Html('<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'),
        Html(f'<meta http-equiv="Content-Security-Policy" content="{policy}">'),
        element("title", f"{TITLE}{title}"),
        element("style", Html(CSS)),
    )
    body = element("body", contents, element("main", brand, *sections))
    text = "<!doctype html>\n" + render(element("html", head, body, attributes={"lang": "en"})) + "\n"
    return at_end(verb, text.encode("utf-8")).decode("utf-8")
