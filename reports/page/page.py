"""Pages of HTML: a run's and a comparison's, pure functions of the files in their folders."""

from collections.abc import Sequence
from pathlib import Path

from ...measurements.statistics.processors import parallel_map
from ...physics.files import at_end
from ...physics.presentation import listing, unit_text
from ...physics.registry_members import objects_in
from ..run_contents import ComparisonFolder, RunFolder
from ..wording import judged_rows
from . import chapters
from .chapters.agreement import motion
from .chapters.base import Chapter, Section
from .chapters.models import TITLE, models
from .chapters.play import script_digest
from .chapters.where_it_fails import TITLE as WHERE
from .chapters.where_it_fails import failing
from .figures.model_figures import growth
from .markup import CSS, NOTHING, Html, element, figure, render
from .outcome import cannot

VERB = "report"
TITLE_START = "undertow: "
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
    sections = parallel_map(lambda chapter: chapter.write(run), CHAPTERS)
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
        element("title", f"{TITLE_START}{title}"),
        element("style", Html(CSS)),
    )
    body = element("body", contents, element("main", brand, *sections))
    text = "<!doctype html>\n" + render(element("html", head, body, attributes={"lang": "en"})) + "\n"
    return at_end(verb, text.encode("utf-8")).decode("utf-8")


GROWTH = (
    "Root mean square over predictions from every half second, open loop from measured states: lower is better. A "
    "dashed line is a guess that knows nothing of the boat: a model above it is of no use at that length."
)

MOST = 3  # logs that a line names before it counts them


def comparison_page(folder: ComparisonFolder) -> str:
    """The HTML text of the page."""
    found = folder.comparison
    ends = list(dict.fromkeys([found.models[0].name, *(one.model for one in found.structure)]))
    verdict, _, why = found.best.sentence.partition(": ")
    several = len(found.logs) > 1
    logs = listing([Path(log).name for log in found.logs]) if len(found.logs) <= MOST else f"{len(found.logs)} logs"
    rows = judged_rows(found.split)
    fitted = [model.name for model in found.models if model.fitted_here]
    not_counted = f" Marked, because fitted to rows that are judged: {listing(fitted)}." if fitted else ""
    sections = [
        *(element("p", unit_text(text), cls="card warning") for text in found.warnings),
        element("h1", f"{verdict}." if why else verdict),
        *(element("p", unit_text(f"{one[:1].upper()}{one[1:]}"), cls="lead") for one in (why, cannot(found)) if one),
        element("p", f"Judged on {rows} of {logs}.{not_counted}", cls="lead"),
        element("h2", TITLE),
        models(found.but(best=found.best.but(sentence=""))),
        element("h2", "How the error grows"),
        figure([growth(found.models, ends)], GROWTH, cls="wide"),
        element("h2", "Measured against predicted"),
        motion(folder.series, f"of {'one of the logs' if several else logs}", found, ends[-1]),
        _folded(WHERE, failing(found, folder.series)),
    ]
    return document(logs, f"models compared on {logs}", sections)


def _folded(title: str, body: Html) -> Html:
    return element("section", element("details", element("summary", element("h2", title)), render(body), cls="folded"))
