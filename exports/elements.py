"""Elements of HTML, MathML and XML: markup that escapes by default, and formulas that browsers typeset."""

import html
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any
from xml.etree import ElementTree

from ..physics.errors import printable
from ..physics.presentation import MINUS


class Html(str):
    """Text that is markup already and must not be escaped again."""

    __slots__ = ()


NOTHING = Html("")


def escaped(text: str) -> str:
    """Text that a browser shows as it is: neither markup, nor a character that turns or hides what follows."""
    return html.escape(printable(text))


def render(*parts: str) -> Html:
    """Join parts, escaping every one that is not `Html`."""
    return Html("".join(part if isinstance(part, Html) else escaped(part) for part in parts))


def element(tag: str, *parts: str, cls: str = "", **attributes: str) -> Html:
    """One element with escaped attributes and contents: "p.facts" is a paragraph of a class of style.

    Parameters
    ----------
    cls : its classes, where they are no part of `tag`
    attributes : by name, with an underscore for a hyphen

    Examples
    --------
    >>> element("p.facts", "a < b", aria_label="note")
    '<p class="facts" aria-label="note">a &lt; b</p>'
    """
    name, _, own = tag.partition(".")
    named = {"class": cls or own} | {key.replace("_", "-"): value for key, value in attributes.items()}
    opening = "".join(f' {key}="{escaped(value)}"' for key, value in named.items() if key != "class" or value)
    return Html(f"<{name}{opening}>{render(*parts)}</{name}>")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], align: str = "l", *, caption: str = "") -> Html:
    """A table in a box that scrolls sideways when it must; `align` has an l or r per column, r where it ends."""

    def line(tag: str, cells: Sequence[str]) -> Html:
        sides = align.ljust(len(cells), "r")
        return element(
            "tr", *(element(tag, cell, cls="text" * (side == "l")) for cell, side in zip(cells, sides, strict=False))
        )

    title = [element("caption", caption)] if caption else []
    body = element("tbody", *(line("td", row) for row in rows))
    return element("div", element("table", *title, element("thead", line("th", head)), body), cls="scroll")


GREEK = {"psi": "\N{GREEK SMALL LETTER PSI}"}
DOT = "\N{DOT ABOVE}"
"""Not marked as an accent: browsers without a font for mathematics would put it into the letter."""


def formula(*parts: Html) -> Html:
    """One formula in the line of text."""
    return element("math", *parts)


def symbol(name: str) -> Html:
    """A coefficient or variable: what follows the first underscore is its index.

    Examples
    --------
    >>> symbol("X_uu")
    '<msub><mi>X</mi><mi mathvariant="normal">uu</mi></msub>'
    >>> symbol("u_dot")
    '<mover><mi>u</mi><mo>˙</mo></mover>'
    """
    stem, _, index = name.partition("_")
    if index == "dot":
        return element("mover", element("mi", stem), element("mo", DOT))
    if index.endswith("dot") and len(index) == 4:
        return element("msub", element("mi", stem), symbol(f"{index[0]}_dot"))
    base = element("mi", GREEK.get(stem, stem))
    upright = {"mathvariant": "normal"} if len(index) > 1 else {}
    return element("msub", base, element("mi", index.replace("_", " "), **upright)) if index else base


def number(text: str) -> Html:
    """A number that is typeset already, its minus sign set apart."""
    if text.startswith(MINUS):
        return render(element("mo", MINUS), element("mn", text.removeprefix(MINUS)))
    return element("mn", text)


def sign(text: str) -> Html:
    """An operator between two terms, which keeps its distance though nothing stands before it in its own formula."""
    return element("mo", text, form="infix")


def factor(name: str) -> Html:
    """A factor of a balance term: a velocity, a modulus, a thruster's force, or a function of the heading."""
    if name.startswith("|"):
        bar = element("mo", "|", stretchy="false")
        return element("mrow", bar, symbol(name.strip("|")), bar)
    head, _, tail = name.partition(":")
    if tail:
        return symbol(f"{head}_{tail}")
    head, _, tail = name.partition(" ")
    if tail:
        gap = element("mspace", width="0.17em")
        return element("mrow", element("mi", head), gap, symbol(tail))
    return symbol(name)


def product(factors: tuple[str, ...]) -> Html:
    """Factors side by side; equal neighbours as a power.

    Examples
    --------
    >>> product(("r", "r"))
    '<msup><mi>r</mi><mn>2</mn></msup>'
    """
    powers = [(factor(name), len(list(same))) for name, same in groupby(factors)]
    parts = [one if count == 1 else element("msup", one, element("mn", str(count))) for one, count in powers]
    gap = element("mspace", width="0.12em")
    return render(*(piece for k, part in enumerate(parts) for piece in ((gap, part) if k else (part,))))


def xml_node(
    tag: str, *inside: "ElementTree.Element[Any] | Mapping[str, str]", **attributes: str
) -> ElementTree.Element:
    """An element of an XML document.

    Parameters
    ----------
    inside : what stands within it: elements, and mappings of tags to texts, which are an element each

    Examples
    --------
    >>> ElementTree.tostring(xml_node("link", {"gravity": "false"}, xml_node("visual"), name="hull"))
    b'<link name="hull"><gravity>false</gravity><visual /></link>'
    """
    made = ElementTree.Element(tag, attributes)
    for part in inside:
        if isinstance(part, Mapping):
            for name, text in part.items():
                ElementTree.SubElement(made, name).text = text
        else:
            made.append(part)
    return made
