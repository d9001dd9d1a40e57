"""Optimal manoeuvres: the shortest one that tells look-alike effects apart within limits.

The design is T-optimal (Atkinson and Fedorov 1975, doi:10.1093/biomet/62.1.57): the best stand-in, refitted to each
manoeuvre, must leave enough of the true model's force; here the least time for that is sought. Times and levels are
improved by mutation and selection (Beyer and Schwefel 2002, doi:10.1023/A:1015059928466), a hundred manoeuvres at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import erfc, inf, sqrt

import numpy as np

from ...measurements.preparation.prepare import LEAST_SECONDS as LEAST_LOG
from ...physics.worlds.manoeuvres import REST, TRIALS, Step, Trial, in_words
from ..evidence.weighing import CERTAINLY
from ..search.scoring import TELL_APART
from .separation import OpenQuestion, Rehearsed

_STEP_SECONDS, _LEVELS = 0.5, 20
"""To what times are rounded [s], and how many levels make full command: finer ones nobody could drive, or read."""
_SHORTEST, _LONGEST = 1.0, 20.0
"""Length of one step [s]."""
_MOST_STEPS = 10
"""Steps of a manoeuvre: more are hard to read and gain nothing."""

Steps = tuple[Step, ...]


class Limit(Enum):
    """What a manoeuvre must keep to, in words."""

    SPEED = "speed"
    SPACE = "space"
    THRUST = "thrust"
    SECONDS = "time"


@dataclass(frozen=True, slots=True)
class Bounds:
    """Within what a manoeuvre must stay.

    Attributes
    ----------
    speed : over ground [m/s]
    space : distance from where it begins [m]
    thrust : share of full command
    seconds : length [s]
    """

    speed: float = inf
    space: float = 50.0
    thrust: float = 1.0
    seconds: float = 120.0

    def without(self, limit: Limit) -> "Bounds":
        """The same without one of them; that of time ten times as long."""
        widest = {Limit.SPEED: inf, Limit.SPACE: inf, Limit.THRUST: 1.0, Limit.SECONDS: 10.0 * self.seconds}
        return replace(self, **{limit.name.lower(): widest[limit]})

    def in_words(self, limit: Limit) -> str:
        """One of them with its number."""
        numbers = {
            Limit.SPEED: f"{self.speed:g} m/s",
            Limit.SPACE: f"{self.space:g} m",
            Limit.THRUST: f"{100.0 * self.thrust:.0f} % thrust",
            Limit.SECONDS: f"{self.seconds:g} s",
        }
        return numbers[limit]


def first_manoeuvres(count: int, bounds: Bounds, rng: np.random.Generator) -> list[Steps]:
    """The library's manoeuvres and random ones.

    Parameters
    ----------
    count : manoeuvres, the library's among them
    bounds : of thrust and time
    rng : of the random ones
    """
    library = [within_bounds(trial.steps[:_MOST_STEPS], bounds) for trial in TRIALS]
    drawn = ([_step(rng) for _ in range(int(rng.integers(2, 7)))] for _ in range(count - len(library)))
    return library + [within_bounds(steps, bounds) for steps in drawn]


def _step(rng: np.random.Generator) -> Step:
    turn = rng.uniform(-1.0, 1.0) if rng.random() < 0.7 else 0.0
    common = rng.uniform(-1.0, 1.0) if rng.random() < 0.8 else 0.0
    return float(rng.uniform(1.5, 8.0)), float(common), float(turn)


def mutate(parents: Sequence[Steps], bounds: Bounds, rng: np.random.Generator) -> Steps:
    """A parent with a few changes: of a time, of a level, of the order; a step more or less; a piece of another.

    Parameters
    ----------
    parents : manoeuvres, the best first; better ones are drawn more often
    bounds : of thrust and time
    rng : of the changes
    """
    steps = list(parents[int(len(parents) * rng.random() ** 2)])
    for _ in range(1 + int(rng.random() < 0.5) + int(rng.random() < 0.25)):
        at, kind = int(rng.integers(len(steps))), rng.random()
        seconds, common, turn = steps[at]
        if kind < 0.3:
            steps[at] = (seconds * float(np.exp(0.4 * rng.standard_normal())), common, turn)
        elif kind < 0.6:
            change = 0.25 * rng.standard_normal(2) * (rng.random(2) < 0.7)
            steps[at] = (seconds, common + float(change[0]), turn + float(change[1]))
        elif kind < 0.7 and len(steps) > 1:
            del steps[at]
        elif kind < 0.77:
            steps.insert(at, _step(rng))
        elif kind < 0.81:
            steps[at] = (seconds, common, -turn) if rng.random() < 0.5 else (seconds, -common, turn)
        elif kind < 0.87:
            other = parents[int(rng.integers(len(parents)))]
            steps = [*steps[: at + 1], *other[int(rng.integers(len(other))) :]]
        else:
            share = float(rng.uniform(0.6, 0.95))
            steps = [(share * s, c, t) for s, c, t in steps]
    return within_bounds(steps, bounds)


def shorten(steps: Steps, bounds: Bounds) -> list[Steps]:
    """The same with a step shorter or left out, or all of them shorter."""
    result = [within_bounds([(share * s, c, t) for s, c, t in steps], bounds) for share in (0.8, 0.9, 0.95)]
    for at, (seconds, common, turn) in enumerate(steps):
        for less in (0.5, 1.0, 2.0, seconds):
            left = [(seconds - less, common, turn)] if seconds - less >= _SHORTEST else []
            result.append(within_bounds([*steps[:at], *left, *steps[at + 1 :]], bounds))
    return result


def within_bounds(steps: Sequence[Step], bounds: Bounds) -> Steps:
    """Steps rounded, and within the limits of thrust and time; two alike are one, and none begins at rest."""
    found: list[Step] = []
    for seconds, common, turn in steps[:_MOST_STEPS]:
        levels = _within(common, turn, bounds.thrust)
        if not found and levels == (0.0, 0.0):
            continue
        length = float(np.clip(round(seconds / _STEP_SECONDS) * _STEP_SECONDS, _SHORTEST, _LONGEST))
        left = bounds.seconds - sum(step[0] for step in found)
        length = min(length, int(left / _STEP_SECONDS) * _STEP_SECONDS)
        if length < _SHORTEST:
            break
        if found and found[-1][1:] == levels:
            length += found.pop()[0]
        found.append((length, *levels))
    return tuple(found)


def _within(common: float, turn: float, thrust: float) -> tuple[float, float]:
    """Levels rounded, so that neither side gets more than a share of full command."""
    most = int(thrust * _LEVELS + 1e-9)
    turned = int(np.clip(round(turn * _LEVELS), -most, most))
    both = int(np.clip(round(common * _LEVELS), abs(turned) - most, most - abs(turned)))
    return both / _LEVELS, turned / _LEVELS


ENOUGH = 4.0 * TELL_APART
"""Log-likelihood to reach: nine manoeuvres of ten then settle the question, see `chance`."""
_POPULATION, _PARENTS = 48, 12
"""Manoeuvres of a generation, and how many of them have descendants."""
_GENERATIONS, _PATIENCE = 24, 7
"""Generations at most, and how many without a shorter manoeuvre end the search."""
LEAST_SECONDS = LEAST_LOG - 2.0 * REST + 2.0
"""Shortest manoeuvre [s]: with the rest before and after it two more than the shortest log that is read."""
_RUNS = 4
"""Times that a manoeuvre of the library may be driven to reach as much, as in the advice."""
_OUTSIDE = 4.0
"""Times by which a manoeuvre counts as longer for each share by which it breaks a limit: it has descendants, for the
best one lies near the limits, and is never chosen."""
_WITHIN = 0.9
"""Share of the limits of space and speed within which is planned: a mission is broken off at the limits themselves, and
wind, waves and the noise of positions add to what the models do."""


@dataclass(frozen=True, slots=True)
class Driven:
    """A manoeuvre as the models drive it.

    Attributes
    ----------
    trial : what is driven
    gains : log-likelihood by which each model that may be true would part from the one most like it
    reach : largest distance from where it begins, with the rest after it [m]
    speed : highest speed over ground [m/s]
    """

    trial: Trial
    gains: tuple[float, ...]
    reach: float
    speed: float

    @property
    def seconds(self) -> float:
        """Length [s]."""
        return self.trial.seconds

    @property
    def probability(self) -> float:
        """That it tells the effects apart, 0..1, if each of the models is as likely to be true; see `chance`."""
        return sum(map(separation_probability, self.gains)) / len(self.gains)


def separation_probability(gain: float) -> float:
    """The probability that a true model is told from another, from which it parts by a log-likelihood.

    The log-likelihood ratio of two models that differ by a known signal in white noise is normal, of mean G and
    variance 2 G (Van Trees 1968, section 2.6); it is named from `CERTAINLY` on.
    """
    return 0.5 * erfc((CERTAINLY - gain) / (2.0 * sqrt(gain))) if gain > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """The answer to an open question.

    Attributes
    ----------
    best : the shortest that settles it, or what comes nearest
    fixed : the manoeuvre of the library that settles it in the least time, driven as often as that takes, whatever the
        limits are; where none does, the one that tells most
    bounds : that were kept
    binding : limits without which one would settle it, where none does within them
    hopeless : effects that no manoeuvre that was tried would tell from the others, were they the true ones
    """

    best: Driven
    fixed: Driven
    bounds: Bounds
    binding: tuple[Limit, ...] = ()
    hopeless: tuple[str, ...] = ()

    @property
    def tells(self) -> bool:
        """True when it is more likely than not to tell the effects apart."""
        return self.best.probability > 0.5


def find_shortest(question: OpenQuestion, bounds: Bounds | None = None, seed: int = 0) -> Manoeuvre:
    """The shortest manoeuvre that settles a question within limits, beside the library's best.

    Parameters
    ----------
    seed : equal seeds give equal manoeuvres
    """
    bounds = bounds or Bounds()
    often = [replace(trial, headings=trial.headings * n) for trial in TRIALS for n in range(1, _RUNS + 1)]
    found = question.rehearse(often)
    asked = np.flatnonzero(found.gain.max(axis=1) >= TELL_APART)
    asked = asked if asked.size else np.arange(len(question.truths))
    worst = found.gain[asked].min(axis=0)
    enough = np.flatnonzero(worst >= ENOUGH).tolist()
    fixed = min(enough, key=lambda n: often[n].seconds, default=int(np.argmax(worst)))
    search = _Optimiser(question, bounds, asked)
    best = search.run(seed)
    binding: list[Limit] = []
    if best.probability <= 0.5:
        wider = {limit: bounds.without(limit) for limit in Limit}
        binding = [
            limit
            for limit, wide in wider.items()
            if wide != bounds and _Optimiser(question, wide, asked).run(seed).probability > 0.5
        ]
    hopeless = [
        key
        for k, (key, _) in enumerate(question.truths)
        if max(found.gain[k].max(), *(driven.gains[k] for driven in search.known.values())) < TELL_APART
    ]
    return Manoeuvre(best, _driven(often[fixed], found, fixed), bounds, tuple(binding), tuple(hopeless))


def _driven(trial: Trial, found: Rehearsed, n: int) -> Driven:
    return Driven(trial, tuple(found.gain[:, n].tolist()), float(found.reach[n]), float(found.speed[n]))


class _Optimiser:
    """One search for the shortest manoeuvre; `asked` are the truths that it must tell."""

    def __init__(self, question: OpenQuestion, bounds: Bounds, asked: np.ndarray) -> None:
        self.question, self.bounds, self.asked = question, bounds, asked.tolist()
        self.known: dict[Steps, Driven] = {}

    def run(self, seed: int) -> Driven:
        """Mutate and select, then take off whatever time is not needed."""
        rng = np.random.default_rng([seed, 11])
        self._rehearse(first_manoeuvres(2 * _POPULATION, self.bounds, rng))
        best, waited = self._best(), 0
        for _ in range(_GENERATIONS):
            parents = sorted(self.known, key=lambda steps: self._cost(self.known[steps]))[:_PARENTS]
            self._rehearse([mutate(parents, self.bounds, rng) for _ in range(_POPULATION)])
            waited = 0 if self._order(self._best()) < self._order(best) else waited + 1
            best = self._best()
            if waited >= _PATIENCE and self._broken(best) == 0.0:
                break
        for _ in range(_GENERATIONS):
            self._rehearse(shorten(best.trial.steps, self.bounds))
            if self._order(self._best()) >= self._order(best):
                break
            best = self._best()
        return best if self._broken(best) == 0.0 else replace(best, gains=(0.0,) * len(best.gains))

    def _rehearse(self, asked: Sequence[Steps]) -> None:
        new = [s for s in dict.fromkeys(asked) if s not in self.known and sum(step[0] for step in s) >= LEAST_SECONDS]
        if new:
            trials = [Trial("optimised", in_words(steps), steps) for steps in new]
            found = self.question.rehearse(trials)
            self.known |= {steps: _driven(trials[n], found, n) for n, steps in enumerate(new)}

    def _best(self) -> Driven:
        return min(self.known.values(), key=self._order)

    def _gain(self, driven: Driven) -> float:
        return min(driven.gains[k] for k in self.asked)

    def _order(self, driven: Driven) -> tuple[float, float]:
        """Within limits the shortest that is enough, else the one that comes nearest; then what is nearest to them."""
        broken, gain = self._broken(driven), self._gain(driven)
        if broken > 0.0:
            return 2.0, broken
        return (0.0, driven.seconds) if gain >= ENOUGH else (1.0, -gain)

    def _cost(self, driven: Driven) -> float:
        """Time until the gain is enough, were the manoeuvre repeated [s]; longer outside of limits.

        Half of what is more than enough counts, as time can be taken off for it.
        """
        ratio = ENOUGH / max(self._gain(driven), 1e-3)
        return driven.seconds * (ratio if ratio > 1.0 else sqrt(ratio)) * (1.0 + _OUTSIDE * self._broken(driven))

    def _broken(self, driven: Driven) -> float:
        """By how much limits are broken, as a share of them."""
        bounds = self.bounds
        near = ((driven.reach, _WITHIN * bounds.space), (driven.speed, _WITHIN * bounds.speed))
        kept = (*near, (driven.seconds, bounds.seconds))
        return float(sum(max(0.0, found / limit - 1.0) if found < inf else 1e3 for found, limit in kept))
