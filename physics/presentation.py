"""Presentation: numbers, units and names in words, the same everywhere, and objects as cards."""

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib import import_module
from typing import Any

from .errors import in_python, one_line, whole_sentences

MINUS = "\N{MINUS SIGN}"
NARROW = "\N{NO-BREAK SPACE}"
_ALMOST = 0.999
"""Share that stands for all: files round to it, and what is left is there."""


def words(name: str) -> str:
    """An identifier in plain words.

    Examples
    --------
    >>> words("surge_quadratic_damping")
    'surge quadratic damping'
    >>> words("thruster_asymmetry[port]"), words("munk_moment")
    ('thruster asymmetry of port', 'Munk moment')
    """
    what, _, whose = name.rstrip("]").partition("[")
    return what.replace("_", " ").replace("munk", "Munk") + (f" of {whose}" if whose else "")


def finite(value: Any) -> float:
    """The value as a float, NaN for anything that is not a finite number (a diverged rollout is null in the files)."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return math.nan
    return float(value)


def number(value: Any, digits: int = 3, *, minus: str = "-", blank: str = "n/a") -> str:
    """A number with `digits` significant digits, an integer whole; no exponent where it can be avoided.

    Parameters
    ----------
    value : anything; what is no finite number gives `blank`
    digits : significant digits
    minus, blank : the signs for minus and for no number

    Examples
    --------
    >>> number(-9.1374), number(1234.5), number(0.000123), number(None), number(0.0)
    ('-9.14', '1234', '0.000123', 'n/a', '0')
    """
    if isinstance(value, int) and not isinstance(value, bool):
        return str(value).replace("-", minus)
    value = finite(value)
    if math.isnan(value):
        return blank
    if value == 0.0:
        return "0"
    magnitude = math.floor(math.log10(abs(value)))
    if -5 < magnitude < 7:
        text = f"{value:.{max(digits - 1 - magnitude, 0)}f}"
    else:
        text = f"{value:.{digits - 1}e}"
    return text.replace("-", minus)


def short_names(paths: Sequence[str]) -> list[str]:
    """The names of files, with as many of their folders as tell them apart.

    >>> short_names(["a/one.csv", "a/two.csv"]), short_names(["one.csv", "monday/one.csv"])
    (['one.csv', 'two.csv'], ['one.csv', 'monday/one.csv'])
    """
    parts = [path.replace("\\", "/").split("/") for path in paths]
    for count in range(1, max(map(len, parts), default=0) + 1):
        names = ["/".join(part[-count:]) for part in parts]
        if len(set(names)) == len(set(paths)):
            return names
    return list(paths)


def counted(count: int, noun: str) -> str:
    """A number of things.

    Examples
    --------
    >>> counted(1, "log"), counted(0, "boat")
    ('1 log', '0 boats')
    """
    return f"{count} {noun}{'s' * (count != 1)}"


def lasting(hours: float) -> str:
    """A time, in the unit that people would give it.

    Examples
    --------
    >>> lasting(0.00804), lasting(0.5), lasting(42667.0)
    ('29 s', '30 min', '42667 h')
    """
    if hours < 1.0 / 30.0:
        return f"{3600.0 * hours:.0f} s"
    return f"{60.0 * hours:.0f} min" if hours < 1.5 else f"{number(hours)} h"


def sentence_case(text: str) -> str:
    """A text with a capital where it begins, and every other letter as it is: names keep theirs."""
    return f"{text[:1].upper()}{text[1:]}"


def share_removed(share: Any) -> str:
    """The share of an error that is removed: never all of it, and more than all where other effects add to it.

    Examples
    --------
    >>> [share_removed(share).replace(NARROW, " ") for share in (0.3, 1.0, 1.34)]
    ['30 %', '> 99 %', 'more than all']
    """
    return "more than all" if finite(share) > 1.0 else percent(min(finite(share), _ALMOST))


def percent(share: Any, *, minus: str = "-", blank: str = "n/a") -> str:
    """A share as a whole percentage that never claims certainty.

    Parameters
    ----------
    share : 1 is all
    minus, blank : the signs for minus and for no number

    Examples
    --------
    >>> [percent(share).replace(NARROW, " ") for share in (0.41, 0.9991, 0.002, -0.03)]
    ['41 %', '> 99 %', '< 1 %', '-3 %']
    """
    value = finite(share)
    if math.isnan(value):
        return blank
    if 0.995 <= value < 1.0:
        return f">{NARROW}99{NARROW}%"
    if 0.0 < value < 0.005:
        return f"<{NARROW}1{NARROW}%"
    return f"{round(100.0 * value):d}{NARROW}%".replace("-", minus)


def unit_text(unit: str) -> str:
    """A unit, or text with units, with raised exponents; nothing for a pure number.

    Examples
    --------
    >>> unit_text("N s^2/m^2"), unit_text("N m (s/m)^1 (s/rad)^2"), unit_text("-")
    ('N s²/m²', 'N m (s/m) (s/rad)²', '')
    """
    return "" if unit in ("-", "1") else unit.replace(")^1", ")").replace("^2", "²").replace("^3", "³")


def listing(names: Sequence[str], last: str = "and") -> str:
    """Names as a phrase.

    Parameters
    ----------
    last : the word before the last name

    Examples
    --------
    >>> listing(["drag", "lag", "wind"])
    'drag, lag and wind'
    """
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} {last} {names[-1]}"


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
        """Drawings of a notebook in the place of some lines, and below all of them: HTML by label; nothing of most."""
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
