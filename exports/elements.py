"""HTML that escapes by default: plain text becomes markup only through these few functions."""

import html
from collections.abc import Iterable, Mapping, Sequence

from ..physics.printable import printable


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


def element(tag: str, *parts: str, cls: str = "", attributes: Mapping[str, str] | None = None) -> Html:
    """One element with escaped attributes and contents.

    Examples
    --------
    >>> element("p", "a < b", cls="note")
    '<p class="note">a &lt; b</p>'
    """
    named = ({"class": cls} if cls else {}) | dict(attributes or {})
    opening = "".join(f' {name}="{escaped(value)}"' for name, value in named.items())
    return Html(f"<{tag}{opening}>{render(*parts)}</{tag}>")


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
