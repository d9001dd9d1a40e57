"""Separation of models: the information by which a trial would tell two effects apart, and the question it settles.

Log and simulated trial are joined, one effect acts, and everything that could stand in for it is fitted. With d the
root mean square force left and n the independent tests, the search's score would rise by

    gain = n/2 sum over axes of log(1 + d^2 / (noise^2 + floor^2)),

the information (Kullback and Leibler 1951, doi:10.1214/aoms/1177729694) in the unit in which effects are priced.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import combinations

import numpy as np

from ...physics.errors import RequestError, VehicleError
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from ...physics.worlds.manoeuvres import COMMAND_STEP, REST, Trial, drive
from ..candidates.candidate import Candidate
from ..candidates.linearisation import Option
from ..identifiability.identifiable_effects import column_moments
from ..identifiability.rehearsal import Rehearsal, amplitude_columns, rehearsal_of
from ..search.floating import Search, State
from ..search.gram import RIDGE

MOST_RIVALS = 6
"""Rivals that are looked at beside an effect, in the order given: each costs a fit on every trial."""


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """Separation of two effects in each trial, or of one effect from all that could stand in for it.

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


def separate_effects(
    search: Search,
    state: State,
    questions: Mapping[str, Sequence[str]],
    plausible: Mapping[str, tuple[float, ...]],
    rehearsal: Rehearsal,
) -> list[Separation]:
    """Separate look-alikes, pair by pair, and effects without any, in each trial; parameters as `advice.advise`.

    A look-alike acts with the size in which it would explain what the selected effect explains.

    Parameters
    ----------
    search, state : the search and the model that it ended with
    questions : keys of effects, each with its look-alikes; see `advice.open_questions`
    plausible : amounts of effects that are not in the model, by key
    rehearsal : the trials of the library, simulated on the model
    """
    linear, scores, now = search.about(state)
    stand = _JointTrials(search, rehearsal, column_moments(scores)[0], scores.scale)
    free = {key: [number.column for number in option.numbers] for key, option in now.items()}
    result = []
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
            left = [stand.residual(f, regressors) for f, regressors in sets]
            result.append(_hardest((a, b), selected, left, stand.matters(forces[a], rest)))
        if not group:
            # A general effect could hide any of its special cases in every trial: there the price decides.
            simple = [c.key for c in search.pool if c.key not in (key, *state.active) and not c.effect.general]
            others = () if selected else simple
            sets = [[*rest, *way] for other in others for way in _ways(linear.options[other])] or [rest]
            left = [stand.residual(force, regressors) for regressors in sets]
            result.append(_hardest((key,), selected, left, stand.matters(force, rest)))
    return result


def _hardest(
    effects: tuple[str, ...], selected: bool, ways: Sequence[tuple[Array, Array, Array]], matters: Array
) -> Separation:
    """The parting in each trial from the stand-in that comes closest there."""
    worst = np.argmin([information.sum(axis=1) for information, _, _ in ways], axis=0)
    every = np.arange(worst.size)
    information, share = (np.array([way[n] for way in ways])[worst, every] for n in (0, 1))
    before = ways[worst[int(np.argmax(information.sum(axis=1)))]][2]
    return Separation(effects, selected, information, share, before, matters)


def _ways(options: Sequence[Option]) -> list[list[int]]:
    """Columns of each shape in which an absent candidate may stand in."""
    ways = [[i for i in (option.offset, *option.free) if i >= 0] for option in options if option.present]
    return [way for way in ways if way]


class _JointTrials:
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

    def residual(self, force: Array, regressors: Sequence[int]) -> tuple[Array, Array, Array]:
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


_MOST_TRUTHS = 3
"""Models that may be true, and along whose motions a trial is rehearsed: each costs as much as the first."""

_MATTERS = 1.5
"""Times the share of the force from which an effect matters that it shall have with the trial: sizes are not exact."""


@dataclass(frozen=True, slots=True)
class Rehearsed:
    """Simulated outcome of trials.

    Attributes
    ----------
    gain : (truths, trials) log-likelihood by which each model that may be true would part from the one most like it;
        0 for a trial that diverges
    reach : (trials,) largest distance from where a run begins, of any model, until it has coasted for `REST` [m]
    speed : (trials,) highest speed over ground, of any model [m/s]
    """

    gain: Array
    reach: Array
    speed: Array


@dataclass(frozen=True, slots=True, eq=False)
class OpenQuestion:
    """One effect beside those that look like it, or beside nothing.

    Attributes
    ----------
    effects : keys; the first is what the search selected, the others would do as well
    search : on the force balance of the log, of these candidates and of those in the model
    truths : models that may be true, each with the key that it has and the others have not
    plausible : amounts of effects that the log does not show, see `part`
    heading : on which trials begin [rad]
    look_alikes : vehicles with a plausible amount of an effect that the log does not show, which may get farther
    """

    effects: tuple[str, ...]
    search: Search
    truths: tuple[tuple[str, State], ...]
    plausible: Mapping[str, tuple[float, ...]]
    heading: float
    look_alikes: tuple[Vehicle, ...] = ()

    @property
    def supposed(self) -> bool:
        """True when the log shows none of the effects, so that a plausible amount is taken for one."""
        return self.effects[0] not in self.truths[0][1].active

    def rehearse(self, trials: Sequence[Trial]) -> Rehearsed:
        """Drive trials on every model that may be true, and see by how much it would part from the others."""
        gain, every = np.zeros((len(self.truths), len(trials))), []
        end = max(float(motion.minutes[-1]) for motion in self.search.balance.motions)
        for k, (key, state) in enumerate(self.truths):
            coasted = self._coasted(state.vehicle, trials, end)
            rows = round(REST / COMMAND_STEP)
            driven = [[run.slice(0, run.time.size - rows) for run in runs] for runs in coasted]
            whole = [n for n, runs in enumerate(driven) if len(runs) == len(trials[n].headings)]
            if whole:
                gain[k, whole] = self._parted(key, state, [trials[n] for n in whole], [driven[n] for n in whole])
            every.append(coasted)
        every += [self._coasted(vehicle, trials, end) for vehicle in self.look_alikes]
        ends = np.array([[_farthest(runs) for runs in coasted] for coasted in every]).max(axis=0)
        return Rehearsed(gain, ends[:, 0], ends[:, 1])

    def _coasted(self, vehicle: Vehicle, trials: Sequence[Trial], end: float) -> Sequence[Sequence[Motion]]:
        """Trials with the rest after them, in which a boat goes on by itself."""
        return drive(vehicle, [replace(t, steps=(*t.steps, (REST, 0.0, 0.0))) for t in trials], self.heading, end)

    def _parted(self, key: str, state: State, trials: Sequence[Trial], driven: Sequence[Sequence[Motion]]) -> Array:
        rehearsal = rehearsal_of(self.search, state.vehicle, state.active, trials, driven, sensed=True)
        others = [other for other in self.effects if other != key]
        partings = separate_effects(self.search, state, {key: others}, self.plausible, rehearsal)
        found = [p for p in partings if key in p.effects]
        # Forces that a trial adds must not bury the effect: what does not matter beside them is not named.
        needed = _MATTERS * self.search.settings.materiality
        buried = np.minimum(1.0, found[0].matters / needed) ** 2
        return buried * np.min([p.gain for p in found], axis=0)


def open_question(
    search: Search,
    state: State,
    effects: Sequence[str],
    plausible: Mapping[str, tuple[float, ...]],
    heading: float | None = None,
) -> OpenQuestion:
    """The question which of some effects is there, about the model that a search ended with.

    Parameters
    ----------
    search, state : on the force balance
    effects : keys; one alone is told from whatever could hide it
    plausible : see `part`
    heading : on which trials begin [rad]; None for that on which the log begins

    Raises
    ------
    RequestError
        for a key that the search does not know, naming the nearest, or one that is given twice.
    """
    known = {c.key for c in search.pool if not c.nuisance}
    for name in effects:
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.0)
            raise RequestError(f"plan: unknown effect {name!r}: did you mean {near[0]!r}?")
    if len(set(effects)) < len(effects):
        raise RequestError(f"plan: expected different effects, got {' '.join(effects)}")
    first, *rivals = sorted(effects, key=lambda name: name not in state.active)
    for other in rivals:
        if other in state.active:  # which of the two: the model is asked about as if it had the first alone
            state = search.without(state, other)
    if rivals:
        pool = [c for c in search.pool if c.key in (first, *rivals, *state.active) or c.nuisance]
        search = Search(search.balance, search.nominal, pool, replace(search.settings, refinements=2))
    truths = [(first, state)]
    if first in state.active:
        linear, scores, _ = search.about(state)
        for other in rivals[: _MOST_TRUTHS - 1]:
            truths.append((other, search.replace(state, first, other, linear, scores)))
    begins = float(search.balance.motions[0].heading[0]) if heading is None else heading
    pool = [] if first in state.active else [c for c in search.pool if c.key in (first, *rivals)]
    beside = [other for c in pool for other in _plausible(state.vehicle, c, plausible[c.key])]
    return OpenQuestion((first, *rivals), search, tuple(truths), plausible, begins, tuple(beside))


def _plausible(vehicle: Vehicle, candidate: Candidate, amounts: tuple[float, ...]) -> list[Vehicle]:
    """A vehicle with a plausible amount of an effect; none where it would be no sound vehicle."""
    values = {p.symbol: p.grid[len(p.grid) // 2] for p in candidate.parameters if p.grid}
    amplitudes = [p for p in candidate.parameters if not p.grid]
    for parameter, amount in zip(amplitudes, amounts, strict=False):
        now = vehicle.value(parameter.symbol)
        values[parameter.symbol] = (
            now + amount if now + amount <= parameter.upper else max(now - amount, parameter.lower)
        )
    try:
        return [vehicle.with_values(values)]
    except VehicleError:
        return []


def _farthest(runs: Sequence[Motion]) -> tuple[float, float]:
    """The largest distance from where a run begins, and the largest speed; a trial that diverges has no limit."""
    if not runs:
        return np.inf, np.inf
    far = max(float(np.hypot(*(run.position - run.position[0]).T).max()) for run in runs)
    return far, max(float(np.hypot(*run.velocity[:, :2].T).max()) for run in runs)
