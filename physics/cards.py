"""Cards and plots: what an object shows of itself in a console and a notebook, instead of all its numbers."""

from collections.abc import Iterable, Mapping
from html import escape
from importlib import import_module
from typing import Any

from .printable import one_line, whole_sentences
from .spoken import in_python

_LONGEST = 600
"""Letters of a line, unless its first sentence has more: what is cut is in the object's own attributes."""


def each(label: str, texts: Iterable[str]) -> list[tuple[str, str]]:
    """Lines of a card for several texts, with the label before the first."""
    return [("" if place else label, text) for place, text in enumerate(texts)]


class Card:
    """An object that shows itself as a card: the name of its class, and a label and a text a line.

    Texts are written with options of the command line; a card is read in Python, and has arguments in their place.
    """

    __slots__ = ()

    def card(self) -> list[tuple[str, str]]:
        """The lines: a label and what it says. Lines that say nothing are left out."""
        raise NotImplementedError

    def _lines(self) -> list[tuple[str, str]]:
        return [(label, whole_sentences(one_line(in_python(text)), _LONGEST)) for label, text in self.card() if text]

    def __repr__(self) -> str:
        lines = self._lines()
        wide = max((len(label) for label, _ in lines), default=0)
        return "\n".join([type(self).__name__, *(f"  {label:<{wide}}  {text}" for label, text in lines)])

    __str__ = __repr__

    def drawings(self) -> Mapping[str, str]:
        """What a notebook shows in the place of some lines, and below all of them: HTML by label; nothing of most."""
        return {}

    def _repr_html_(self) -> str:
        """The card for a notebook."""
        cell = 'style="text-align: left; vertical-align: top"'
        drawn = self.drawings()
        lines = [(label, drawn.get(label, escape(text))) for label, text in self._lines()]
        lines += [(label, drawing) for label, drawing in drawn.items() if label not in dict(lines)]
        rows = "".join(f"<tr><th {cell}>{escape(label)}</th><td {cell}>{content}</td></tr>" for label, content in lines)
        return f"<table><caption>{escape(type(self).__name__)}</caption>{rows}</table>"


def from_above(name: str) -> Any:
    """Look up a class or function that lies floors above: what draws an object, or fills its card.

    Its type is said where it is used, by an import for type checkers alone.

    Parameters
    ----------
    name : module and name there, as the package has them: "reports.page.figures.record_plots:FindingsPlots"
    """
    module, _, called = name.partition(":")
    return getattr(import_module(f"..{module}", __package__), called)
