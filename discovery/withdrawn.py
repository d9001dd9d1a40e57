"""A discovery taken back: what was found errs more where it saw nothing, so nothing is called missing or changed."""

from dataclasses import replace

import numpy as np

from ..physics.effects import BY_NAME
from ..physics.in_words import listing, words
from ..physics.laws.damping_power import envelope_of
from .discover import Discovery
from .findings import Findings, Left
from .found_effects import FoundEffect
from .lawful.passivity import judge
from .reason import Reason

_HEADLINE = (
    "Undecided: {found} {hold} not hold. Fitted without a part of this log, the model with {them} {why} there, so "
    "nothing is changed."
)


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
    kept = [c for c in findings.candidates if any(term.in_model is not None for term in c.terms)]
    calibrated = [item.symbol for item in findings.calibrated]
    effects = [words(c.effect) for c in kept] + ["what nobody has named"] * bool(findings.unnamed)
    names = [*effects, *[f"calibrated {listing(calibrated)}"] * bool(calibrated)] or ["what was found"]
    hold, them = ("does", "it") if len(names) == 1 and len(calibrated) < 2 else ("do", "them")
    left = tuple(Left(symbol=symbol, why=f"fitted to other parts of the log, the model {why}") for symbol in calibrated)
    envelope = envelope_of(found.basis.forces.motions, found.nominal)
    return findings.but(
        verdict="undecided",
        headline=_HEADLINE.format(found=listing(names), hold=hold, them=them, why=why),
        missing=(),
        candidates=tuple(_possible(c, why) if c in kept else c for c in findings.candidates),
        unnamed=(),
        calibrated=(),
        left=(*left, *findings.left),
        passivity=judge(found.nominal, envelope),
    )


def _possible(effect: FoundEffect, why: str) -> FoundEffect:
    """An effect that was to be added, and is not."""
    meaning = BY_NAME[effect.effect].meaning
    return effect.but(
        verdict="possible",
        reason=Reason.WORSE_UNSEEN,
        sentence=Reason.WORSE_UNSEEN.tell(meaning, why),
        terms=tuple(term.but(in_model=None) for term in effect.terms),
    )
