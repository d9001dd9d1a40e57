"""The equations of motion in MathML, each term with its number, on a page that browsers show and XML readers read.

No script, no style from elsewhere, and every element closed, so that a formula can be taken out and put into another
document.
"""

from collections.abc import Mapping
from pathlib import Path

from ...physics.momentum_balance import Balance, BalanceTerm, balances
from ...physics.presentation import MINUS, unit_text
from ...physics.vehicle import Vehicle
from .. import known_facts
from ..elements import Html, element, escaped, product, render, symbol, table
from .base import Export, Given


def number(value: float) -> Html:
    """A number without its sign, to twelve digits."""
    mantissa, exponent = known_facts.exact(abs(value))
    if not exponent:
        return element("mn", mantissa)
    power = [element("mo", MINUS)] * (exponent < 0) + [element("mn", str(abs(exponent)))]
    ten = element("msup", element("mn", "10"), element("mrow", *power))
    return render(element("mn", mantissa), element("mo", "\N{DOT OPERATOR}"), ten)


def term(one: BalanceTerm, first: bool) -> Html:
    """A summand with its sign."""
    sign = MINUS if one.coefficient < 0.0 else "" if first else "+"
    signed = [element("mo", sign, form="prefix" if first else "infix")] if sign else []
    size = [] if abs(one.coefficient) == 1.0 and one.factors else [number(one.coefficient)]
    gap = [element("mspace", width="0.17em")] if size and one.factors else []
    return element("mrow", *signed, *size, *gap, product(one.factors))


def equation(line: Balance) -> Html:
    """The balance of an axis, some terms in a line."""
    left = element("mrow", *(term(one, k == 0) for k, one in enumerate(line.inertia)))
    parts = [term(one, k == 0) for k, one in enumerate(line.force)] or [element("mn", "0")]
    lines = [element("mrow", *parts[k : k + known_facts.WIDE]) for k in range(0, len(parts), known_facts.WIDE)]
    unit = element("mtext", f"[{known_facts.UNITS[line.axis]}]")
    rows = []
    for k, each in enumerate(lines):
        begin, end = ((left, element("mo", "=")), (unit,)) if k == 0 else (("", ""), ("",))
        rows.append(element("mtr", *(element("mtd", part) for part in (*begin, each, *end))))
    return element("math", element("mtable", *rows), display="block", **_NAMESPACE, alttext=line.axis)


_NAMESPACE = {"xmlns": "http://www.w3.org/1998/Math/MathML"}
"""Of MathML; browsers need none, readers of XML do."""


def _inline(name: str) -> Html:
    return element("math", symbol(name), **_NAMESPACE)


def _row(one: known_facts.KnownNumber) -> tuple[str, str, str, str]:
    named = _inline(one.symbol) if ":" not in one.symbol else one.symbol
    return named, unit_text(one.amount), one.interval, one.remark


def page(vehicle: Vehicle, facts: known_facts.KnownFacts) -> str:
    """The page: letters, equations, envelope and audit, then the numbers."""
    within = known_facts.within_factors(vehicle)
    notes = [*facts.notes, *map(known_facts.thrust_curve, vehicle.thrusters)]
    body = element(
        *("body", element("h1", facts.name), element("p", known_facts.letters(vehicle))),
        *([element("p", within)] if within else []),
        *(element("div", equation(line), cls="scroll") for line in balances(vehicle)),
        element("p", known_facts.judged(facts)),
        element("h2", "Numbers"),
        table(("symbol", "value", "95 % interval", "source"), [_row(one) for one in facts.numbers], "llll"),
        element("ul", *(element("li", note) for note in notes)),
        element("h2", "About this file"),
        *(element("p", line) for line in (facts.origin, known_facts.CONVENTIONS)),
    )
    return known_facts.filled(Path(__file__).with_name("equations.html.in"), title=escaped(facts.name), body=body)


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    return {path: page(given.vehicle, given.facts).encode()}


EXPORT = Export(
    "equations of motion in MathML on a page for browsers, with a table of numbers, intervals and sources",
    ".html",
    _files,
    ("<!-- ", " -->"),
)
