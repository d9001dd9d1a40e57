"""What a law says of a model (a `Ruling`), and what every law is."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from ...frames import Array
from ...reading import Plain
from ..damping_power import state_in_words
from .witness import Witness

Verdict = Literal["pass", "fail", "not applicable"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ruling:
    """What one law says of a model.

    Attributes
    ----------
    law : its name
    verdict : pass, fail, or not applicable
    counts : whether a failure makes the audit fail
    value, limit, unit : worst value found, and the largest that is allowed; None where there is none
    at : the state of the worst value, by name
    share : of quasi-random states, windows or rollouts that break the law
    proof : what the verdict rests on
    sentence : the same in plain words
    against : states u, v, r, heading and commands (n, 4 + thrusters) that were met against it; None of a law of which
        no state tells
    """

    law: str
    verdict: Verdict
    proof: str
    sentence: str
    counts: bool = True
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    at: dict[str, float] | None = None
    share: float | None = None
    against: Array | None = field(default=None, compare=False, repr=False)

    @property
    def margin(self) -> float | None:
        """How far the worst value lies below the limit; negative for a violation."""
        return None if self.value is None or self.limit is None else self.limit - self.value

    def to_dict(self) -> Plain:
        """As `audit.json` writes it."""
        worst = None if self.value is None else {"value": self.value, "unit": self.unit, "at": self.at or {}}
        margin = None if self.margin is None else {"value": self.margin, "unit": self.unit}
        return {
            "law": self.law,
            "verdict": self.verdict,
            "counts": self.counts,
            "violating_share": self.share,
            "proof": self.proof,
            "worst": worst,
            "margin": margin,
            "sentence": self.sentence,
        }


class Law(ABC):
    """A law.

    Attributes
    ----------
    name : as tables and files call it
    place : where it is told, low numbers first; the mass is first, since nothing else means much without it
    counts : whether a model that breaks it fails the audit
    """

    name: ClassVar[str]
    place: ClassVar[int] = 1000
    counts: ClassVar[bool] = True

    @abstractmethod
    def judge(self, witness: Witness) -> Ruling:
        """Say whether the model keeps the law."""

    def rule(
        self,
        *,
        value: float,
        limit: float,
        unit: str,
        at: dict[str, float] | None,
        share: float | None,
        proof: str,
        kept: str,
        broken: str,
    ) -> Ruling:
        """The ruling on a worst value, with the sentence for either case."""
        holds = value <= limit
        return Ruling(
            law=self.name,
            counts=self.counts,
            verdict="pass" if holds else "fail",
            value=value,
            limit=limit,
            unit=unit,
            at=at,
            share=share,
            proof=proof,
            sentence=kept if holds else broken,
        )

    def pass_over(self, why: str) -> Ruling:
        """The ruling where the law cannot be asked."""
        return Ruling(law=self.name, counts=self.counts, verdict="not applicable", proof="none", sentence=why)


_UNBOUNDED = 1e12
"""What stands for a ratio without bound: far above any that is bounded, and within what a run folder may hold."""


def in_words(at: dict[str, float]) -> str:
    """A state in words.

    >>> in_words({"u": 0.5, "v": -0.1, "r": 0.0, "psi": 1.0})
    'u = 0.50 m/s, v = -0.10 m/s, r = 0.00 rad/s, heading 57 degrees'
    """
    text = state_in_words((at["u"], at["v"], at["r"]))
    return text + (f", heading {np.degrees(at['psi']):.0f} degrees" if "psi" in at else "")


def let_pass(witness: Witness, limit: float) -> str:
    """What is let pass, in words, behind what was found; nothing for a formula, which is held to rounding."""
    return "" if witness.exact else f", where {limit:.3g} W is let pass"


def finite(value: float) -> float:
    """The value, or in the place of what grew without bound a number that a file can hold, margins included."""
    return max(-_UNBOUNDED, min(value, _UNBOUNDED)) if value == value else _UNBOUNDED
