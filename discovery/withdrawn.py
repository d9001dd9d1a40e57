"""A discovery taken back: what was found errs more where it saw nothing, so nothing is called missing or changed."""

from dataclasses import replace

import numpy as np

from ..physics.effects import BY_NAME, COMMAND_OFFSET
from ..physics.in_words import listing, words
from ..physics.laws.damping_power import envelope_of
from .discover import Discovery
from .findings import Findings, Left, SensorError
from .found_effects import FoundEffect
from .lawful.passivity import judge
from .reason import Reason

_HEADLINE = "Undecided: what was found does not hold where it saw nothing of this log."
_REASON = "It was {found}. There, the model with {them} {why}: nothing is changed."
_DROPPED = "calibrated, the model {why}, where it saw nothing of the log"
_PLAIN = "Nothing material is missing that this log can show."
_STILL = "The model's numbers stay as they are: calibrated, it is no better where it saw nothing of the log."


def calibrated_only(findings: Findings) -> bool:
    """Whether numbers of the nominal model are all that was changed."""
    return bool(findings.calibrated) and not findings.added and not findings.unnamed


def withdrawn(found: Discovery, why: str) -> Discovery:
    """The same discovery with the nominal model as its answer, and all that it would have added as possible.

    Parameters
    ----------
    why : what its model does on rows that neither its search nor its fit saw, as a part of a sentence
    """
    nominal, basis = found.nominal, found.basis
    error = np.sqrt((basis.forces.balance(nominal) ** 2).mean(axis=0))
    basis.forces.forget()
    return replace(
        found,
        corrected=nominal.with_values({}, name=found.corrected.name),
        steps=found.steps[:1],
        findings=_without(found, why),
        force_error=error,
        unseen=replace(found.unseen, steps=()),
    )


def _without(found: Discovery, why: str) -> Findings:
    """The findings without anything that is sure or changed."""
    findings = found.findings
    calibrated = [item.symbol for item in findings.calibrated]
    left = tuple(Left(symbol=symbol, why=_DROPPED.format(why=why)) for symbol in calibrated)
    same = findings.but(
        calibrated=(),
        left=(*left, *findings.left),
        passivity=judge(found.nominal, envelope_of(found.basis.forces.motions, found.nominal)),
    )
    if calibrated_only(findings):
        headline = _PLAIN if findings.verdict == "nothing missing" else findings.headline
        return same.but(headline=headline, reasons=(*findings.reasons, _STILL))
    kept = findings.added
    terms = [term.symbol or f"{term.axis}:{term.form}" for term in findings.unnamed]
    names = [words(c.effect) for c in kept]
    names += [f"what nobody has named ({listing(terms)})"] * bool(terms)
    names += [f"calibrated {listing(calibrated)}"] * bool(calibrated)
    them = "it" if len(names) == 1 else "them"
    hidden = found.hidden.findings if found.hidden else ()
    return same.but(
        verdict="undecided",
        headline=_HEADLINE,
        reasons=(_REASON.format(found=listing(names), them=them, why=why),),
        missing=(),
        candidates=tuple(_possible(c, why) if c in kept else c for c in findings.candidates),
        unnamed=(),
        sensors=tuple(_in_doubt(s) if s in hidden or s.what == COMMAND_OFFSET.symbol else s for s in findings.sensors),
        folds=None if findings.folds is None else findings.folds.but(same_names=None),
    )


def _in_doubt(sensor: SensorError) -> SensorError:
    """An error of a sensor that was found beside what is taken back."""
    return sensor.but(verdict="possible") if sensor.verdict == "present" else sensor


def _possible(effect: FoundEffect, why: str) -> FoundEffect:
    """An effect that was to be added, and is not."""
    meaning = BY_NAME[effect.effect].meaning
    return effect.but(
        verdict="possible",
        reason=Reason.WORSE_UNSEEN,
        sentence=Reason.WORSE_UNSEEN.tell(meaning, why),
        terms=tuple(term.but(in_model=None) for term in effect.terms),
    )
