"""Advice: the manoeuvre that would settle what a log leaves open, chosen by rehearsing all of them on the model.

For each open question the log and a rehearsed trial are put together, the doubtful effect acts with its size, and
everything that could stand in for it is fitted. What no stand-in explains would raise the score of the search by

    gain = n/2 sum over axes of log(1 + d^2 / (noise^2 + floor^2)),

d the root mean square force left, n the independent tests of log and trial together. That is the information (in the
sense of Kullback and Leibler 1951, doi:10.1214/aoms/1177729694) by which the two models would part, in the units in
which the search prices effects; a trial that promises enough of it settles the question.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import ceil

import numpy as np

from ..physics.frames import AXES, Array
from .evidence import TELL_APART, Evidence
from .identifiability import Identifiability, column_moments
from .options import Option
from .rehearsal import Rehearsal, amplitude_columns, rehearse
from .search import Search, State

MOST_ITEMS = 6
"""Most manoeuvres advised."""
_AS_GOOD = 0.7
"""Share of the best trial's gain from which another will do."""
_BEYOND_DOUBT = 4.0 * TELL_APART
_MOST_RUNS = 4
_MOST_NAMED = 4
_MOST_RIVALS = 6
_RIDGE = 1e-9
_BY_OTHER_MEANS = "measure one of the look-alikes by other means, and give its value in the vehicle file"


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
    """

    effects: tuple[str, ...]
    selected: bool
    information: Array
    share: Array
    before: Array

    @property
    def gain(self) -> Array:
        """Log-likelihood on all axes, (trials,)."""
        return self.information.sum(axis=1)


def advise(
    search: Search,
    state: State,
    questions: Mapping[str, Sequence[str]],
    plausible: Mapping[str, tuple[float, ...]],
    rehearsal: Rehearsal | None = None,
) -> tuple[dict[str, str], ...]:
    """Manoeuvres that would settle open questions, each with what it would settle, at most six.

    What the search selected comes first. The trial that parts most pairs is taken until none is left; one that parts a
    pair with seven tenths of the best one's gain will do, and so will one chosen already that parts it beyond doubt.

    Parameters
    ----------
    state : the model that the search ended with
    questions : candidates in doubt, each with its look-alikes; one without is told from anything that could hide it
    plausible : an amount for each amplitude column of every candidate, for effects that the log does not show
    rehearsal : of `state`, if there is one already
    """
    rehearsal = rehearsal or (rehearse(search, state.vehicle, state.active) if questions else None)
    if rehearsal is None or not questions:
        return ()
    partings = part(search, state, questions, plausible, rehearsal)
    promising = [p for p in partings if p.gain.max() >= TELL_APART / _MOST_RUNS]
    plan: dict[int, list[Parting]] = {}
    for left in ([p for p in promising if p.selected], [p for p in promising if not p.selected]):
        while left and len(plan) < MOST_ITEMS:
            ahead = [k for k in plan if any(_settles(p, k) for p in left)]
            trial = max(ahead or range(len(rehearsal.trials)), key=lambda k: _worth(left, k))
            settled = [p for p in left if _settles(p, trial)]
            plan.setdefault(trial, []).extend(settled)
            left = [p for p in left if p not in settled]
    items = []
    for trial, settled in plan.items():
        runs = max(ceil(TELL_APART / p.gain[trial]) for p in settled)
        often = f", {runs} times" if runs > 1 else ""
        items.append({"manoeuvre": rehearsal.trials[trial].text + often, "why": reasons(settled, trial)})
    hopeless = [p for p in partings if p.selected and p.gain.max() < TELL_APART / _MOST_RUNS]
    if hopeless:
        purposes = "; ".join(map(_purpose, hopeless[:_MOST_NAMED]))
        why = f"{purposes}: none of the {len(rehearsal.trials)} manoeuvres that were rehearsed would do"
        items.append({"manoeuvre": _BY_OTHER_MEANS, "why": why})
    return tuple(items[:MOST_ITEMS])


def open_questions(
    evidence: Sequence[Evidence], kept: Sequence[str], known: Identifiability
) -> dict[str, tuple[str, ...]]:
    """What a discovery leaves open: selected effects that are not sure, with look-alikes; and those it cannot see.

    An effect that the log does not show has no look-alikes there but in name.
    """
    blind = {*known.dormant, *known.noise_limited}
    chosen = [e for e in evidence if e.selected and e.key not in kept]
    hidden = {e.key: () for e in evidence if not e.selected and e.key in blind}
    return {e.key: () if e.key in blind else e.indistinguishable_from for e in chosen} | hidden


def part(
    search: Search,
    state: State,
    questions: Mapping[str, Sequence[str]],
    plausible: Mapping[str, tuple[float, ...]],
    rehearsal: Rehearsal,
) -> list[Parting]:
    """How look-alikes, pair by pair, and effects without any would part in each trial; parameters as `advise`.

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
        group = rivals[:_MOST_RIVALS]
        ways = {other: _ways(linear.options[other]) for other in group}
        forces = {key: force} | {other: stand.replacement(force, ways[other], rest) for other in group}
        if selected:
            ways[key] = [free[key] or [linear.options[key][1].offset]]
        for a, b in combinations(forces, 2):
            sets = [(forces[a], [*rest, *way]) for way in ways[b]] + [(forces[b], [*rest, *way]) for way in ways[a]]
            found.append(_hardest((a, b), selected, [stand.left(f, regressors) for f, regressors in sets]))
        if not group:
            others = () if selected else [c.key for c in search.pool if c.key != key and c.key not in state.active]
            sets = [[*rest, *way] for other in others for way in _ways(linear.options[other])] or [rest]
            found.append(_hardest((key,), selected, [stand.left(force, regressors) for regressors in sets]))
    return found


def _hardest(effects: tuple[str, ...], selected: bool, ways: Sequence[tuple[Array, Array, Array]]) -> Parting:
    """The parting in each trial from the stand-in that comes closest there."""
    worst = np.argmin([information.sum(axis=1) for information, _, _ in ways], axis=0)
    every = np.arange(worst.size)
    information, share = (np.array([way[n] for way in ways])[worst, every] for n in (0, 1))
    before = ways[worst[int(np.argmax(information.sum(axis=1)))]][2]
    return Parting(effects, selected, information, share, before)


def _ways(options: Sequence[Option]) -> list[list[int]]:
    """Columns of each shape in which an absent candidate may stand in."""
    ways = [[i for i in (option.offset, *option.free) if i >= 0] for option in options if option.present]
    return [way for way in ways if way]


class _Stand:
    """Log and trials as Gram matrices, each trial added to the log."""

    def __init__(self, search: Search, rehearsal: Rehearsal, moments: Array, scale: Array) -> None:
        rows = search.weak.time.size
        self.scale = scale
        self.trial, force, tests = rehearsal.moments(scale)
        self.log = rows * moments / (scale[:, None] * scale[None, :])
        self.both = self.log + self.trial
        self.tests, self.all = tests[:, None], tests[:, None] + rows
        self.trial_force = np.sqrt(force / self.tests)
        self.log_force, self.log_rows = search.force_scale, rows
        both_force = (force + rows * search.force_scale**2) / self.all
        self.variance = search.noise_error**2 + search.settings.materiality**2 * both_force
        self.independent = search.weak.independent * self.all[:, 0] / rows
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
        inner = inner + _RIDGE * size[:, :, None] * np.eye(inner.shape[1])
        pull = (normal[:, free] @ left[:, :, None])[..., 0]
        scale = 1.0 / np.sqrt(size)
        solved = np.linalg.solve(inner * scale[:, :, None] * scale[:, None, :], (pull * scale)[..., None])[..., 0]
        left[:, free] -= solved * scale
    return left


def _square(gram: Array, mixed: Array) -> Array:
    """Summed squares on each axis (k, 3) of combinations (k, q) under Gram matrices (k, 3, q, q)."""
    return np.maximum(np.einsum("kp,kapq,kq->ka", mixed, gram, mixed), 0.0)


def _serves(parting: Parting, trial: int) -> bool:
    return bool(parting.gain[trial] >= _AS_GOOD * float(parting.gain.max()))


def _settles(parting: Parting, trial: int) -> bool:
    """True when a trial that is to be driven anyway is enough."""
    return _serves(parting, trial) or bool(parting.gain[trial] >= _BEYOND_DOUBT)


def _worth(partings: Sequence[Parting], trial: int) -> tuple[int, float]:
    """How many partings a trial serves, and how well in comparison with the best trial for each."""
    served = [p for p in partings if _serves(p, trial)]
    return len(served), float(sum(p.gain[trial] / p.gain.max() for p in served))


def reasons(settled: Sequence[Parting], trial: int) -> str:
    """Why a trial is advised: what it would tell or show, with the shares of force, there and in the log so far.

    Pairs are told together, with the numbers of the pair that is hardest to part.
    """
    pairs = [p for p in settled if len(p.effects) > 1]
    told = []
    if pairs:
        names = list(dict.fromkeys(key for p in pairs for key in p.effects))
        hardest = min(pairs, key=lambda p: p.gain[trial])
        who = "they would differ" if len(pairs) == 1 else f"even {_listed(hardest.effects)} would differ"
        told.append(f"would tell {_apart(names)}: {who} by {_shares(hardest, trial)}")
    single = sorted((p for p in settled if len(p.effects) == 1), key=lambda p: (not p.selected, -p.gain[trial]))
    for p in single[:_MOST_NAMED]:
        what = "it" if p.selected else "a plausible amount of it, beyond all that could hide it,"
        told.append(f"{_purpose(p)}: {what} would make {_shares(p, trial)}")
    if len(single) > _MOST_NAMED:
        told.append(f"and {len(single) - _MOST_NAMED} more effects that this log does not show")
    return "; ".join(told)


def _shares(p: Parting, trial: int) -> str:
    axis = int(np.argmax(p.information[trial]))
    there, here = _percent(p.share[trial, axis]), _percent(p.before[axis])
    return f"{there} of the {AXES[axis]} force (in this log: {here})"


def _purpose(p: Parting) -> str:
    if len(p.effects) > 1:
        return f"would tell {_apart(p.effects)}"
    return f"would {'settle whether there is' if p.selected else 'show'} {_words(p.effects[0])}"


def _apart(keys: Sequence[str]) -> str:
    return f"{_words(keys[0])} from {_words(keys[1])}" if len(keys) == 2 else f"{_listed(keys)} apart"


def _listed(keys: Sequence[str]) -> str:
    names = [_words(key) for key in keys]
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _words(key: str) -> str:
    return key.replace("_", " ").replace("[", " (").replace("]", ")")


def _percent(share: float) -> str:
    return f"{share:.0%}".replace("%", " %") if share >= 0.0095 else f"{share:.1%}".replace("%", " %")
