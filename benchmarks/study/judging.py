"""What discovery says of a log, beside the truth."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from undertow.discovery.balance.rollout_test import rollout_squares
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import Kind, candidates, measurable
from undertow.discovery.candidates.unnamed_terms import term_candidate
from undertow.discovery.discover import Discovery, find_missing
from undertow.discovery.found_effects import FoundEffect
from undertow.discovery.search.floating import Search, State
from undertow.discovery.settings import DiscoverySettings
from undertow.physics.errors import RequestError
from undertow.physics.laws.damping_power import envelope_of, worst_dissipation
from undertow.physics.motion import Motion
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.typical_effects import materiality

from .worlds import BY_FILE, PARTS, Case, Values, divided, draw, label, merged

HORIZON = 10.0
"""Length of the held-out rollouts [s]."""
_FITTED = 6
"""Rivals of an effect that are fitted, of all that columns rank."""


def judge(part: str, first: int, number: int) -> dict[str, Any]:
    """Draw a log of a part whose seeds begin with the first, let discovery look at it, and compare with the truth."""
    case = draw(PARTS[part], number, first + number)
    pieces = divided(case, number % BY_FILE == BY_FILE - 1)
    fitting = (*pieces.train.motions, *pieces.validation.motions)
    begun = time.perf_counter()
    found = find_missing(fitting, case.nominal)
    seconds = time.perf_counter() - begun
    effects = {label(e.effect, [t.symbol for t in e.terms]): e for e in found.findings.candidates}
    missing = [name for name, e in effects.items() if e.verdict == "missing"]
    unnamed = [term.symbol for term in found.findings.unnamed]
    record = {
        **case.setting,
        "number": number,
        "hidden": case.hidden,
        "matters": {name: matters(case, name) for name in case.hidden},
        "verdict": found.findings.verdict,
        "first": next(iter(effects)),
        "missing": missing,
        "unnamed": unnamed,
        "possible": [name for name, e in effects.items() if e.verdict == "possible" and e.terms],
        "alike": {name: list(e.indistinguishable_from) for name, e in effects.items() if e.indistinguishable_from},
        "standing": {name: standing(effects, name) for name in case.hidden},
        "terms": [t for name, e in effects.items() if name in case.hidden for t in compared(e, case.hidden[name])],
        "rollout": rollout_ratio(case, found, pieces.test.motions) if missing or unnamed else None,
        "lawful": worst_dissipation(case.log.vehicle, envelope_of(fitting, case.log.vehicle)).power <= 0.0,
        "seconds": seconds,
    }
    if set(missing) != set(case.hidden) or unnamed:
        told = {name: e for name, e in effects.items() if e.terms or name in case.hidden}
        record["told"] = {name: {"confidence": e.confidence, "sentence": e.sentence} for name, e in told.items()}
        record["scores"] = compared_scores(case, found, fitting)
    return record


def matters(case: Case, name: str) -> float:
    """By how much 10 s rollouts along the log change when one hidden effect is taken away, on the worst axis."""
    others = merged({other: values for other, values in case.hidden.items() if other != name})
    return float(materiality(apply_effects(case.nominal, others), case.log.vehicle, case.log.truth).max())


def standing(effects: Mapping[str, FoundEffect], name: str) -> str:
    """Where a hidden effect ended up: missing, alias (in a group that cannot be told apart), possible, no evidence."""
    bare = name.split("[")[0]
    if name in effects and effects[name].verdict == "missing":
        return "missing"
    groups = [{e.effect, *e.indistinguishable_from} for e in effects.values() if e.indistinguishable_from]
    if any(bare in group for group in groups):
        return "alias"
    return next((e.verdict for e in effects.values() if e.effect == bare), "no evidence")


def compared(effect: FoundEffect, values: Values) -> list[dict[str, Any]]:
    """Found and true value of each parameter of an effect that is rightly called missing, and whether 95 % covers it.

    *Told* is whether there is an interval: a gain of a thrust curve that the log never asks for has none.

    Errors are relative to the true value; those of an earth-fixed vector (current, wind) to its length.
    """
    if effect.verdict != "missing":
        return []
    length = float(np.linalg.norm(list(values.values()))) if any(s.endswith("_north") for s in values) else None
    terms = []
    for term in effect.terms:
        true = values[term.symbol]
        terms.append(
            {
                "symbol": term.symbol,
                "value": term.value,
                "truth": true,
                "error": abs(term.value - true) / (length or abs(true)),
                "told": term.ci95 is not None,
                "covered": term.ci95 is not None and term.ci95.lower <= true <= term.ci95.upper,
            }
        )
    return terms


def rollout_ratio(case: Case, found: Discovery, motions: Sequence[Motion]) -> float:
    """Held-out 10 s rollout error of the corrected model over that of the true one, root mean square of the axes."""
    corrected, true = (
        np.mean(rollout_squares(motions, vehicle, HORIZON), axis=0) for vehicle in (found.corrected, case.log.vehicle)
    )
    return float(np.sqrt(np.mean(corrected / np.maximum(true, 1e-12))))


def compared_scores(case: Case, found: Discovery, motions: Sequence[Motion]) -> dict[str, Any]:
    """Scores of the true set and of what the search selected (lower is better), and what each true effect is worth.

    A true set that scores better was missed by the search; one that scores worse lost by the criterion. Beside them,
    the best model with another effect in the place of a true one: what a judge who knows the true set has against it.
    """
    settings = DiscoverySettings()
    selected = {label(e.effect, [t.symbol for t in e.terms]): e for e in found.findings.candidates if e.terms}
    values = {t.symbol: t.value for e in selected.values() for t in e.terms}
    values |= {t.symbol: t.value for t in found.findings.unnamed}
    terms = [term_candidate(t.symbol, case.nominal) for t in found.findings.unnamed]
    search = Search(
        WeakForm(motions, settings.weak),
        case.nominal,
        (*candidates(case.nominal, measurable(motions)), *terms),
        replace(settings.search, refinements=6),
    )
    true = search.evaluate(apply_effects(case.nominal, merged(case.hidden)), tuple(case.hidden))
    nothing = search.evaluate(case.nominal, ())
    scores: dict[str, Any] = {"nothing": nothing.score, "truth": true.score}
    scores["worth"] = {
        key: {"gain": without.score - true.score, "share": float(search.unique_share(without, true).max())}
        for key in case.hidden
        for without in [search.without(true, key)]
    }
    scores["rival"] = rival(search, true)
    try:
        start = apply_effects(case.nominal, values)
        scores["selected"] = search.evaluate(start, (*selected, *(t.key for t in terms))).score
    except RequestError:
        scores["selected"] = None  # a selected but unsure value may lie outside what a vehicle file takes
    return scores


def rival(search: Search, true: State) -> dict[str, Any]:
    """What does best in the place of a true effect, one or two others, and the log-likelihood by which it is worse.

    Prices count: a judge who believes that fewer numbers are likelier would not be moved by more of them.
    """
    linear, scores = search.linearise(true.vehicle, true.active, true.fit.in_sample)
    now = {key: linear.options[key][0] for key in true.active}
    names = search.named(true.active)
    others = [c.key for c in search.pool if c.kind is Kind.EFFECT and c.key not in names]
    found = []
    for name in names:
        rest = {**now, name: linear.options[name][1]}
        shapes = [(option,) for key in others for option in linear.options[key] if option.present]
        pairs = [(*one, *other) for one, other in combinations(shapes, 2) if one[0].key != other[0].key]
        trials = [rest | {option.key: option for option in options} for options in (*shapes, *pairs)]
        worth = search.quicks(scores, trials)
        for _, n in sorted((score, n) for n, score in enumerate(worth))[:_FITTED]:
            there = search.apply(true, now, trials[n], scores)
            by = [option.key for option in (*shapes, *pairs)[n]]
            found.append({"of": name, "by": by, "worse": there.score - true.score})
    return min(found, key=lambda rival: rival["worse"])
