"""What is known about a model and stands in every export: envelope, verdict, intervals, sources, what is left out."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..physics.laws.damping_power import Envelope
from ..physics.printable import one_line

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
    def told(self) -> str:
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

    def without(self, left_out: Sequence[str]) -> "KnownFacts":
        """The same of a format that does not express some things."""
        return replace(self, left_out=tuple(left_out))

    @property
    def origin(self) -> str:
        """Whose model it is, and what it was made from."""
        return f"Model of {self.name}, made by undertow {self.version} from {self.source}."

    @property
    def envelope_told(self) -> str:
        """The envelope in a sentence."""
        ends = zip("uvr", self.envelope.lower, self.envelope.upper, ("m/s", "m/s", "rad/s"), strict=True)
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
            f"Envelope. {self.envelope_told} Beyond it nobody has looked.",
            f"Audit. {self.audit[0]}",
            *(f"- {each}" for each in self.audit[1:]),
            "Numbers.",
            *(f"- {each.told}" for each in self.numbers),
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
