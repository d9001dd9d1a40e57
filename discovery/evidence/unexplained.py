"""Unexplained force: what lasts for seconds, what moves a quiet axis, and unnamed terms with inclusion probabilities.

Sensor noise and short waves have no mean over some seconds; a cause outside the catalogue has. On a quiet axis, whose
floor is several times the noise, structure may be certain although nothing is named: the effects that explain it about
equally well are given as one group. Inclusion is the share of block-bootstrap draws that select a term (Fasel et al.
2022, doi:10.1098/rspa.2021.0904, with blocks in place of rows).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.blocks import block_draws
from ...physics.motion import AXES, Array
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..candidates.candidate import Kind
from ..effect_findings import LIKELY
from ..findings import PersistentResidual
from ..identifiability.identifiable_effects import LEAST_SIGNAL
from ..identifiability.rehearsal import Identifiability
from ..search.floating import Search, State
from .weighing import SURE, TELL_APART, Evidence, share_of_resamples

_SECONDS = 5.0
"""Time over which white noise and the waves of sheltered water vanish in the mean [s], see `_lasting`."""
_MATERIAL = 0.1
"""Share of the force at work from which a rest is material. Waves of 0.2 m/s leave 0.07 or less in surge and yaw
over 5 s where the model is right, commands that are cut at a third 0.15 to 0.5."""
_LASTING = 0.5
"""Share of a rest that its means over 5 s hold, from which it lasts: of white noise it is 0.3, of waves 0.02 to 0.3."""
_LEFT = 0.5
"""Share of what the nominal model leaves, in these means and in rollouts where those judge, from which what was found
explains little: weather leaves less in the field where the effects that are missing take the rest."""
_ONE_SIDED = 1.645
"""Standard errors beyond which chance leads in one of twenty cases."""
_LEAST = 8
"""Means below which their size is chance."""


def find_persistent_residuals(forces: Search, judge: Balance, found: Vehicle) -> tuple[PersistentResidual, ...]:
    """Persistent residuals by axis: material, lasting, and hardly less with the model found than with the nominal one.

    Parameters
    ----------
    forces : the search on the force balance, with the nominal vehicle
    judge : the balance that judged, of forces or of rollouts
    found : the model with everything that the search selected, sure or not
    """
    balance = forces.balance
    after, before = (balance.residual(vehicle) for vehicle in (found, forces.nominal))
    if _pieces(balance.time, 2.0 * _SECONDS)[-1] + 1 < _LEAST:
        return ()
    (lasting, sure), (usual, _) = (_lasting(rest, balance.time) for rest in (after, before))
    share = lasting / forces.force_scale
    little = lasting > _LEFT * usual
    if not judge.forces:
        little &= _size(judge.residual(found)) > _LEFT * _size(judge.residual(forces.nominal))
    seen = ~forces.quiet
    left = seen & little & sure & (share > _MATERIAL) & (lasting > _LASTING * _size(after))
    return tuple(
        PersistentResidual(
            axis=AXES[axis], force=float(lasting[axis]), share=float(share[axis]), unit=balance.unit[axis]
        )
        for axis in sorted(np.flatnonzero(left).tolist(), key=lambda axis: -share[axis])
    )


def find_passing_residuals(forces: Search, found: Vehicle) -> dict[str, float]:
    """Shares of the force at work that a model leaves beyond sensor noise, by axis, largest first; material ones alone.

    Parameters
    ----------
    forces, found : as in `find_persistent_residuals`
    """
    beyond = _size(forces.balance.residual(found)) ** 2 - forces.noise_error**2
    share = np.sqrt(np.maximum(beyond, 0.0)) / forces.force_scale
    material = np.flatnonzero(~forces.quiet & (share > _MATERIAL)).tolist()
    return {AXES[axis]: float(share[axis]) for axis in sorted(material, key=lambda axis: -share[axis])}


def _lasting(rest: Array, time: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Size (3,) of the force in a rest (tests, 3) that lasts for 5 to 10 s, and whether there surely is one.

    The mean force that noise n of a speed feigns by inertia over T goes with (n(t + T) - n(t)) / T: whatever its
    colour, over twice the time it is half, where a force that lasts stays. From both follows the force (Richardson's
    extrapolation), and what such noise feigns by damping.
    """
    means = [_means(rest, _pieces(time, by * _SECONDS)) for by in (1.0, 2.0)]
    short, long = (np.square(_size(each)) for each in means)
    chance = _ONE_SIDED * np.sqrt(2.0 / len(means[1]))  # of a mean of squares, relative
    return np.sqrt(np.maximum(4.0 * long - short, 0.0) / 3.0), 4.0 * (1.0 - chance) * long > short


def _pieces(time: Array, seconds: float) -> NDArray[np.int64]:
    """Numbers of the pieces of so many seconds that tests belong to; one ends where the time leaps or begins anew."""
    step = np.diff(time, prepend=time[0])
    leaps = (step < 0.0) | (step > _SECONDS)
    begun = time[np.maximum.accumulate(np.where(leaps, np.arange(time.size), 0))]
    within = ((time - begun) / seconds).astype(np.int64)
    return np.cumsum((np.diff(within, prepend=0) != 0) | leaps)


def _means(rest: Array, pieces: NDArray[np.int64]) -> Array:
    """Means of a rest (tests, 3) over its pieces, without those that are hardly begun, (pieces, 3)."""
    tests = np.bincount(pieces)
    sums = np.column_stack([np.bincount(pieces, column) for column in rest.T])
    return (sums / np.maximum(tests, 1)[:, None])[tests > 0.5 * tests.max()]


def _size(rest: Array) -> Array:
    return np.sqrt((rest**2).mean(axis=0))


_FLOOR = 1.0
"""Floor on a quiet axis under which faint structure is looked for, in multiples of sensor noise: the noise
itself, the least that there is."""


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


def find_suspects(search: Search, state: State, known: Identifiability, axis: int, seed: int) -> tuple[Suspect, ...]:
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
        best = min(changes, key=lambda change: close.score_linearised(scores, change))
        if close.score_linearised(scores, best) > model.score - close.settings.margin:
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


def add_faint_structure(
    search: Search, state: State, known: Identifiability, evidence: Sequence[Evidence], seed: int
) -> list[Evidence]:
    """The evidence, with the effects that would explain what moves a quiet axis told as look-alikes of one another.

    Parameters
    ----------
    search, state : the search and the model that it ended with
    known : which candidates the log excites and tells apart
    evidence : of all candidates, selected ones first
    seed : of the draws of blocks
    """
    told = list(evidence)
    for axis in np.flatnonzero(search.quiet).tolist():
        group = find_suspects(search, state, known, axis, seed)
        members = {e.key: e for e in told}
        joined = [_joined(members[s.key], s, group, AXES[axis]) for s in group if not members[s.key].faint]
        rest = [e for e in told if e.key not in {j.key for j in joined}]
        chosen = sum(e.selected or bool(e.faint) for e in rest)
        told = [*rest[:chosen], *joined, *rest[chosen:]]
    return told


def _joined(e: Evidence, suspect: Suspect, group: Sequence[Suspect], axis: str) -> Evidence:
    """The evidence of a suspect, with its part of what a group may have: together it is no more than possible."""
    others = (s.key for s in group if s.key != e.key)
    alike = tuple(dict.fromkeys((*e.indistinguishable_from, *others)))
    part = LIKELY * suspect.confidence / (1 + len(alike))
    return replace(e, faint=axis, confidence=part, indistinguishable_from=alike)


_MOST = 6
"""Terms in one model at most: more than six that nobody has named are no physics to look for."""

_TRIED = 4
"""Terms that are scored before one is taken: those that lower the in-sample error most."""


def inclusion(search: Search, state: State, seed: int, draws: int = 100) -> dict[str, float]:
    """Share of block draws in which each term of the search's pool is selected beside the named effects, by symbol.

    Terms that are never selected are left out. Columns are those about the final model, without its terms.

    Parameters
    ----------
    seed : of the draws
    """
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    terms = search.of_kind([candidate.key for candidate in search.pool], Kind.TERM)
    base = {key: linear.options[key][0] for key in state.active if key not in terms}
    base |= {key: linear.options[key][1] for key in state.active if key in terms}
    present = {key: next(option for option in linear.options[key] if option.present) for key in terms}
    chosen = dict.fromkeys(terms, 0)
    for draw in block_draws(scores.blocks, draws, seed):
        drawn, model = scores.drawn(draw), dict(base)
        best = search.score_linearised(drawn, model)
        for _ in range(_MOST):
            rest = [key for key in terms if key not in model or not model[key].present]
            gains = drawn.screen(list(model.values()), [present[key] for key in rest])
            rest = [rest[n] for n in np.argsort(-gains, kind="stable")[:_TRIED]]
            tried = search.score_all_linearised(drawn, [{**model, key: present[key]} for key in rest])
            found = min(zip(tried, rest, strict=True), default=None)
            if found is None or found[0] >= best - search.settings.margin:
                break
            best, key = found
            model[key] = present[key]
        for key in terms:
            chosen[key] += key in model and model[key].present
    return {key: number / draws for key, number in chosen.items() if number}
