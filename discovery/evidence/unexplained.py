"""Unexplained force: what lasts for seconds, and the inclusion probabilities of unnamed terms.

Sensor noise and short waves have no mean over some seconds; a cause outside the catalogue has. Inclusion is the share
of block-bootstrap draws that select a term (Fasel et al. 2022, doi:10.1098/rspa.2021.0904, with blocks in place of
rows).
"""

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.blocks import block_draws
from ...physics.motion import AXES, Array
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..candidates.candidate import Kind
from ..findings import PersistentResidual
from ..search.floating import Search, State

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
