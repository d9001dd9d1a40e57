"""Findings: which effects are missing, how sure that is, and what each is worth, as `findings.json` says it."""

from dataclasses import dataclass, field
from typing import Any, Literal

from ..physics.frames import AXES
from .reason import Reason
from .uncertainty import Interval

Verdict = Literal["missing", "possible", "no evidence"]
SCHEMA = "undertow.findings/1"


@dataclass(frozen=True, slots=True)
class FoundTerm:
    """One number of a candidate: its symbol, place in the equation, value [unit] and 95 % interval.

    `value` is what the log asks for, under the limits of this number alone; `in_model` is what the corrected model has,
    which the law of dissipation may hold at another value, and None where the candidate is not added. `inclusion` is
    the share of block ensembles in which sparse selection takes a term that nobody has named; None for named ones.
    """

    symbol: str
    axis: str
    form: str
    value: float
    unit: str
    ci95: Interval | None
    in_model: float | None = None
    inclusion: float | None = None

    @property
    def moved(self) -> bool:
        """True when the law moved it by more than a hundredth."""
        return self.in_model is not None and abs(self.in_model - self.value) > 0.01 * abs(self.value)

    def to_dict(self) -> dict[str, Any]:
        """As `findings.json` writes it."""
        return {
            "symbol": self.symbol,
            "axis": self.axis,
            "form": self.form,
            "value": self.value,
            "unit": self.unit,
            "ci95": None if self.ci95 is None else [self.ci95.lower, self.ci95.upper],
            **({"in_model": self.in_model} if self.inclusion is None else {"inclusion": self.inclusion}),
        }


@dataclass(frozen=True, slots=True)
class FoundEffect:
    """The findings on one effect of the catalogue.

    Attributes
    ----------
    effect, family, equation : from the catalogue
    sentence : the finding in words, with numbers
    verdict : "missing" (the tool would add it), "possible" (it may be there, this log cannot tell), "no evidence"
    confidence : share of block resamples in which it earns its price and is material, divided among it and its
        look-alikes, 0..1
    error_drop : held-out force error that it removes, as a share of the nominal model's, on its best axis, 0..1
    indistinguishable_from : effects that would explain this log as well
    terms : its numbers
    reason : why it is not called missing; None where it is
    """

    effect: str
    sentence: str
    family: str
    equation: str
    verdict: Verdict
    confidence: float
    error_drop: float
    indistinguishable_from: tuple[str, ...]
    terms: tuple[FoundTerm, ...]
    reason: Reason | None = None

    def to_dict(self) -> dict[str, Any]:
        """As `findings.json` writes it."""
        return {
            "effect": self.effect,
            "sentence": self.sentence,
            "family": self.family,
            "equation": self.equation,
            "verdict": self.verdict,
            "reason": None if self.reason is None else self.reason.value,
            "confidence": self.confidence,
            "error_drop": self.error_drop,
            "indistinguishable_from": list(self.indistinguishable_from),
            "terms": [term.to_dict() for term in self.terms],
        }


@dataclass(frozen=True, slots=True)
class Calibrated:
    """One parameter before and after.

    Attributes
    ----------
    symbol, unit : name and SI unit
    before, after : values
    wanted : what the log alone asks for; differs from `after` where the law of dissipation holds the parameter
    ci95 : 95 % interval about `wanted`, cut at the physical limits; None for a parameter that moves in steps, or that
        the log alone puts at a limit
    at_limit : True where it does
    """

    symbol: str
    unit: str
    before: float
    after: float
    wanted: float
    ci95: Interval | None
    at_limit: bool = False

    @property
    def held(self) -> bool:
        """True when the law holds the parameter outside its interval."""
        return self.ci95 is not None and not self.ci95.lower <= self.after <= self.ci95.upper

    def to_dict(self) -> dict[str, Any]:
        """As `findings.json` writes it."""
        ends = None if self.ci95 is None else [self.ci95.lower, self.ci95.upper]
        return {
            "symbol": self.symbol,
            "before": self.before,
            "after": self.after,
            "wanted": self.wanted,
            "unit": self.unit,
            "ci95": ends,
            "at_limit": self.at_limit,
            "held_by_law": self.held,
        }


@dataclass(frozen=True, slots=True)
class Findings:
    """What discovery concludes from a log.

    Attributes
    ----------
    verdict : "missing", "nothing missing" or "undecided"
    headline : the verdict in a sentence
    missing : effects that the tool would add, the most valuable first
    candidates : every effect of the catalogue, best first
    unnamed : terms that nobody has named but the log asks for
    steps : errors after each addition, on held-out data only
    failures : where the nominal model fails
    advice : manoeuvres that would tell what this log cannot
    criterion : what an effect had to satisfy
    identifiability : what the log can show and tell apart
    data : rows, seconds, split and notes
    passivity : whether the corrected model dissipates over the envelope of the log, and what that cost
    calibrated : parameters of the nominal model that were calibrated while effects were judged (`discover --refit`)
    left : why others were not, by symbol
    absorbed : effects that cannot be judged beside the calibration, which would do the same
    warnings : what is wrong with the log itself, to be read before the headline
    """

    verdict: Literal["missing", "nothing missing", "undecided"]
    headline: str
    missing: tuple[str, ...]
    candidates: tuple[FoundEffect, ...]
    unnamed: tuple[FoundTerm, ...]
    criterion: dict[str, Any]
    advice: tuple[dict[str, str], ...] = ()
    identifiability: dict[str, Any] = field(default_factory=dict)
    steps: tuple[dict[str, Any], ...] = ()
    failures: tuple[dict[str, Any], ...] = ()
    data: dict[str, Any] = field(default_factory=dict)
    passivity: dict[str, Any] = field(default_factory=dict)
    calibrated: tuple[Calibrated, ...] = ()
    left: dict[str, str] = field(default_factory=dict)
    absorbed: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """As `findings.json` writes it (schema `undertow.findings/1`)."""
        return {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "warnings": list(self.warnings),
            "headline": self.headline,
            "missing": list(self.missing),
            "candidates": [candidate.to_dict() for candidate in self.candidates],
            "unnamed": [term.to_dict() for term in self.unnamed],
            "calibrated": [one.to_dict() for one in self.calibrated],
            "left": [{"symbol": symbol, "why": why} for symbol, why in self.left.items()],
            "absorbed": list(self.absorbed),
            "steps": list(self.steps),
            "failures": list(self.failures),
            "advice": list(self.advice),
            "identifiability": self.identifiability,
            "criterion": self.criterion,
            "passivity": self.passivity,
            "data": self.data,
        }


def axis_name(index: int | None, default: str) -> str:
    """Name of an axis by index; the default where a parameter acts on more than one."""
    return default if index is None else AXES[index]
