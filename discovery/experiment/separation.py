"""Partings: by how much two effects would differ if the log were longer by a trial.

Log and rehearsed trial are put together, one effect acts with its size, and everything that could stand in for it is
fitted. What no stand-in explains would raise the score of the search by

    gain = n/2 sum over axes of log(1 + d^2 / (noise^2 + floor^2)),

d the root mean square force left, n the independent tests of log and trial together. That is the information (in the
sense of Kullback and Leibler 1951, doi:10.1214/aoms/1177729694) by which the two models would part, in the units in
which the search prices effects.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...physics.frames import Array
from ..candidates.linearisation import Option
from ..identifiability.identifiable_effects import column_moments
from ..identifiability.rehearsal import Rehearsal, amplitude_columns
from ..search.floating import Search, State
from ..search.gram import RIDGE

MOST_RIVALS = 6
"""Rivals that are looked at beside an effect, in the order given: each costs a fit on every trial."""


@dataclass(frozen=True, slots=True, eq=False)
class Parting:
    """How two effects would part in each trial, or one effect from all that could stand in for it.

    Attributes
    ----------
    effects : keys of the two, or of the one
    selected : True when the search selected one of them
    information : (trials, 3) log-likelihood that log and trial together would earn on each axis over the best stand-in
    share : (trials, 3) force that the stand-in would leave in the trial, over the axis' force scale in trial or log
    before : (3,) the same in the log as it is
    matters : (trials,) force of the first effect that the others in the model do not explain, over the force at work in
        log and trial together, on the axis where that is most
    """

    effects: tuple[str, ...]
    selected: bool
    information: Array
    share: Array
    before: Array
    matters: Array

    @property
    def gain(self) -> Array:
        """Log-likelihood on all axes, (trials,)."""
        return self.information.sum(axis=1)


def part(
    search: Search,
    state: State,
    questions: Mapping[str, Sequence[str]],
    plausible: Mapping[str, tuple[float, ...]],
    rehearsal: Rehearsal,
) -> list[Parting]:
    """How look-alikes, pair by pair, and effects without any would part in each trial; parameters as `advice.advise`.

    A look-alike acts with the size in which it would explain what the selected effect explains.
    """
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    stand = _Stand(search, rehearsal, column_moments(scores)[0], scores.scale)
    free = {key: [i for i in linear.options[key][0].free if i >= 0] for key in state.active}
    found = []
    for key, rivals in questions.items():
        selected = key in state.active
        force = np.zeros(scores.scale.size)
        if selected:
            force[linear.options[key][1].offset] = 1.0
        else:
            candidate = next(c for c in search.pool if c.key == key)
            force[list(amplitude_columns(candidate, linear.options[key]))] = plausible[key]
        rest = [i for other in state.active if other != key for i in free[other]]
        group = rivals[:MOST_RIVALS]
        ways = {other: _ways(linear.options[other]) for other in (key, *group)}
        forces = {key: force} | {other: stand.replacement(force, ways[other], rest) for other in group}
        if selected:
            ways[key] = [free[key] or [linear.options[key][1].offset]]
        for a, b in combinations(forces, 2):
            sets = [(forces[a], [*rest, *way]) for way in ways[b]] + [(forces[b], [*rest, *way]) for way in ways[a]]
            left = [stand.left(f, regressors) for f, regressors in sets]
            found.append(_hardest((a, b), selected, left, stand.matters(forces[a], rest)))
        if not group:
            # A general effect could hide any of its special cases in every trial: there the price decides.
            simple = [c.key for c in search.pool if c.key not in (key, *state.active) and not c.effect.general]
            others = () if selected else simple
            sets = [[*rest, *way] for other in others for way in _ways(linear.options[other])] or [rest]
            left = [stand.left(force, regressors) for regressors in sets]
            found.append(_hardest((key,), selected, left, stand.matters(force, rest)))
    return found


def _hardest(
    effects: tuple[str, ...], selected: bool, ways: Sequence[tuple[Array, Array, Array]], matters: Array
) -> Parting:
    """The parting in each trial from the stand-in that comes closest there."""
    worst = np.argmin([information.sum(axis=1) for information, _, _ in ways], axis=0)
    every = np.arange(worst.size)
    information, share = (np.array([way[n] for way in ways])[worst, every] for n in (0, 1))
    before = ways[worst[int(np.argmax(information.sum(axis=1)))]][2]
    return Parting(effects, selected, information, share, before, matters)


def _ways(options: Sequence[Option]) -> list[list[int]]:
    """Columns of each shape in which an absent candidate may stand in."""
    ways = [[i for i in (option.offset, *option.free) if i >= 0] for option in options if option.present]
    return [way for way in ways if way]


class _Stand:
    """Log and trials as Gram matrices, each trial added to the log."""

    def __init__(self, search: Search, rehearsal: Rehearsal, moments: Array, scale: Array) -> None:
        rows = search.balance.time.size
        self.scale = scale
        self.trial, force, tests = rehearsal.moments(scale)
        self.log = rows * moments / (scale[:, None] * scale[None, :])
        self.both = self.log + self.trial
        self.tests, self.all = tests[:, None], tests[:, None] + rows
        self.trial_force = np.sqrt(force / self.tests)
        self.log_force, self.log_rows = search.share_scale, rows
        both_force = (force + rows * search.force_scale**2) / self.all
        self.force = np.sqrt(both_force)
        noise = (rows * search.noise_error**2 + rehearsal.noise_squares(search.noise_error)) / self.all
        self.variance = noise + search.settings.materiality**2 * both_force
        self.independent = search.balance.independent * self.all[:, 0] / rows
        self.normal = np.einsum("ta,tapq->tpq", 1.0 / self.variance, self.both)
        self.alone = np.tensordot(1.0 / (search.noise_error**2 + search.floor), self.log, axes=1)[None]
        # An axis that rests in a trial has hardly a force of its own to take a share of.
        self.trial_force = np.maximum(self.trial_force, search.force_scale)

    def replacement(self, force: Array, ways: Sequence[Sequence[int]], rest: Sequence[int]) -> Array:
        """The combination of columns by which the best of several ways comes closest to a force in the log."""
        best, least = np.zeros_like(force), np.inf
        for way in ways:
            free = np.isin(np.arange(force.size), [*way, *rest])
            mixed = _remainder(self.alone, free, force * self.scale)
            loss = float((mixed @ self.alone[0] @ mixed[0])[0])
            if loss < least:
                best, least = np.where(np.isin(np.arange(force.size), way), -mixed[0] / self.scale, 0.0), loss
        return best

    def matters(self, force: Array, regressors: Sequence[int]) -> Array:
        """What regressors leave of a combination of columns in log and trial, over the force there, (trials,)."""
        mixed = force * self.scale
        together = _remainder(self.normal, np.isin(np.arange(force.size), regressors), mixed)
        rest = np.sqrt(_square(self.both, together) / self.all)
        return (rest / np.maximum(self.force, 1e-9)).max(axis=1)

    def left(self, force: Array, regressors: Sequence[int]) -> tuple[Array, Array, Array]:
        """What regressors leave of a combination of columns: information and shares (trials, 3), share (3,)."""
        mixed = force * self.scale
        used = np.array(sorted({*np.flatnonzero(mixed), *regressors}), dtype=int)
        inside = np.ix_(used, used)
        free = np.isin(used, sorted(set(regressors)))
        target = mixed[used]
        together = _remainder(self.normal[:, used[:, None], used[None, :]], free, target)
        rest = _square(self.both[:, :, used[:, None], used[None, :]], together) / self.all
        information = 0.5 * self.independent[:, None] * np.log1p(rest / self.variance)
        there = np.sqrt(_square(self.trial[:, :, used[:, None], used[None, :]], together) / self.tests)
        alone = _remainder(self.alone[0][inside][None], free, target)
        here = np.sqrt(_square(self.log[:, used[:, None], used[None, :]][None], alone)[0] / self.log_rows)
        return information, there / self.trial_force, here / self.log_force


def _remainder(normal: Array, free: np.ndarray, target: Array) -> Array:
    """The combination (k, q) of columns that is left of `target` (q,) when the free ones are fitted to it."""
    left = np.tile(target * ~free, (normal.shape[0], 1)) if free.any() else np.tile(target, (normal.shape[0], 1))
    if free.any():
        inner = normal[:, free][:, :, free]
        size = np.maximum(np.einsum("kii->ki", inner), 1e-300)
        inner = inner + RIDGE * size[:, :, None] * np.eye(inner.shape[1])
        pull = (normal[:, free] @ left[:, :, None])[..., 0]
        scale = 1.0 / np.sqrt(size)
        solved = np.linalg.solve(inner * scale[:, :, None] * scale[:, None, :], (pull * scale)[..., None])[..., 0]
        left[:, free] -= solved * scale
    return left


def _square(gram: Array, mixed: Array) -> Array:
    """Summed squares on each axis (k, 3) of combinations (k, q) under Gram matrices (k, 3, q, q)."""
    return np.maximum(np.einsum("kp,kapq,kq->ka", mixed, gram, mixed), 0.0)
