"""The equations of motion in LaTeX, each term with its number, and a table of numbers, intervals and sources."""

import re
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

from ...physics.forces import CURRENT
from ...physics.in_words import listing
from ...physics.momentum_balance import Balance, BalanceTerm, balances, beside_the_balance
from ...physics.thrusters import Thruster
from ...physics.vehicle import SHARED_THRUSTER_KEYS, Vehicle
from ..known_facts import remarks
from ..left_out import stated, values_of
from .base import Export, Given

_UNITS = {"surge": "N", "sway": "N", "yaw": "N m"}
_SPECIAL = {
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "\\": r"\textbackslash{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
}
_HEAD = r"""\documentclass{{article}}
\usepackage[T1]{{fontenc}}
\usepackage[utf8]{{inputenc}}
\usepackage{{amsmath}}
\usepackage{{longtable}}
\begin{{document}}
\section*{{{name}}}
Velocities $u$, $v$ [m/s] and $r$ [rad/s] are relative to the water{water}; $T$ are the forces of the thrusters [N].
{beside}
{equations}

{left_out}
\begin{{longtable}}{{p{{0.96\linewidth}}}}
\hline
\multicolumn{{1}}{{l}}{{Numbers}} \\
\hline
{rows}
\hline
\end{{longtable}}
\end{{document}}
"""
_BESIDE = " \\, "
"""Between a number and what it multiplies."""
_COMMANDS = {"pwm": " in us", "normalized": "", "rad_s": " in rad/s", "newton": " in N"}
"""Units of commands."""
_WIDE = 3
"""Terms of an equation in a line."""


def number(value: float) -> str:
    """A number to twelve digits, as TeX writes it."""
    mantissa, _, exponent = f"{value:.12g}".partition("e")
    return f"{mantissa} \\cdot 10^{{{int(exponent)}}}" if exponent else mantissa


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
    lines = [" ".join(parts[k : k + _WIDE]) for k in range(0, len(parts), _WIDE)]
    right = " \\\\\n  &\\quad ".join(lines)
    return f"\\begin{{align*}}\n  {left} &= {right} && \\text{{[{_UNITS[line.axis]}]}}\n\\end{{align*}}"


def escaped(text: str) -> str:
    """Text as TeX has it."""
    return re.sub(r"[&%$#_{}~^\\<>|]", lambda found: _SPECIAL[found[0]], text)


def _beside(vehicle: Vehicle) -> str:
    """What acts within a factor: on the thrust, the water, or the memory."""
    apart = [s for s in SHARED_THRUSTER_KEYS if len(values_of(vehicle, s)) > 1]
    symbols = dict.fromkeys([*beside_the_balance(vehicle), *apart])
    found = [stated(vehicle, symbol, 12, vehicle.parameter(symbol).unit) for symbol in symbols]
    return f"Within the factors act {escaped(listing(found))}." if found else ""


def thrust_curve(thruster: Thruster) -> str:
    """How the command of a thruster becomes its force, with every number."""
    curve, unit = thruster.curve, _COMMANDS[thruster.command]
    if curve.kind == "table":
        points = [f"{y:.12g} at {x:.12g}" for x, y in zip(curve.command, curve.force, strict=True)]
        return f"force of {thruster.name} in N at its command{unit}, straight between: {', '.join(points)}"
    speed = {"pwm": "(command - 1500)/500 scale + offset", "normalized": "command scale + offset"}
    parts = [f"{name} = {getattr(curve, name):.12g}" for name in ("k_t", "rho", "diameter", "scale", "offset")]
    law = f"k_t rho diameter^4 n|n| N with n = {speed.get(thruster.command, 'command')}"
    return f"force of {thruster.name} at its command{unit}: {law}; {', '.join(parts)}"


def _rows(lines: Sequence[str]) -> str:
    return " \\\\\n".join(escaped(line) for line in lines) + " \\\\"


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    vehicle, facts = given.vehicle, given.facts
    flows = any(vehicle.value(symbol) for symbol in CURRENT)
    text = _HEAD.format(
        name=escaped(facts.name),
        water=", which moves" * flows,
        beside=_beside(vehicle),
        equations="\n".join(equation(line) for line in balances(vehicle)),
        left_out=escaped(f"{facts.envelope_told} Audit: {' '.join(facts.audit)}"),
        rows=_rows([*facts.numbers, *map(thrust_curve, vehicle.thrusters)]),
    )
    return {path: (remarks(facts.lines(), "% ") + text).encode()}


EXPORT = Export(
    "equations of motion in LaTeX with a table of numbers, intervals and sources", ".tex", _files, ("% ", "")
)
