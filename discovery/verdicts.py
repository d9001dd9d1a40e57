"""Words of the evidence: verdicts, sentences and the headline."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..physics.effects import BY_NAME, EFFECTS
from ..physics.motion import AXES, Array, Motion
from ..physics.presentation import listing, number, sentence_case, words
from ..physics.vehicle import Vehicle
from .balance.shooting import TRIFLE
from .balance.starts import WHOLE_HORIZON
from .candidates.candidate import Candidate, Kind, measurable, needs_sway
from .claims import Tests
from .effect_findings import (
    LIKELY,
    MISSING,
    Claim,
    EffectFinding,
    FittedTerm,
    Reason,
    Verdict,
    found_terms,
    parameter_total,
    rounded_probability,
)
from .evidence.invariance import ONE_SIZE
from .evidence.weighing import PERHAPS, Evidence
from .findings import (
    NOTHING,
    Criterion,
    Findings,
    NamelessForce,
    OtherForm,
    PersistentResidual,
    comes_and_goes,
    leading_force,
)
from .identifiability.rehearsal import Identifiability
from .judgement import largest_doubt, odds, probability, share
from .judgement import verdict as judged
from .lawful.refit import Lawful
from .search.estimation import Interval
from .search.floating import ALIVE, Search
from .search.rival_explanations import ONE, all_thrusters
from .search.scoring import MATERIAL

_SAID = ("missing", "likely")
PROBABLE = 0.5 * LIKELY
"""Odds from which on an undecided log tells of a name first: with a look-alike that does as well it may be likely."""
_LEAST_FORCE = 1e-3
"""Force scale [in the unit of the balance] that rounding makes in a noise-free log of a boat at rest."""
_HELD = "Dissipation over the envelope holds {0} at {1:.3g} {2} in the corrected model; the log asks for {3:.3g}."
_FAINT = "it would explain what moves {0} for certain"
_SUMS = {"N_rdot": "; or inertia_z, for a log shows inertia_z - N_rdot alone"}
"""What else of the file may be off where a number seems to be."""
_STILL = "Undecided: the forces at work are hardly more than what sensor noise makes, so this log can tell nothing."


@dataclass(frozen=True, slots=True, eq=False)
class VerdictInputs:
    """Inputs of a verdict.

    Attributes
    ----------
    search : with the nominal vehicle and all candidates that were searched for
    lawful : the model with the kept effects, and how the law stands in it
    considered : the model with everything that the search selected, sure or not
    evidence : on every candidate, best first
    intervals : 95 % intervals of total values by symbol
    kept : keys of the effects that stand in the corrected model
    order : keys in the order in which they are added
    claims : of the names that were selected, by key
    tests : what each test found
    known : what the log can show and tell apart
    included : share of block ensembles in which a term without a name is selected, by symbol
    unseen : candidates that the search could not judge
    added_by_name : effects that somebody added by name, and what a search said of them, by key
    sure : the probability that a search gave to others that somebody added by name, by key
    persistent : what lasts and is explained by nothing
    passing : where rollouts judge, shares of the force at work that the force balance leaves, by axis, largest first
    """

    search: Search
    lawful: Lawful
    considered: Vehicle
    evidence: Sequence[Evidence]
    intervals: Mapping[str, Interval]
    kept: Sequence[str]
    order: Sequence[str | None]
    claims: Mapping[str, Claim] = field(default_factory=dict)
    tests: Tests = field(default_factory=Tests)
    known: Identifiability | None = None
    included: Mapping[str, float] = field(default_factory=dict)
    unseen: Sequence[Candidate] = ()
    added_by_name: Mapping[str, str] = field(default_factory=dict)
    sure: Mapping[str, float] = field(default_factory=dict)
    persistent: Sequence[PersistentResidual] = ()
    passing: Mapping[str, float] = field(default_factory=dict)


def conclude(grounds: VerdictInputs, others: Sequence[EffectFinding] = ()) -> Findings:
    """Write the findings, all but what to drive next.

    Parameters
    ----------
    others : findings on effects that were not searched for
    """
    g, search, lawful, kept = grounds, grounds.search, grounds.lawful, grounds.kept
    pool = {candidate.key: candidate for candidate in (*search.pool, *g.unseen)}
    thrust = all_thrusters(search.nominal, lawful.vehicle, kept)
    shared = _shared_odds(g.claims, g.evidence)
    found = [
        _effect(g, pool[e.key], e, shared, thrust) for e in _one_each(g.evidence, pool, kept) if e.kind is Kind.EFFECT
    ]
    found += others
    found.sort(key=lambda f: (f.rank, -f.confidence))
    missing, likely = (tuple(dict.fromkeys(f.effect for f in found if f.verdict == word)) for word in _SAID)
    unnamed = tuple(
        term.but(inclusion=g.included.get(e.key, 0.0) if g.included else None)
        for e in g.evidence
        if e.kind is Kind.TERM and (e.key in kept or e.key in g.order)
        for term in found_terms(pool[e.key], search.nominal, lawful.unconstrained, g.intervals)
    )
    in_play = [f for f in found if f.verdict == "possible" and _in_play(f)]
    written = max((f.confidence for f in in_play if f.in_model), default=0.0)
    in_play = [f for f in in_play if f.in_model or (f.claim and f.confidence > written)] if written else in_play
    still = bool((search.force_scale < np.maximum(ALIVE * search.noise_error, _LEAST_FORCE)).all())
    material = [form for form in g.tests.forms.selected if form.share >= search.settings.materiality]
    unsure = bool(in_play) or still or bool(g.persistent) or _nameless(g, unnamed, material) is not None
    verdict = "missing" if missing else "likely" if likely else "undecided" if unsure else "nothing missing"
    other_forms, instead = g.tests.forms.selected, _best_substitute(g, in_play) if verdict == "undecided" else None
    forms = other_forms if instead is None else (*other_forms, instead[1])
    unlikely = verdict == "undecided" and not still and not (in_play and _is_told_first(in_play[0]))
    findings = Findings(
        verdict=verdict,
        missing=missing,
        likely=likely,
        candidates=tuple(found),
        unnamed=unnamed,
        criterion=_criterion(search),
        identifiability=g.known,
        passivity=lawful.passivity,
        rests=tuple(g.persistent),
        passing=g.passing,
        other_forms=forms,
        nameless=_nameless(g, unnamed, [*material, *([instead[1]] if instead else [])] or forms) if unlikely else None,
    )
    headline, reasons = (_STILL, ()) if still and not (missing or likely) else _headline(g, findings, in_play)
    if instead is not None:
        name, form = instead
        reasons = (*reasons, f"{sentence_case(form.in_words)} explains more than {name} does.")
    reasons = (*([thrust] if thrust and ONE in (*missing, *likely) else []), *reasons)
    return findings.but(headline=headline, reasons=reasons)


def _is_told_first(first: EffectFinding) -> bool:
    """Whether an undecided log tells of its best name before any force without one."""
    return first.reason is Reason.FAINT or first.confidence >= PROBABLE


def _nameless(g: VerdictInputs, unnamed: Sequence[FittedTerm], forms: Sequence[OtherForm]) -> NamelessForce | None:
    """The force without a name that is known best."""
    return leading_force(
        [(term.axis, term.form) for term in unnamed],
        [(form.axis, form.follows, form.share) for form in forms],
        [rest.axis for rest in g.persistent if rest.axis in AXES],
        rollouts=not g.search.balance.forces,
    )


def _best_substitute(g: VerdictInputs, in_play: Sequence[EffectFinding]) -> tuple[str, OtherForm] | None:
    """The name in whose place one free force explains most, more by what a term without a name must earn; the force."""
    told = {(form.axis, form.follows) for form in g.tests.forms.selected}
    refits = [(f, g.tests.forms.refits.get(f.key)) for f in in_play if f.in_model]
    better = [
        (refit.margin, words(f.key), refit.form)
        for f, refit in refits
        if refit and refit.form and (refit.margin or 0.0) >= g.search.settings.unnamed_price
    ]
    best = max(better, key=lambda one: one[0] or 0.0, default=None)
    return None if best is None or (best[2].axis, best[2].follows) in told else best[1:]


def _in_play(effect: EffectFinding) -> bool:
    """True when an effect that is only possible leaves a question open: it is no trifle, or moves a quiet axis."""
    if effect.claim is None:
        return effect.reason is Reason.FAINT
    worth = effect.claim.worth
    return max(worth.force, worth.rollout or 0.0) >= TRIFLE


def _shared_odds(claims: Mapping[str, Claim], evidence: Sequence[Evidence]) -> dict[str, float]:
    """The probability of each name: of claims their own; what is left of it is shared by their look-alikes."""
    result = {key: probability(claim) for key, claim in claims.items()}
    for e in (e for e in evidence if e.key in claims and e.indistinguishable_from):
        others = [key for key in e.indistinguishable_from if key not in claims]
        for key in others:
            share = min((1.0 - result[e.key]) / len(others), result[e.key])
            result[key] = max(result.get(key, 0.0), share)
    return result


def unmeasured(motions: Sequence[Motion]) -> tuple[EffectFinding, ...]:
    """The effects that no log without further channels can show, and which channels those are."""
    return tuple(
        EffectFinding(
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


def _effect(
    g: VerdictInputs, candidate: Candidate, e: Evidence, shared: Mapping[str, float], thrust: str
) -> EffectFinding:
    """One candidate in words and numbers, those of the corrected model where the effect is kept."""
    effect, nominal, kept, claim = candidate.effect, g.search.nominal, e.key in g.kept, g.claims.get(e.key)
    meaning = thrust if thrust and kept and effect.name == ONE else _meaning(candidate, nominal)
    chance = g.sure.get(e.key) or shared.get(e.key, _base_rate(e))
    said: Verdict = judged(claim, chance) if claim and kept else "possible"
    reason = None if said == "missing" else largest_doubt(claim) if claim else e.reason
    if claim is None and not _open(e, e.reason):
        said = "no evidence"
    if e.key in g.added_by_name:
        said, reason = "possible", Reason.UNFOUND
    terms: tuple[FittedTerm, ...] = ()
    if claim is not None or kept:
        terms = found_terms(candidate, nominal, g.lawful.unconstrained if kept else g.considered, g.intervals)
    if kept:
        terms = tuple(t.but(in_model=parameter_total(nominal, candidate, g.lawful.vehicle, t.symbol)) for t in terms)
    if reason is None or said == "likely":
        sentence = f"{meaning} {_alone(candidate, e.share, _what(g.search))}"
        sentence += f" {e.chance.in_words}" if e.chance is not None and e.chance.none else ""
        sentence += f" {g.tests.changes[e.key]}" if e.key in g.tests.changes else ""
        sentence += "".join(f" {_HELD.format(t.symbol, t.in_model, t.unit, t.value)}" for t in terms if t.moved)
    else:
        plain = effect.meaning if reason is Reason.FILE_VALUE else meaning  # the file may be right
        sentence = reason.tell(plain, _explanation(g, e, reason, terms))
    same, beside = g.tests.invariant.get(e.key), g.tests.forms.refits.get(e.key)
    rivals_by_name = tuple(name.split("[")[0] for name in e.indistinguishable_from)
    return EffectFinding(
        effect=effect.name,
        sentence=sentence,
        family=effect.family,
        equation=effect.equation,
        verdict=said,
        reason=reason,
        confidence=chance,
        error_drop=e.error_drop,
        claim=claim,
        chance=e.chance,
        parts=same.parts if same else (),
        agrees=same.gap <= ONE_SIZE if same and same.parts else None,
        changes=beside.change if beside and g.tests.forms.selected else None,
        indistinguishable_from=tuple(dict.fromkeys(rivals_by_name)),
        terms=terms,
    )


def _meaning(candidate: Candidate, nominal: Vehicle) -> str:
    """What an effect means, as the catalogue says; of numbers that the vehicle file has, that they are off."""
    own = [p.symbol for p in candidate.parameters if nominal.value(p.symbol) != p.null]
    if not candidate.effect.added or not own:
        return candidate.effect.meaning
    return f"What the vehicle file says of {listing(own)} is not what this log shows."


def _base_rate(e: Evidence) -> float:
    """How often a name that no search selected is true; of those that would explain a quiet axis, their share."""
    if e.faint:
        return e.confidence
    return odds().nearly if e.confidence >= PERHAPS else odds().unselected


def _open(e: Evidence, reason: Reason) -> bool:
    """True when an effect that is no claim may be there: anything speaks for it, or nothing could speak at all."""
    hidden = e.dormant or e.unjudged or e.absorbed or e.noise_limited or bool(e.indistinguishable_from)
    return hidden or reason is Reason.WEAK or e.confidence >= PERHAPS


def _explanation(g: VerdictInputs, e: Evidence, reason: Reason, terms: Sequence[FittedTerm]) -> str:
    """What the evidence adds to the sentence of a reason."""
    rivals = ", ".join(map(words, e.indistinguishable_from))
    if reason is Reason.FAINT:
        return f"{f'This log cannot tell it from {rivals}' if rivals else 'Perhaps'}: {_FAINT.format(e.faint)}"
    if reason is Reason.FILE_VALUE:
        where, symbols = "near" if g.claims[e.key].null_excluded else "within", [t.symbol for t in terms]
        filed = any(g.search.nominal.value(s) != g.search.nominal.parameter(s).null for s in symbols)
        says = "what the vehicle file says" if filed else "none of it, as in the vehicle file,"
        return f"{says} lies {where} the 95 % interval of {listing(symbols)}"
    return g.added_by_name.get(e.key) or g.tests.explanations(e).get(reason, rivals)


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
    if 0.995 <= share < 1.0:
        return "> 99 %"
    return f"{100.0 * share:.0f} %" if share >= 0.01 else f"{100.0 * share:.1f} %"


def _headline(g: VerdictInputs, findings: Findings, in_play: Sequence[EffectFinding]) -> tuple[str, tuple[str, ...]]:
    """The verdict in a short sentence, and what else is to be known in others."""
    found, unnamed = findings.candidates, findings.unnamed
    missing, likely = ([f for f in found if f.verdict == word] for word in _SAID)
    rests = [f"{sentence_case(rest.in_words)}." for rest in g.persistent]
    lead = findings.nameless
    forms = g.tests.forms.selected
    told = [form for form in forms if lead and (form.axis, form.follows) == (lead.axis, lead.follows)]
    for form in (*told, *forms)[:1]:
        if findings.verdict != "nothing missing" and form.share >= g.search.settings.materiality:
            share = f"{100.0 * form.share:.0f} % of the force at work"
            rests.append(f"{sentence_case(form.in_words)} stays unexplained, {share}.")
    terms = _so_many(len(unnamed))
    for said, probably in ((missing, ""), (likely, "probably ")):
        if said:
            return f"{_what_is_wrong(said, g.search.nominal, terms if unnamed else '', probably)}.", tuple(rests)
    if findings.verdict == "undecided":
        return _undecided(g, findings, in_play, rests)
    unjudged = [axis for axis, scale in zip(AXES, g.search.force_scale, strict=True) if scale <= NOTHING]
    judged_not = {e.key for e in g.evidence if e.unjudged}
    unjudged += ["laws of sway"] * any(needs_sway(c) for c in g.unseen if c.key in judged_not)
    if unjudged:
        text = f"Nothing material is missing that this log can show; {listing(unjudged)} could not be judged."
        return text, tuple(rests)
    passing = comes_and_goes(g.passing)
    if passing:
        return f"Nothing material is missing that this log can show: {passing}", tuple(rests)
    return "Nothing material is missing: the model explains this log.", tuple(rests)


def _undecided(
    g: VerdictInputs, findings: Findings, in_play: Sequence[EffectFinding], rests: Sequence[str]
) -> tuple[str, tuple[str, ...]]:
    """What an undecided log tells of first, a name or a force without one, and what else is to be known."""
    passing, force = comes_and_goes(_passing_alone(g, findings)), findings.nameless
    told = _at_best(in_play[0], findings.candidates) if in_play else ""
    reasons = [*rests, *[passing] * bool(passing)]
    none = f"no name is likely ({words(in_play[0].key)} {_odds(in_play[0])})" if in_play else "has no name"
    axes = listing(list(dict.fromkeys(rest.axis for rest in g.persistent)))
    keeps = bool(g.persistent) and g.persistent[0].axis not in AXES
    side = f"part of the force keeps to {axes}, whichever way the hull points, and {none}"
    if force is not None:
        told = f"part of the {force.axis} {force.kind} {force.acts}, and {none}"
        more = sum(term.axis != force.axis for term in findings.unnamed)
        if more:
            reasons.append(f"On other axes, the log asks for {_so_many(more)}.")
    elif in_play and keeps and not _is_told_first(in_play[0]):
        told = side
    elif in_play:
        first = in_play[0]
        told_of = {first.effect, *first.indistinguishable_from} if "which" in told else {first.effect}
        if any(f.effect not in told_of for f in in_play):
            reasons.insert(0, f"It may be {listing([words(f.key) for f in in_play], 'or')}.")
    else:
        told = side if keeps else f"part of the force in {axes} has no name"
        return f"Undecided: {told}. {passing}".strip(), tuple(rests)
    return f"Undecided: {told}.", tuple(reasons)


def _passing_alone(g: VerdictInputs, findings: Findings) -> dict[str, float]:
    """Shares of the force at work that come and go, by axis, largest first, material ones alone.

    Without what lasts, and without axes on which the rest is known to follow something.
    """
    lasting = {rest.axis: rest.share for rest in g.persistent}
    known = {form.axis for form in findings.other_forms} | {term.axis for term in findings.unnamed}
    alone = {axis: float(np.sqrt(max(s**2 - lasting.get(axis, 0.0) ** 2, 0.0))) for axis, s in g.passing.items()}
    return {
        axis: s for axis, s in sorted(alone.items(), key=lambda item: -item[1]) if s > MATERIAL and axis not in known
    }


def _so_many(count: int) -> str:
    return f"{count} term{'s' * (count > 1)} that nobody has named"


def _what_is_wrong(said: Sequence[EffectFinding], nominal: Vehicle, terms: str, probably: str) -> str:
    """What the model is missing, and which numbers of the file are off: about what they are, and what it says."""
    off = {f.key: _file_numbers(f, nominal) for f in said}
    new = [*(words(f.key) for f in said if not off[f.key]), *([terms] if terms else [])]
    numbers = [
        f"{symbol} (about {_plain(value)}, not {_plain(filed)}{_SUMS.get(symbol, '')})"
        for own in off.values()
        for symbol, value, filed in own
    ]
    wrong = f"file's {listing(numbers)} {'is' if len(numbers) == 1 else 'are'} {probably}off"
    if not new:
        return f"The {wrong}"
    return f"The model is {probably}missing {listing(new)}" + (f", and the {wrong}" if numbers else "")


def _plain(value: float) -> str:
    """Three digits, without an exponent."""
    text = f"{value:.3g}"
    return number(value) if "e" in text else text


def _file_numbers(found: EffectFinding, nominal: Vehicle) -> list[tuple[str, float, float]]:
    """Of an effect whose numbers the vehicle file has: symbol, what the log asks for in all, and what the file says."""
    if not BY_NAME[found.effect].added:
        return []
    own = [(term, nominal.value(term.symbol)) for term in found.terms]
    if any(filed == nominal.parameter(term.symbol).null for term, filed in own):
        return []
    return [(term.symbol, filed + term.value, filed) for term, filed in own]


def _at_best(first: EffectFinding, found: Sequence[EffectFinding]) -> str:
    """What is most probably missing: an effect or one that looks just like it, where that much is known, or perhaps."""
    alike = [f for f in found if f.effect in first.indistinguishable_from and f.effect != first.effect]
    together = first.confidence / share(first.claim) if first.claim else 0.0  # what its look-alikes share with it
    either = listing([words(f.key) for f in (first, *alike)], "or")
    if first.reason is Reason.FAINT:
        return f"{either} is missing, and this log cannot tell which" if alike else f"perhaps {either} is missing"
    if alike and together >= LIKELY:
        return (
            f"{either} is missing ({_percent(rounded_probability(together))} together), and this log cannot tell which"
        )
    return f"something is missing; perhaps {words(first.key)} ({_odds(first)})"


def _odds(effect: EffectFinding) -> str:
    return _percent(rounded_probability(effect.confidence))


def _what(search: Search) -> str:
    """Of what shares are taken."""
    return "force at work" if search.balance.forces else "motion that the forces make"


def _criterion(search: Search) -> Criterion:
    settings = search.settings
    what = _what(search)
    return Criterion(
        materiality=settings.materiality,
        certainty=(
            f"missing from {100.0 * MISSING:.0f} % and likely from {100.0 * LIKELY:.0f} % on, its interval clear of "
            "the value in the file: a probability calibrated on worlds whose truth is known (docs/judgement.md)"
        ),
        material=(
            f"it alone explains at least {100.0 * settings.materiality:g} % of the {what} on some axis, or "
            f"{100.0 * settings.least:g} %, and {WHOLE_HORIZON:g} s rollouts change by {100.0 * settings.weight:g} % "
            "without it"
        ),
        unit=dict(zip(AXES, search.balance.unit, strict=True)),
        force_scale={a: float(s) for a, s in zip(AXES, search.force_scale, strict=True)},
        search=(
            f"floating (add, drop, swap, reshape) over {len(EFFECTS)} effects, "
            f"scored on {search.balance.blocks} held-out blocks"
        ),
    )
