"""From evidence to words: verdicts, sentences and the headline."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...physics.effects import EFFECTS
from ...physics.frames import AXES, Array
from ...physics.in_words import listing, words
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..balance.rollout_test import HORIZON, WHOLE_HORIZON, WORSE
from ..candidates.candidate import Candidate, Kind, measurable
from ..findings import Advice, Criterion, Findings, LastingRest, OtherForm, axis_name
from ..found_effects import FoundEffect, FoundTerm, Verdict
from ..identifiability.visible import Identifiability
from ..lawful.passivity import Lawful
from ..reason import Reason
from ..search.bootstrap import Interval
from ..search.chance import REHEARSALS
from ..search.floating import ALIVE, Search
from .all_thrusters import ONE, all_thrusters
from .invariance import Invariance
from .other_forms import OtherForms
from .weighing import PERHAPS, Evidence, parameter_total

_AXIS_OF = {"thruster": "thrust", "environment": "all", "mass": "all", "memory": "all"}
_LEAST_FORCE = 1e-3
"""Force scale [in the unit of the balance] below which a noise-free log shows a boat at rest."""
_HELD = "Dissipation over the envelope holds {0} at {1:.3g} {2} in the corrected model; the log asks for {3:.3g}."
_IN_THE_MODEL = (
    *(Reason.DOUBTFUL_VALUE, Reason.OTHER_FORM, Reason.LASTING_REST, Reason.UNJUDGED_RIVAL, Reason.NOT_IN_MOST_FOLDS),
    *(Reason.MOSTLY_DOUBTED, Reason.UNTOLD, Reason.WEAK),
)
"""Why an effect may be there that is not called missing: it stands in the corrected model, or nearly did."""
_FAINT = "it would explain what moves {0} for certain"
_STILL = "Undecided: the boat hardly moves in this log, so it can tell nothing."


class Doubt(NamedTuple):
    """Why an effect is not certain that stands in the corrected model, what is told of that, and the form it rivals."""

    reason: Reason
    told: str = ""
    form: OtherForm | None = None


def doubt_of(evidence: Evidence) -> Doubt:
    """Why an effect is not sure by its own evidence, where it stands in the model all the same."""
    return Doubt(evidence.reason, _told(evidence, evidence.reason))


@dataclass(frozen=True, slots=True, eq=False)
class Grounds:
    """What findings are made of.

    Attributes
    ----------
    search : with the nominal vehicle and all candidates that were searched for
    lawful : the model with the kept effects, and how the law stands in it
    considered : the model with everything that the search selected, sure or not
    evidence : on every candidate, best first
    intervals : 95 % intervals of total values by symbol
    kept : keys of the effects that stand in the corrected model
    order : keys in the order in which they are added
    known : what the log can show and tell apart
    included : share of block ensembles in which a term without a name is selected, by symbol
    unseen : candidates that the search could not judge
    doubtful : why kept effects are not certain all the same, by key: they stay in the model, and are not called missing
    rests : what lasts and is explained by nothing
    other_forms : what the rest of the model follows, and by how much effects change beside that
    invariant : the size of each kept effect in the parts of the log, by key
    """

    search: Search
    lawful: Lawful
    considered: Vehicle
    evidence: Sequence[Evidence]
    intervals: Mapping[str, Interval]
    kept: Sequence[str]
    order: Sequence[str | None]
    known: Identifiability | None = None
    included: Mapping[str, float] = field(default_factory=dict)
    unseen: Sequence[Candidate] = ()
    doubtful: Mapping[str, Doubt] = field(default_factory=dict)
    rests: Sequence[LastingRest] = ()
    other_forms: OtherForms = field(default_factory=OtherForms)
    invariant: Mapping[str, Invariance] = field(default_factory=dict)


def conclude(grounds: Grounds, advice: tuple[Advice, ...] = (), others: Sequence[FoundEffect] = ()) -> Findings:
    """Write the findings.

    Parameters
    ----------
    advice : manoeuvres that would settle what the log leaves open
    others : findings on effects that were not searched for
    """
    g, search, lawful, kept, doubtful = grounds, grounds.search, grounds.lawful, grounds.kept, grounds.doubtful
    pool = {candidate.key: candidate for candidate in (*search.pool, *g.unseen)}
    what, thrust = _what(search), all_thrusters(search.nominal, lawful.vehicle, kept)
    found = [
        _effect(g, pool[e.key], e, what, thrust) for e in _one_each(g.evidence, pool, kept) if e.kind is Kind.EFFECT
    ]
    found += others
    added = [key for key in g.order if key in kept and key is not None and pool[key].kind is Kind.EFFECT]
    missing = tuple(dict.fromkeys(pool[key].effect.name for key in added if key not in doubtful))
    found.sort(key=lambda f: (f.rank, missing.index(f.effect) if f.effect in missing else len(missing)))
    unnamed = tuple(
        term.but(inclusion=g.included.get(e.key, 0.0) if g.included else None)
        for e in g.evidence
        if e.kind is Kind.TERM and (e.key in kept or e.key in g.order)
        for term in found_terms(pool[e.key], search.nominal, lawful.unconstrained, g.intervals)
    )
    open_ends = [e for e in g.evidence if (e.selected and e.key not in kept) or e.faint or e.key in doubtful]
    still = bool((search.force_scale < np.maximum(ALIVE * search.noise_error, _LEAST_FORCE)).all())
    unsure = bool(open_ends) or bool(unnamed) or still or bool(g.rests)
    verdict = "missing" if missing else "undecided" if unsure else "nothing missing"
    headline, reasons = (_STILL, ()) if still and not missing else _headline(g, missing, unnamed, open_ends)
    reasons = (*([thrust] if thrust and ONE in missing else []), *reasons)
    return Findings(
        verdict=verdict,
        headline=headline,
        reasons=reasons,
        missing=missing,
        candidates=tuple(found),
        unnamed=unnamed,
        criterion=_criterion(search),
        advice=advice,
        identifiability=g.known,
        passivity=lawful.passivity,
        rests=tuple(g.rests),
        other_forms=g.other_forms.found,
    )


def unmeasured(motions: Sequence[Motion]) -> tuple[FoundEffect, ...]:
    """The effects that no log without further channels can show, and which channels those are."""
    return tuple(
        FoundEffect(
            effect=effect.name,
            sentence=Reason.NEEDS_CHANNELS.tell(effect.meaning, " and ".join(effect.channels)),
            family=effect.family,
            equation=effect.equation,
            verdict="possible",
            reason=Reason.NEEDS_CHANNELS,
            confidence=0.0,
            error_drop=0.0,
        )
        for effect in EFFECTS
        if effect not in measurable(motions)
    )


def _one_each(evidence: Sequence[Evidence], pool: Mapping[str, Candidate], kept: Sequence[str]) -> list[Evidence]:
    """One entry for each effect: every selected or kept thruster of a per-thruster effect, or else the best."""
    seen = {pool[key].effect.name for key in kept}
    entries = []
    for e in evidence:
        name = pool[e.key].effect.name
        if e.selected or e.key in kept or name not in seen:
            entries.append(e)
            seen.add(name)
    return entries


def _effect(g: Grounds, candidate: Candidate, e: Evidence, what: str, thrust: str) -> FoundEffect:
    """One candidate in words and numbers, those of the corrected model where the effect is kept."""
    effect, nominal, kept, doubt = candidate.effect, g.search.nominal, e.key in g.kept, g.doubtful.get(e.key)
    meaning = thrust if thrust and kept and effect.name == ONE else effect.meaning
    reason = doubt.reason if doubt else None if kept else e.reason
    verdict: Verdict = "missing" if reason is None else "possible" if _open(e, reason) else "no evidence"
    terms: tuple[FoundTerm, ...] = ()
    if e.selected or kept:
        terms = found_terms(candidate, nominal, g.lawful.unconstrained if kept else g.considered, g.intervals)
    if kept:
        model = g.lawful.vehicle
        terms = tuple(t.but(in_model=parameter_total(nominal, candidate, model, t.symbol)) for t in terms)
    if reason is None:
        sentence = f"{meaning} {_alone(candidate, e.share, what)}"
        if e.chance is not None:
            sentence += f" {e.chance.in_words}"
        sentence += "".join(f" {_HELD.format(t.symbol, t.in_model, t.unit, t.value)}" for t in terms if t.moved)
    else:
        sentence = reason.tell(meaning, doubt.told if doubt else _told(e, reason))
    same = g.invariant.get(e.key)
    rivals_by_name = tuple(name.split("[")[0] for name in e.indistinguishable_from)
    return FoundEffect(
        effect=effect.name,
        sentence=sentence,
        family=effect.family,
        equation=effect.equation,
        verdict=verdict,
        reason=reason,
        confidence=e.confidence,
        error_drop=e.error_drop,
        chance=e.chance,
        parts=same.parts if same else (),
        agrees=not same.differs if same and (same.parts or same.differs) else None,
        changes=g.other_forms.changes.get(e.key),
        indistinguishable_from=tuple(dict.fromkeys(rivals_by_name)),
        terms=terms,
    )


def _open(e: Evidence, reason: Reason) -> bool:
    """Whether an effect that is not missing may be there: anything speaks for it, or nothing could speak at all."""
    hidden = e.dormant or e.absorbed or e.noise_limited or bool(e.indistinguishable_from)
    return hidden or reason in _IN_THE_MODEL or e.selected or e.confidence >= PERHAPS


def _told(e: Evidence, reason: Reason) -> str:
    """What the evidence adds to the sentence of a reason."""
    rivals = ", ".join(name.replace("_", " ") for name in e.indistinguishable_from)
    if reason is Reason.FAINT:
        return f"{f'This log cannot tell it from {rivals}' if rivals else 'Perhaps'}: {_FAINT.format(e.faint)}"
    if reason is Reason.CHANCE and e.chance is not None:
        return f"{e.chance.better} of {e.chance.of}"
    return rivals if reason is Reason.LOOK_ALIKES else f"{e.out_of_step:.2f}"


def _alone(candidate: Candidate, share: Array, what: str) -> str:
    """What only this effect explains, on an axis on which its force acts if that is material there.

    The error without the effect is that of the model fitted again without it. It may be larger than the motion itself,
    where rollouts of that model run away; a share would then be absurd.
    """
    own = [p.axis for p in candidate.parameters if p.axis is not None and share[p.axis] > 0.0]
    axis = max(own, key=lambda k: float(share[k])) if own else int(np.argmax(share))
    if share[axis] > 1.0:
        return f"Without it, the model errs by more than all of the {AXES[axis]} {what} in this log."
    return f"It alone accounts for {_percent(share[axis])} of the {AXES[axis]} {what} in this log."


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.01 else f"{100.0 * share:.1f} %"


def found_terms(
    candidate: Candidate, nominal: Vehicle, vehicle: Vehicle, intervals: Mapping[str, Interval]
) -> tuple[FoundTerm, ...]:
    """The numbers of an effect in a vehicle: added amounts where the catalogue counts those, else absolute values."""
    terms = []
    for parameter in candidate.parameters:
        symbol = parameter.symbol
        interval = intervals.get(symbol)
        shift = nominal.value(symbol) if candidate.effect.added else 0.0
        moved = None if interval is None else Interval(interval.lower - shift, interval.upper - shift)
        value = parameter_total(nominal, candidate, vehicle, symbol)
        axis = axis_name(parameter.axis, _AXIS_OF.get(candidate.effect.family, "all"))
        terms.append(
            FoundTerm(symbol=symbol, axis=axis, form=parameter.form, value=value, unit=parameter.unit, ci95=moved)
        )
    return tuple(terms)


def _headline(
    g: Grounds, missing: Sequence[str], unnamed: Sequence[FoundTerm], open_ends: Sequence[Evidence]
) -> tuple[str, tuple[str, ...]]:
    """The verdict in a short sentence, and the reasons for it in others."""
    doubtful, rests = g.doubtful, g.rests
    if missing:
        more = f", and {len(unnamed)} term{'s' * (len(unnamed) > 1)} that nobody has named" if unnamed else ""
        perhaps = f", and perhaps {_listed(doubtful)}" if doubtful else ""
        left = [f"Yet {rest.in_words}." for rest in rests]
        for form in g.other_forms.found[:1]:
            if form.share >= g.search.settings.materiality:
                left.append(f"Yet {form.in_words} stays unexplained, {100.0 * form.share:.0f} % of the force at work.")
        return f"The model is missing {_listed(missing)}{more}{perhaps}.", tuple(left)
    if rests:
        told = [f"{rest.in_words[0].upper()}{rest.in_words[1:]}." for rest in rests]
        told += [f"Beside that, no effect can be named{_perhaps(open_ends)}."]
        told += ["The log asks for terms that nobody has named, too."] * bool(unnamed)
        where = _listed(dict.fromkeys(rest.axis for rest in rests))
        return f"Undecided: part of the force in {where} has no name.", tuple(told)
    if unnamed:
        return "No named effect is missing for sure, but the log asks for terms that nobody has named.", ()
    form = next((doubt.form for doubt in doubtful.values() if doubt.form), None)
    if form is not None:
        nearest = _listed(key for key, doubt in doubtful.items() if doubt.form and doubt.form.axis == form.axis)
        rival = f"{form.in_words[0].upper()}{form.in_words[1:]}"
        told = f"{rival} explains this log as well as or better than what has a name ({nearest})."
        return f"Undecided: the force in {form.axis} may be one that has no name.", (told,)
    if open_ends:
        names = _listed(e.key for e in open_ends)
        if all(e.rollouts_object for e in open_ends):
            told = f"The force balance asks for {names}, but predictions get worse with it."
            return "Undecided: what the forces ask for makes predictions worse.", (told,)
        if all(e.faint for e in open_ends):
            where = " and ".join(dict.fromkeys(e.faint for e in open_ends))
            told = f"It is too near the sensor noise to name{_perhaps(open_ends)}."
            return f"Undecided: something faint is missing in {where}.", (told,)
        told = f"It may be {names}; none of it is sure."
        return "Undecided: something is missing, but this log cannot tell what.", (told,)
    return "Nothing material is missing: the model explains this log.", ()


def _perhaps(open_ends: Sequence[Evidence]) -> str:
    return f" (perhaps {_listed(e.key for e in open_ends)})" if open_ends else ""


def _listed(names: Iterable[str]) -> str:
    return listing([words(name) for name in names])


def _what(search: Search) -> str:
    """Of what shares are taken."""
    return "force at work" if search.balance.forces else "motion that the forces make"


def _criterion(search: Search) -> Criterion:
    settings = search.settings
    what = _what(search)
    return Criterion(
        materiality=settings.materiality,
        certainty=(
            f"each parameter earns a held-out log-likelihood of {settings.price:g} "
            f"({settings.unnamed_price:g} for a term without a name and for each gain of a thrust curve) in 9 of 10 "
            f"block resamples, and more than any effect earns in {REHEARSALS} rehearsals of nothing (noise "
            "like what the model leaves without it, of the same colour and size: that speaks of such noise alone)"
        ),
        material=(
            f"it alone explains at least {100.0 * settings.materiality:g} % of the {what} on some axis, or "
            f"{100.0 * settings.least:g} %, and {WHOLE_HORIZON:g} s rollouts change by {100.0 * settings.weight:g} % "
            "without it"
        ),
        rollouts=(
            f"5 s rollouts with it, and {WHOLE_HORIZON if search.balance.forces else HORIZON:g} s rollouts of all "
            "together, are not worse "
            f"(by {100.0 * WORSE:g} %, and surely so: 95 % intervals from blocks of time)"
        ),
        unit=dict(zip(AXES, search.balance.unit, strict=True)),
        force_scale={a: float(s) for a, s in zip(AXES, search.force_scale, strict=True)},
        search=(
            f"floating (add, drop, swap, reshape) over {len(EFFECTS)} effects, "
            f"scored on {search.balance.blocks} held-out blocks"
        ),
    )
