"""The question that a manoeuvre is to settle: which of a few models is true, and what each would make of a trial."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np

from ...physics.errors import RequestError, VehicleError
from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ...physics.worlds.manoeuvres import COMMAND_STEP
from ...physics.worlds.trials import REST, Trial, drive
from ..candidates.candidate import Candidate
from ..identifiability.rehearsal import rehearsal_of
from ..search.floating import Search, State
from .separation import part

_MOST_TRUTHS = 3
"""Models that may be true, and along whose motions a trial is rehearsed: each costs as much as the first."""

_MATTERS = 1.5
"""Times the share of the force from which an effect matters that it shall have with the trial: sizes are not exact."""


@dataclass(frozen=True, slots=True)
class Rehearsed:
    """What trials would do.

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
    beside : vehicles with a plausible amount of an effect that the log does not show, which may get farther
    """

    effects: tuple[str, ...]
    search: Search
    truths: tuple[tuple[str, State], ...]
    plausible: Mapping[str, tuple[float, ...]]
    heading: float
    beside: tuple[Vehicle, ...] = ()

    @property
    def supposed(self) -> bool:
        """Whether the log shows none of the effects, so that a plausible amount is taken for one."""
        return self.effects[0] not in self.truths[0][1].active

    def rehearse(self, trials: Sequence[Trial]) -> Rehearsed:
        """Drive trials on every model that may be true, and see by how much it would part from the others."""
        gain, reach, speed = np.zeros((len(self.truths), len(trials))), np.zeros(len(trials)), np.zeros(len(trials))
        end = max(float(motion.minutes[-1]) for motion in self.search.balance.motions)
        for k, (key, state) in enumerate(self.truths):
            coasted = self._coasted(state.vehicle, trials, end)
            rows = round(REST / COMMAND_STEP)
            driven = [[run.slice(0, run.time.size - rows) for run in runs] for runs in coasted]
            whole = [n for n, runs in enumerate(driven) if len(runs) == len(trials[n].headings)]
            if whole:
                gain[k, whole] = self._parted(key, state, [trials[n] for n in whole], [driven[n] for n in whole])
            reach, speed = _farther(reach, speed, coasted)
        for vehicle in self.beside:
            reach, speed = _farther(reach, speed, self._coasted(vehicle, trials, end))
        return Rehearsed(gain, reach, speed)

    def _coasted(self, vehicle: Vehicle, trials: Sequence[Trial], end: float) -> Sequence[Sequence[Motion]]:
        """Trials with the rest after them, in which a boat goes on by itself."""
        return drive(vehicle, [replace(t, steps=(*t.steps, (REST, 0.0, 0.0))) for t in trials], self.heading, end)

    def _parted(self, key: str, state: State, trials: Sequence[Trial], driven: Sequence[Sequence[Motion]]) -> Array:
        rehearsal = rehearsal_of(self.search, state.vehicle, state.active, trials, driven, sensed=True)
        others = [other for other in self.effects if other != key]
        partings = part(self.search, state, {key: others}, self.plausible, rehearsal)
        found = [p for p in partings if key in p.effects]
        # Forces that a trial adds must not bury the effect: what does not matter beside them is not named.
        needed = _MATTERS * self.search.settings.materiality
        buried = np.minimum(1.0, found[0].matters / needed) ** 2
        return buried * np.min([p.gain for p in found], axis=0)


def ask(
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
        linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
        for other in rivals[: _MOST_TRUTHS - 1]:
            truths.append((other, search.replace(state, first, other, linear, scores)))
    begins = float(search.balance.motions[0].heading[0]) if heading is None else heading
    pool = [] if first in state.active else [c for c in search.pool if c.key in (first, *rivals)]
    beside = [other for c in pool for other in _plausible(state.vehicle, c, plausible[c.key])]
    return OpenQuestion((first, *rivals), search, tuple(truths), plausible, begins, tuple(beside))


def _plausible(vehicle: Vehicle, candidate: Candidate, amounts: tuple[float, ...]) -> list[Vehicle]:
    """A vehicle with a plausible amount of an effect; none where it would be no sound vehicle."""
    shapes = {p.symbol: p.grid[len(p.grid) // 2] for p in candidate.parameters if p.grid}
    values = dict(shapes)
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


def _farther(reach: Array, speed: Array, driven: Sequence[Sequence[Motion]]) -> tuple[Array, Array]:
    """The largest distances and speeds so far, and along more motions; a trial that diverges has no limit."""
    far = [max((_reach(run) for run in runs), default=np.inf) for runs in driven]
    fast = [max((_speed(run) for run in runs), default=np.inf) for runs in driven]
    return np.maximum(reach, far), np.maximum(speed, fast)


def _reach(run: Motion) -> float:
    return float(np.hypot(*(run.position - run.position[0]).T).max())


def _speed(run: Motion) -> float:
    return float(np.hypot(*run.velocity[:, :2].T).max())
