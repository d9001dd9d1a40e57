"""Boxes of the page, beside the elements of every file of HTML."""

from collections.abc import Iterable, Sequence

from ...exports.elements import NOTHING, Html, element, escaped, render, table

__all__ = ["NOTHING", "Html", "element", "enlargeable", "escaped", "figure", "folded", "lines", "render", "table"]


def folded(title: str, *parts: str) -> Html:
    """A card of details that a reader opens."""
    return element("details", element("summary", element("h3", title)), *parts, cls="card")


def lines(texts: Iterable[str]) -> list[Html]:
    """Each text on a line of its own."""
    return [element("div", text) for text in texts]


def figure(svgs: Sequence[Html], caption: str, *, cls: str = "") -> Html:
    """Drawings side by side with one caption that says what to see."""
    drawings = element("div", *map(enlargeable, svgs), cls=f"plots {cls}".strip())
    return element("figure", drawings, element("figcaption", caption), cls="card")


def enlargeable(svg: Html) -> Html:
    """A drawing that fills the window when it is clicked, and goes back when it is clicked again; without a script."""
    box = Html('<input type="checkbox" aria-label="enlarge this drawing">')
    return element("label", box, svg, cls="zoom")
