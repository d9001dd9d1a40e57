"""The equations of motion in LaTeX, each term with its number, and a table of numbers, intervals and sources."""

import re
from collections.abc import Mapping
from itertools import groupby
from pathlib import Path

from ...physics.momentum_balance import Balance, BalanceTerm, balances
from ...physics.vehicle import Vehicle
from ..known_facts import UNITS, WIDE, KnownFacts, exact, filled, judged, letters, remarks, thrust_curve, within_factors
from .base import Export, Given

_SPECIAL = {
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "\\": r"\textbackslash{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "\N{GREEK SMALL LETTER PSI}": r"$\psi$",
}
_BESIDE = " \\, "
"""Between a number and what it multiplies."""


def number(value: float) -> str:
    """A number to twelve digits, as TeX writes it."""
    mantissa, exponent = exact(value)
    return f"{mantissa} \\cdot 10^{{{exponent}}}" if exponent else mantissa


def factor(name: str) -> str:
    """A factor of the balance: a velocity, a modulus, a derivative, a thruster's force, or a sine of the heading."""
    if name.startswith("|"):
        return rf"\left| {factor(name.strip('|'))} \right|"
    stem, _, index = name.partition(":")
    if index:
        return rf"{stem}_{{\mathrm{{{escaped(index)}}}}}"
    if name.endswith("_dot"):
        return rf"\dot{{{name.removesuffix('_dot')}}}"
    if name in ("cos psi", "sin psi"):
        return rf"\{name[:3]} \psi"
    stem, _, index = name.partition("_")
    return rf"{stem}_{{{index}}}" if index else stem


def term(one: BalanceTerm, first: bool) -> str:
    """A summand with its sign."""
    sign = "-" if one.coefficient < 0.0 else "" if first else "+"
    size = [] if abs(one.coefficient) == 1.0 and one.factors else [number(abs(one.coefficient))]
    powers = [(factor(name), len(list(same))) for name, same in groupby(one.factors)]
    product = " ".join(f"{text}^{{{count}}}" if count > 1 else text for text, count in powers)
    return f"{sign} {_BESIDE.join(part for part in (*size, product) if part)}".strip()


def equation(line: Balance) -> str:
    """The balance of an axis."""
    left = " ".join(term(one, k == 0) for k, one in enumerate(line.inertia))
    parts = [term(one, k == 0) for k, one in enumerate(line.force)] or ["0"]
    lines = [" ".join(parts[k : k + WIDE]) for k in range(0, len(parts), WIDE)]
    right = " \\\\\n  &\\quad ".join(lines)
    return f"\\begin{{align*}}\n  {left} &= {right} && \\text{{[{UNITS[line.axis]}]}}\n\\end{{align*}}"


def escaped(text: str) -> str:
    """Text as TeX has it."""
    return re.sub("[" + re.escape("".join(_SPECIAL)) + "]", lambda found: _SPECIAL[found[0]], text)


def _rows(facts: KnownFacts, vehicle: Vehicle) -> str:
    """Rows of the table: numbers, then what takes a whole row."""
    numbers = [" & ".join(map(escaped, (x.symbol, x.amount, x.interval, x.remark))) for x in facts.numbers]
    notes = [*facts.notes, *map(thrust_curve, vehicle.thrusters)]
    whole = [rf"\multicolumn{{4}}{{p{{0.96\linewidth}}}}{{{escaped(each)}}}" for each in notes]
    return "\n".join(f"{row} \\\\" for row in [*numbers, *whole])


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    vehicle, facts = given.vehicle, given.facts
    text = filled(
        Path(__file__).with_name("equations.tex.in"),
        name=escaped(facts.name),
        letters=escaped(letters(vehicle)),
        beside=escaped(within_factors(vehicle)),
        equations="\n".join(equation(line) for line in balances(vehicle)),
        judged=escaped(judged(facts)),
        rows=_rows(facts, vehicle),
    )
    return {path: (remarks(facts.lines(), "% ") + text).encode()}


EXPORT = Export(
    "equations of motion in LaTeX with a table of numbers, intervals and sources", ".tex", _files, ("% ", "")
)
