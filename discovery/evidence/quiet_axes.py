"""Faint structure: what moves a quiet axis for certain, and every effect that would explain it as well.

A quiet axis has a floor of several times the noise, under which nothing matters and nothing is named. Structure may yet
be certain there. It is looked for under a floor of the noise itself; no effect is called missing for it, and those that
explain it about equally well are told as one group.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...physics.frames import AXES
from ..candidates.candidate import Kind
from ..identifiability.identifiable_effects import LEAST_SIGNAL
from ..identifiability.visible import Identifiability
from ..search.floating import Search, State
from .weighing import SURE, TELL_APART, Evidence, share_of_resamples

_FLOOR = 1.0
"""Floor on a quiet axis under which faint structure is looked for, in multiples of sensor noise."""


@dataclass(frozen=True, slots=True)
class Suspect:
    """An effect that would explain faint structure on an axis.

    Attributes
    ----------
    key : the candidate
    gain : log-likelihood that it earns on all axes, its price paid
    confidence : share of block resamples in which it earns its price on that axis alone
    clear : False when its columns are hardly more than sensor noise, which then decides its gain
    """

    key: str
    gain: float
    confidence: float
    clear: bool


def suspects(search: Search, state: State, known: Identifiability, axis: int, seed: int) -> tuple[Suspect, ...]:
    """The effects any of which would explain what moves a quiet axis, best first; none where nothing is certain.

    Each is added to the model and fitted. It must earn its price on that axis alone in nine of ten resamples, and on
    all axes together. Those within `TELL_APART` of the best one explain the log as well. An effect whose columns are
    hardly more than noise is never the best beside others, since noise inflates its gain, but it is not ruled out.

    Parameters
    ----------
    state : the model that the search ended with
    known : what the log can show about it
    axis : index of a quiet axis
    """
    close = Search(search.balance, search.nominal, search.pool, replace(search.settings, loud=_FLOOR))
    model = close.evaluate(state.vehicle, state.active)
    linear, scores = close.linearise(model.vehicle, model.active, model.fit.in_sample)
    now = {key: linear.options[key][0] for key in model.active}
    found = []
    for candidate in close.pool:
        if candidate.key in now or candidate.kind is not Kind.EFFECT:
            continue
        changes = [{**now, candidate.key: option} for option in linear.options[candidate.key] if option.present]
        best = min(changes, key=lambda change: close.quick(scores, change))
        if close.quick(scores, best) > model.score - close.settings.margin:
            continue
        trial = close.apply(model, now, best, scores)
        option = best[candidate.key]
        price = close.price(close.fit(scores, [option]), [option])
        confidence = share_of_resamples(close, model.fit, trial.fit, price, seed, True, axis)
        if trial.score < model.score - close.settings.margin and confidence >= SURE:
            clear = known.excitation[candidate.key].signal_to_noise >= LEAST_SIGNAL
            found.append(Suspect(candidate.key, model.score - trial.score, confidence, clear))
    enough = max((s.gain for s in found if s.clear), default=max((s.gain for s in found), default=0.0)) - TELL_APART
    return tuple(sorted((s for s in found if s.gain >= enough), key=lambda s: (not s.clear, -s.gain)))


def with_faint(
    search: Search, state: State, known: Identifiability, evidence: Sequence[Evidence], seed: int
) -> list[Evidence]:
    """The evidence, with the effects that would explain what moves a quiet axis told as look-alikes of one another."""
    told = list(evidence)
    for axis in np.flatnonzero(search.quiet).tolist():
        group = suspects(search, state, known, axis, seed)
        members = {e.key: e for e in told}
        joined = [_joined(members[s.key], s, group, AXES[axis]) for s in group if not members[s.key].faint]
        rest = [e for e in told if e.key not in {j.key for j in joined}]
        chosen = sum(e.selected or bool(e.faint) for e in rest)
        told = [*rest[:chosen], *joined, *rest[chosen:]]
    return told


def _joined(e: Evidence, suspect: Suspect, group: Sequence[Suspect], axis: str) -> Evidence:
    others = (s.key for s in group if s.key != e.key)
    alike = tuple(dict.fromkeys((*e.indistinguishable_from, *others)))
    return replace(e, faint=axis, confidence=suspect.confidence / (1 + len(alike)), indistinguishable_from=alike)
