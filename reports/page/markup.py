"""Markup of the page: its boxes, and its colours on light paper and on a dark screen (Okabe-Ito palette)."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import resources
from typing import TypeVar

from ...exports.elements import NOTHING as NOTHING
from ...exports.elements import Html, element, render
from ...exports.elements import escaped as escaped
from ...exports.elements import table as table

T = TypeVar("T")


def card(*parts: str) -> Html:
    """A box on the page."""
    return element("div.card", *parts)


def bullets(texts: Iterable[str]) -> list[Html]:
    """A list of sentences; nothing for none."""
    items = [element("li", text) for text in texts]
    return [element("ul", *items)] if items else []


def listed(
    items: Iterable[T], columns: Mapping[str, Callable[[T], str]], align: str = "l", *, filled: bool = False
) -> Html:
    """A table with a row for each of some things; see `table`.

    Parameters
    ----------
    columns : what stands in each, by its title
    filled : leave out columns without any text
    """
    cells = {title: [cell(item) for item in items] for title, cell in columns.items()}
    kept = [k for k, column in enumerate(cells.values()) if not filled or any(column)]
    sides, every = align.ljust(len(cells), "r"), list(cells.values())
    rows = zip(*(every[k] for k in kept), strict=True)
    return table([list(cells)[k] for k in kept], rows, "".join(sides[k] for k in kept))


def paragraphs(texts: Iterable[str], cls: str = "facts") -> list[Html]:
    """Each text as a paragraph of a class of style; nothing for one that is empty."""
    return [element("p", text, cls=cls) for text in texts if text]


def details(summary: str, *parts: str) -> Html:
    """What a reader opens by its summary."""
    return element("details", element("summary", summary), *parts)


def folded(title: str, *parts: str) -> Html:
    """A card of details that a reader opens."""
    return element("details.card", element("summary", element("h3", title)), *parts)


def lines(texts: Iterable[str]) -> Html:
    """Each text on a line of its own."""
    return render(*(element("div", text) for text in texts))


def figure(svgs: Sequence[Html], caption: str, *, cls: str = "") -> Html:
    """Drawings side by side with one caption that says what to see."""
    drawings = element("div", *map(enlargeable, svgs), cls=f"plots {cls}".strip())
    return element("figure.card", drawings, element("figcaption", caption))


def enlargeable(svg: Html) -> Html:
    """A drawing that fills the window when it is clicked, and goes back when it is clicked again; without a script."""
    box = Html('<input type="checkbox" aria-label="enlarge this drawing">')
    return element("label.zoom", box, svg)


LIGHT = """
  --paper: #f6f7f8; --card: #ffffff; --ink: #1b2329; --muted: #5d6a75; --grid: #dfe4e8; --surface: #ffffff;
  --measured: #b3bec7; --before: #d55e00; --after: #0072b2; --between: #a9bccb; --likely: #8fc1e0;
  --tint: #eaf3f9; --line: #dfe4e8; --shade: #1b232926;
  --heat1: #d3dbe2; --heat2: #f3c987; --heat3: #f0a04b; --heat4: #d96c1e; --heat5: #a53f0f; --heat6: #5f1f09;
"""
DARK = """
  --paper: #12171c; --card: #1a2127; --ink: #e6ebef; --muted: #9aa8b4; --grid: #313c46; --surface: #1a2127;
  --measured: #6b7986; --before: #ee7f2d; --after: #56b4e9; --between: #4f6779; --likely: #2f6f9c;
  --tint: #1d2f3c; --line: #2d3842; --shade: #e6ebef26;
  --heat1: #3d4954; --heat2: #75502f; --heat3: #ad6524; --heat4: #e08a35; --heat5: #f8bd77; --heat6: #fff1d6;
"""


def style_sheet() -> str:
    """The style sheet of a page, with the colours of both papers in their places.

    Its fonts for formulas have a table of mathematical measures, which tells a browser how far down an index goes.
    Without one a browser leaves it on the base line: for that case the style gives the base of an index some depth,
    below which MathML puts the index.
    """
    text = (resources.files(__package__ or "undertow.reports.page") / "page.css").read_text("utf-8")
    return text.replace("/* light */", LIGHT.strip()).replace("/* dark */", DARK.strip()).strip()
