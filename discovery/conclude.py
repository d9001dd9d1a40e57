"""From evidence to words: verdicts, sentences and the headline."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ..physics.effects import EFFECTS
from ..physics.frames import AXES, Array
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .evidence import Evidence, parameter_total
from .findings import Findings, FoundEffect, FoundTerm, Verdict, axis_name
from .identifiability import Identifiability
from .options import Candidate, measurable
from .passivity import Lawful
from .rollouts import HORIZON, SIGNIFICANT, WHOLE_HORIZON, WORSE
from .search import ALIVE, Search
from .uncertainty import Interval

_AXIS_OF = {"thruster": "thrust", "environment": "all", "mass": "all", "memory": "all", "trim": "yaw"}
_LEAST_FORCE = 1e-3
_NONE: Mapping[str, float] = MappingProxyType({})
_NO_DOUBT: Mapping[str, str] = MappingProxyType({})
_HELD = "Dissipation over the envelope holds {0} at {1:.3g} {2} in the corrected model; the log asks for {3:.3g}."
_FAINT = "it would explain what moves {0} for certain, but that is too near the sensor noise to name anything from."
_STILL = "Undecided: the boat hardly moves in this log, so it can tell nothing."


def conclude(
    search: Search,
    nominal: Vehicle,
    lawful: Lawful,
    considered: Vehicle,
    evidence: Sequence[Evidence],
    intervals: Mapping[str, Interval],
    kept: Sequence[str],
    order: Sequence[str | None],
    known: Identifiability | None = None,
    advice: tuple[dict[str, str], ...] = (),
    included: Mapping[str, float] = _NONE,
    others: Sequence[FoundEffect] = (),
    unseen: Sequence[Candidate] = (),
    doubtful: Mapping[str, str] = _NO_DOUBT,
) -> Findings:
    """Write the findings.

    Parameters
    ----------
    lawful : the model with the kept effects, and how the law stands in it
    considered : the model with everything that the search selected, sure or not
    evidence : on every candidate, best first
    intervals : 95 % intervals of total values by symbol
    kept : keys of the effects that are sure
    order : keys in the order in which they are added
    known : what the log can show and tell apart
    advice : manoeuvres that would settle what it leaves open
    included : share of block ensembles in which a term without a name is selected, by symbol
    others : findings on effects that were not searched for
    unseen : candidates that the search could not judge
    doubtful : why kept effects are not certain all the same, by key: they stay in the model, and are not called missing
    """
    pool = {candidate.key: candidate for candidate in (*search.pool, *unseen)}
    what = _what(search)
    found = [
        _effect(
            pool[e.key], e, nominal, lawful if e.key in kept else considered, intervals, what, doubtful.get(e.key, "")
        )
        for e in _one_each(evidence, pool)
        if ":" not in e.key
    ]
    found += others
    added = [key for key in order if key in kept and key is not None and ":" not in key]
    missing = tuple(dict.fromkeys(pool[key].effect.name for key in added if key not in doubtful))
    rank = {"missing": 0, "possible": 1, "no evidence": 2}
    found.sort(key=lambda f: (rank[f.verdict], missing.index(f.effect) if f.effect in missing else len(missing)))
    unnamed = tuple(
        replace(term, inclusion=included.get(e.key, 0.0) if included else None)
        for e in evidence
        if ":" in e.key and (e.key in kept or e.key in order)
        for term in found_terms(pool[e.key], nominal, lawful.unconstrained, intervals)
    )
    open_ends = [e for e in evidence if (e.selected and e.key not in kept) or e.faint or e.key in doubtful]
    still = bool((search.force_scale < np.maximum(ALIVE * search.noise_error, _LEAST_FORCE)).all())
    verdict = "missing" if missing else "undecided" if open_ends or unnamed or still else "nothing missing"
    return Findings(
        verdict,
        _STILL if still and not missing else _headline(missing, unnamed, open_ends, doubtful),
        missing,
        tuple(found),
        unnamed,
        _criterion(search),
        advice,
        identifiability=known.to_dict() if known else {},
        passivity=lawful.passivity.to_dict(),
    )


def unmeasured(motions: Sequence[Motion]) -> tuple[FoundEffect, ...]:
    """The effects that no log without further channels can show, and which channels those are."""
    return tuple(
        FoundEffect(
            effect.name,
            f"This log cannot tell: it needs the channels {' and '.join(effect.channels)}. ({effect.meaning})",
            effect.family,
            effect.equation,
            "possible",
            0.0,
            0.0,
            (),
            (),
        )
        for effect in EFFECTS
        if effect not in measurable(motions)
    )


def _one_each(evidence: Sequence[Evidence], pool: Mapping[str, Candidate]) -> list[Evidence]:
    """One entry for each effect: every selected thruster of a per-thruster effect, or else the best."""
    seen: set[str] = set()
    entries = []
    for e in evidence:
        name = pool[e.key].effect.name
        if e.selected or name not in seen:
            entries.append(e)
            seen.add(name)
    return entries


def _effect(
    candidate: Candidate,
    e: Evidence,
    nominal: Vehicle,
    model: Lawful | Vehicle,
    intervals: Mapping[str, Interval],
    what: str,
    doubt: str = "",
) -> FoundEffect:
    """One candidate in words and numbers; `model` is the corrected one where the effect is kept."""
    effect, sure = candidate.effect, isinstance(model, Lawful)
    hidden = e.dormant or e.absorbed or e.noise_limited or bool(e.indistinguishable_from)
    verdict: Verdict = (
        "missing"
        if sure and not doubt
        else "possible"
        if doubt or e.selected or hidden or e.confidence >= 0.5
        else "no evidence"
    )
    terms: tuple[FoundTerm, ...] = ()
    if e.selected:
        terms = found_terms(candidate, nominal, model.unconstrained if isinstance(model, Lawful) else model, intervals)
    if isinstance(model, Lawful):
        terms = tuple(replace(t, in_model=parameter_total(nominal, candidate, model.vehicle, t.symbol)) for t in terms)
    sentence = effect.meaning
    rivals = ", ".join(name.replace("_", " ") for name in e.indistinguishable_from)
    from_rivals = f"This log cannot tell it from {rivals}" if rivals else ""
    if verdict == "missing":
        sentence += f" {_alone(candidate, e.share, what)}"
        sentence += "".join(f" {_HELD.format(t.symbol, t.in_model, t.unit, t.value)}" for t in terms if t.moved)
    elif doubt:
        sentence = f"In the corrected model, but not certain: {doubt}. ({sentence})"
    elif e.faint:
        sentence = f"{from_rivals or 'Perhaps'}: {_FAINT.format(e.faint)} ({sentence})"
    elif e.indistinguishable_from:
        sentence = f"{from_rivals}: {sentence[0].lower()}{sentence[1:]}"
    elif e.out_of_step:
        sentence = (
            f"This log cannot tell: its channels are out of step by about {e.out_of_step:.2f} s, or may be, and what "
            f"it asks for is hardly more. ({sentence})"
        )
    elif e.at_limit:
        sentence = f"Doubtful: the log asks for more of it than physics allows, so it is something else. ({sentence})"
    elif e.rollouts_object:
        sentence = f"Doubtful: the force balance asks for it, but open-loop rollouts get worse with it. ({sentence})"
    elif e.dormant:
        sentence = f"This log cannot tell: it holds no manoeuvre in which it would show. ({sentence})"
    elif e.absorbed:
        sentence = f"This log cannot tell: the calibrated parameters take up what it would do. ({sentence})"
    elif e.noise_limited:
        sentence = f"This log cannot tell: what would show it is hardly more than sensor noise. ({sentence})"
    elif verdict == "possible":
        sentence = f"Perhaps: {sentence[0].lower()}{sentence[1:]} The evidence is below what undertow demands."
    else:
        sentence = f"Looked for and not found. ({sentence})"
    rivals_by_name = tuple(name.split("[")[0] for name in e.indistinguishable_from)
    return FoundEffect(
        effect.name,
        sentence,
        effect.family,
        effect.equation,
        verdict,
        e.confidence,
        e.error_drop,
        tuple(dict.fromkeys(rivals_by_name)),
        terms,
    )


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
        terms.append(FoundTerm(symbol, axis, parameter.form, value, parameter.unit, moved))
    return tuple(terms)


def _headline(
    missing: Sequence[str], unnamed: Sequence[FoundTerm], open_ends: Sequence[Evidence], doubtful: Mapping[str, str]
) -> str:
    words = [name.replace("_", " ") for name in missing]
    if words:
        listed = _listed(words)
        more = f", and {len(unnamed)} term{'s' * (len(unnamed) > 1)} that nobody has named" if unnamed else ""
        perhaps = f", and perhaps {_listed(doubtful)}" if doubtful else ""
        return f"The model is missing {listed}{more}{perhaps}."
    if unnamed:
        return "No named effect is missing for sure, but the log asks for terms that nobody has named."
    if open_ends:
        names = ", ".join(e.key.replace("_", " ") for e in open_ends)
        if all(e.rollouts_object for e in open_ends):
            return f"Undecided: the force balance asks for {names}, but predictions get worse with it."
        if all(e.faint for e in open_ends):
            where = " and ".join(dict.fromkeys(e.faint for e in open_ends))
            return f"Undecided: something faint is missing in {where}, too near the sensor noise to name ({names})."
        return f"Undecided: something is missing, but this log cannot tell what for sure ({names})."
    return "Nothing material is missing: the model explains this log."


def _listed(names: Iterable[str]) -> str:
    words = [name.replace("_", " ") for name in names]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _what(search: Search) -> str:
    """Of what shares are taken."""
    return "force at work" if search.weak.forces else "motion that the forces make"


def _criterion(search: Search) -> dict[str, object]:
    settings = search.settings
    what = _what(search)
    return {
        "materiality": settings.materiality,
        "certainty": (
            f"each parameter earns a held-out log-likelihood of {settings.price:g} "
            f"({settings.unnamed_price:g} for a term without a name and for each gain of a thrust curve) in 9 of 10 "
            "block resamples"
        ),
        "material": (
            f"it alone explains at least {100.0 * settings.materiality:g} % of the {what} on some axis, or "
            f"{100.0 * settings.least:g} %, and {WHOLE_HORIZON:g} s rollouts change by {100.0 * settings.weight:g} % "
            "without it"
        ),
        "rollouts": (
            f"5 s rollouts with it, and {WHOLE_HORIZON if search.weak.forces else HORIZON:g} s rollouts of all "
            "together, are not worse "
            f"(by {100.0 * WORSE:g} % and {SIGNIFICANT:g} standard errors)"
        ),
        "unit": dict(zip(AXES, search.weak.unit, strict=True)),
        "force_scale": {a: float(s) for a, s in zip(AXES, search.force_scale, strict=True)},
        "search": (
            f"floating (add, drop, swap, reshape) over {len(EFFECTS)} effects, "
            f"scored on {int(search.weak.block.max()) + 1} held-out blocks"
        ),
    }
