"""Known facts of a model in every export: envelope, verdict, intervals, sources, and the legend of the equations."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template

from ..physics.errors import one_line
from ..physics.forces import CURRENT
from ..physics.laws.damping_power import Envelope
from ..physics.momentum_balance import DENSITY, STRIPS, balances, factor_symbols, stated
from ..physics.motion import AXES, FORCE_UNITS, SPEED_UNITS
from ..physics.presentation import listing
from ..physics.thrusters import Thruster
from ..physics.vehicle import Vehicle, hull_of

_WIDTH = 100
"""Letters of a line of remarks."""
CONVENTIONS = "SI units, earth NED, body FRD: x ahead, y to starboard, positive yaw turns to starboard."


@dataclass(frozen=True, slots=True)
class KnownNumber:
    """A number of the model.

    Attributes
    ----------
    symbol, amount : what it is, and how much, with its unit
    interval : of 95 %, where the number was fitted
    source : where it came from, where that is known
    sure : of a number that undertow changed, its verdict and odds, such as "likely (85 %)", or "calibrated"
    """

    symbol: str
    amount: str
    interval: str = ""
    source: str = ""
    sure: str = ""

    @property
    def line(self) -> str:
        """All of it in a line."""
        interval = f", 95 % interval {self.interval}" * bool(self.interval)
        return f"{self.symbol} = {self.amount}{interval}" + f"; {self.remark}" * bool(self.remark)

    @property
    def remark(self) -> str:
        """How sure it is, and where it came from, as far as that is known."""
        return "; ".join(filter(None, (self.sure, self.source)))


@dataclass(frozen=True, slots=True)
class KnownFacts:
    """What is known about a model.

    Attributes
    ----------
    name, source : of the vehicle, and of the file or folder it was read from
    version : of undertow
    envelope : velocities relative to the water in which it was judged, and where they came from
    audit : what the laws say, a sentence each; the first is the verdict
    numbers : each number with its unit, its interval and its source, where they are known
    notes : what else is known, such as where the thrusters are, and the sources of whole sections
    left_out : what the format does not express, in newtons
    found : of a run what it found, and which model it says to trust; empty for others
    """

    name: str
    source: str
    version: str
    envelope: Envelope
    envelope_from: str
    audit: tuple[str, ...]
    numbers: tuple[KnownNumber, ...]
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    found: str = ""

    @property
    def origin(self) -> str:
        """Whose model it is, and what it was made from."""
        return f"Model of {self.name}, made by undertow {self.version} from {self.source}."

    @property
    def envelope_sentence(self) -> str:
        """The envelope in a sentence."""
        ends = zip("uvr", self.envelope.lower, self.envelope.upper, SPEED_UNITS, strict=True)
        box = ", ".join(f"{name} {low:g} to {high:g} {unit}" for name, low, high, unit in ends)
        return f"Judged through the water for {box} ({self.envelope_from})."

    def lines(self) -> list[str]:
        """All of it, in lines for remarks."""
        left = [f"- {each}" for each in self.left_out] or ["Everything that the model says is expressed."]
        told = [
            self.origin,
            CONVENTIONS,
            "",
            *([f"Found. {self.found}"] if self.found else []),
            f"Envelope. {self.envelope_sentence} Beyond it nobody has looked.",
            f"Audit. {self.audit[0]}",
            *(f"- {each}" for each in self.audit[1:]),
            "Numbers.",
            *(f"- {each.line}" for each in self.numbers),
            *(f"- {each}" for each in self.notes),
            "Not expressed here." if self.left_out else "",
            *left,
        ]
        return [line for text in told for line in _folded(text)]


def _folded(text: str) -> list[str]:
    indent = "  " * text.startswith("- ")
    return textwrap.wrap(one_line(text), _WIDTH, subsequent_indent=indent, break_on_hyphens=False) or [""]


def remarks(lines: Sequence[str], begin: str = "# ") -> str:
    """Lines as remarks of a language in which a sign begins one.

    A line of C that ends in a backslash, or in how C once wrote one, would make a remark of the next line.
    """
    told = (f"{begin}{line}".rstrip() for line in lines)
    return "".join(f"{line}{'.' * line.endswith((chr(92), '??/'))}\n" for line in told)


def filled(template: Path, **values: object) -> str:
    """A file of another language, with values in the place of its `$names`."""
    return Template(template.read_text("utf-8")).substitute(values)


UNITS: dict[str, str] = dict(zip(AXES, FORCE_UNITS, strict=True))
WIDE = 3
"""Terms of an equation in a line."""
_COMMANDS = {"pwm": " in us", "normalized": "", "rad_s": " in rad/s", "newton": " in N", "tau": " in N or N m"}
"""Units of commands."""
_DIGITS = 12
"""Of a number: of forces of some hundred newtons, well under a micronewton is lost."""


def exact(value: float) -> tuple[str, int]:
    """Mantissa and power of ten of a number, to twelve digits.

    >>> exact(33.5), exact(-2.5e-13)
    (('33.5', 0), ('-2.5', -13))
    """
    mantissa, _, exponent = f"{value:.{_DIGITS}g}".partition("e")
    return mantissa, int(exponent or 0)


def letters(vehicle: Vehicle) -> str:
    """What the letters of the balances mean, as far as they stand there."""
    factors = {name for line in balances(vehicle) for term in line.force for name in term.factors}
    moving = any(vehicle.value(symbol) for symbol in CURRENT)
    texts = ["u, v: surge and sway speed" + " relative to the water" * bool(moving) + " [m/s]", "r: yaw rate [rad/s]"]
    if any(name.startswith("T:") for name in factors):
        texts.append("T: force of a thruster [N]")
    if any(name.endswith("psi") for name in factors):
        texts.append("\N{GREEK SMALL LETTER PSI}: heading [rad]")
    if "t" in factors:
        texts.append("t: time since the beginning of the log [min]")
    if factors & {"u_a", "v_a"}:
        texts.append("u_a, v_a, V_a: apparent wind [m/s]")
    if factors & {"q_v", "q_r"}:
        texts.append("q: a velocity as the water remembers it")
    if factors & {"F_Y", "F_N"}:
        hull = hull_of(vehicle)
        texts.append(
            f"F_Y, F_N: half of {DENSITY:g} kg/m^3 times the draught of {hull.draught:.12g} m, times |w| w dx, and x "
            f"|w| w dx, with w = v + x r, summed over {STRIPS} strips of the length of {hull.length:.12g} m, each of "
            "width dx, at their middles x [N, N m]"
        )
    return f"{'; '.join(texts)}. Coefficients are in SI units."


def within_factors(vehicle: Vehicle) -> str:
    """What acts within a factor: on the thrust, the water, or the memory; empty where nothing does."""
    symbols = factor_symbols(vehicle)
    found = [stated(vehicle, symbol, _DIGITS, vehicle.parameter(symbol).unit) for symbol in symbols]
    return f"Within the factors act {listing(found)}." if found else ""


def judged(facts: KnownFacts) -> str:
    """Envelope and audit in a line."""
    return f"{facts.envelope_sentence} Audit: {' '.join(facts.audit)}"


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
