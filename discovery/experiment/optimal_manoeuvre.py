"""The shortest manoeuvre that tells look-alikes apart, within limits: its steps are optimised on the model.

The design is T-optimal (Atkinson and Fedorov 1975, doi:10.1093/biomet/62.1.57): of all manoeuvres that may be driven it
takes the one in which the best stand-in leaves most of the true model's force, with the stand-in fitted anew to each.
Here the manoeuvre is to be short, so what is least is the time until that force is enough. Times and levels are
improved by mutation and selection (Beyer and Schwefel 2002, doi:10.1023/A:1015059928466), many manoeuvres at a time,
as the model drives a hundred of them in the time of ten.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import erfc, inf, sqrt

import numpy as np

from ...physics.worlds.trials import TRIALS, Step, Trial, in_words
from ..evidence.weighing import TELL_APART
from .open_question import OpenQuestion, Rehearsed

ENOUGH = 4.0 * TELL_APART
"""Log-likelihood to reach: the question is then settled even if the effect is half as large as the log says."""
_POPULATION, _PARENTS = 48, 12
"""Manoeuvres of a generation, and how many of them have descendants."""
_GENERATIONS, _PATIENCE = 24, 7
"""Generations at most, and how many without a shorter manoeuvre end the search."""
_STEP_SECONDS, _LEVELS = 0.5, 20
"""To what times are rounded [s], and how many levels make full command: finer ones nobody could drive, or read."""
_SHORTEST, _LONGEST = 1.0, 20.0
"""Length of one step [s]."""
LEAST_SECONDS = 8.0
"""Shortest manoeuvre [s]: five test functions of the force balance side by side, so that no single wave decides."""
_MOST_STEPS = 10
"""Steps of a manoeuvre: more are hard to read and gain nothing."""
_RUNS = 4
"""Times that a manoeuvre of the library may be driven to reach as much, as in the advice."""
_OUTSIDE = 4.0
"""Times by which a manoeuvre counts as longer for each share by which it breaks a limit: it has descendants, for the
best one lies near the limits, and is never chosen."""


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

    def told(self, limit: Limit) -> str:
        """One of them with its number."""
        numbers = {
            Limit.SPEED: f"{self.speed:g} m/s",
            Limit.SPACE: f"{self.space:g} m",
            Limit.THRUST: f"{100.0 * self.thrust:.0f} % thrust",
            Limit.SECONDS: f"{self.seconds:g} s",
        }
        return numbers[limit]


@dataclass(frozen=True, slots=True)
class Driven:
    """A manoeuvre as the models drive it.

    Attributes
    ----------
    trial : what is driven
    gain : log-likelihood by which the true model would part from the one most like it, at least
    reach : largest distance from where it begins [m]
    speed : highest speed over ground [m/s]
    """

    trial: Trial
    gain: float
    reach: float
    speed: float

    @property
    def seconds(self) -> float:
        """Length [s]."""
        return self.trial.seconds

    @property
    def enough(self) -> bool:
        """Whether it settles the question with a margin."""
        return self.gain >= ENOUGH

    @property
    def probability(self) -> float:
        """That it tells the effects apart, 0..1.

        The log-likelihood ratio of two models that differ by a known signal in white noise is normal, of mean G and
        variance 2 G (Van Trees 1968, section 2.6); it tells them apart from `TELL_APART` on.
        """
        return 0.5 * erfc((TELL_APART - self.gain) / (2.0 * sqrt(self.gain))) if self.gain > 0.0 else 0.0


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
    """

    best: Driven
    fixed: Driven
    bounds: Bounds
    binding: tuple[Limit, ...] = ()

    @property
    def tells(self) -> bool:
        """Whether it is more likely than not to tell the effects apart."""
        return self.best.gain > TELL_APART


def shortest(question: OpenQuestion, bounds: Bounds | None = None, seed: int = 0) -> Manoeuvre:
    """The shortest manoeuvre that settles a question within limits, beside the library's best.

    Parameters
    ----------
    seed : equal seeds give equal manoeuvres
    """
    bounds = bounds or Bounds()
    fixed = _of_library(question)
    best = _optimised(question, bounds, seed)
    binding: list[Limit] = []
    if best.gain <= TELL_APART:
        wider = {limit: bounds.without(limit) for limit in Limit}
        binding = [
            limit
            for limit, wide in wider.items()
            if wide != bounds and _optimised(question, wide, seed).gain > TELL_APART
        ]
    return Manoeuvre(best, fixed, bounds, tuple(binding))


def _of_library(question: OpenQuestion) -> Driven:
    """The manoeuvre of the library, driven as often as it takes, that settles a question in the least time.

    Where none does, the one that tells most.
    """
    often = [replace(trial, headings=trial.headings * n) for trial in TRIALS for n in range(1, _RUNS + 1)]
    found = question.rehearse(often)
    enough = [n for n in range(len(often)) if found.gain[n] >= ENOUGH]
    best = min(enough, key=lambda n: often[n].seconds, default=int(np.argmax(found.gain)))
    return _driven(often[best], found, best)


def _driven(trial: Trial, found: Rehearsed, n: int) -> Driven:
    return Driven(trial, float(found.gain[n]), float(found.reach[n]), float(found.speed[n]))


def _optimised(question: OpenQuestion, bounds: Bounds, seed: int) -> Driven:
    rng = np.random.default_rng([seed, 11])
    known: dict[tuple[Step, ...], tuple[float, Driven]] = {}
    best, waited = (inf, inf), 0
    parents: list[tuple[Step, ...]] = []
    for _ in range(_GENERATIONS):
        asked = _first(bounds, rng) if not parents else [_child(parents, bounds, rng) for _ in range(_POPULATION)]
        new = [s for s in dict.fromkeys(asked) if s not in known and sum(step[0] for step in s) >= LEAST_SECONDS]
        if new:
            trials = [Trial("optimised", in_words(steps), steps) for steps in new]
            found = question.rehearse(trials)
            for n, steps in enumerate(new):
                driven = _driven(trials[n], found, n)
                known[steps] = _cost(driven, bounds), driven
        ranked = sorted(known, key=lambda steps: known[steps][0])
        parents = ranked[:_PARENTS]
        now = min((_order(driven, bounds) for _, driven in known.values()), default=best)
        waited = 0 if now < best else waited + 1
        best = min(best, now)
        if waited >= _PATIENCE and best[0] < 2.0:
            break
    found = min((driven for _, driven in known.values()), key=lambda driven: _order(driven, bounds))
    return found if _broken(found, bounds) == 0.0 else replace(found, gain=0.0)  # what may not be driven tells nothing


def _order(driven: Driven, bounds: Bounds) -> tuple[float, float]:
    """Within limits the shortest that is enough, else the one that comes nearest."""
    broken = _broken(driven, bounds)
    if broken > 0.0:
        return 2.0, broken
    return (0.0, driven.seconds) if driven.enough else (1.0, -driven.gain)


def _cost(driven: Driven, bounds: Bounds) -> float:
    """Time until the gain is enough, were the manoeuvre repeated [s]; longer outside of limits."""
    repeated = max(1.0, ENOUGH / max(driven.gain, 1e-3))
    return driven.seconds * repeated * (1.0 + _OUTSIDE * _broken(driven, bounds))


def _broken(driven: Driven, bounds: Bounds) -> float:
    """By how much limits are broken, as a share of them."""
    kept = ((driven.reach, bounds.space), (driven.speed, bounds.speed), (driven.seconds, bounds.seconds))
    return float(sum(max(0.0, is_ / limit - 1.0) if is_ < inf else 1e3 for is_, limit in kept))


def _first(bounds: Bounds, rng: np.random.Generator) -> list[tuple[Step, ...]]:
    """The library's manoeuvres and random ones."""
    library = [_kept(trial.steps[:_MOST_STEPS], bounds) for trial in TRIALS]
    return library + [_kept(_random(rng), bounds) for _ in range(2 * _POPULATION - len(library))]


def _random(rng: np.random.Generator) -> list[Step]:
    return [_step(rng) for _ in range(int(rng.integers(2, 7)))]


def _step(rng: np.random.Generator) -> Step:
    turn = rng.uniform(-1.0, 1.0) if rng.random() < 0.7 else 0.0
    common = rng.uniform(-1.0, 1.0) if rng.random() < 0.8 else 0.0
    return float(rng.uniform(1.5, 8.0)), float(common), float(turn)


def _child(parents: Sequence[tuple[Step, ...]], bounds: Bounds, rng: np.random.Generator) -> tuple[Step, ...]:
    """A parent with a few changes: of a time, of a level, of the order; a step more or less; a piece of another."""
    steps = list(parents[int(len(parents) * rng.random() ** 2)])
    for _ in range(1 + int(rng.random() < 0.5) + int(rng.random() < 0.25)):
        at, kind = int(rng.integers(len(steps))), rng.random()
        seconds, common, turn = steps[at]
        if kind < 0.3:
            steps[at] = (seconds * float(np.exp(0.4 * rng.standard_normal())), common, turn)
        elif kind < 0.6:
            change = 0.25 * rng.standard_normal(2) * (rng.random(2) < 0.7)
            steps[at] = (seconds, common + float(change[0]), turn + float(change[1]))
        elif kind < 0.75 and len(steps) > 1:
            del steps[at]
        elif kind < 0.83:
            steps.insert(at, _step(rng))
        elif kind < 0.88:
            steps[at] = (seconds, common, -turn) if rng.random() < 0.5 else (seconds, -common, turn)
        elif kind < 0.94:
            other = parents[int(rng.integers(len(parents)))]
            steps = [*steps[: at + 1], *other[int(rng.integers(len(other))) :]]
        else:
            share = float(rng.uniform(0.6, 0.95))
            steps = [(share * s, c, t) for s, c, t in steps]
    return _kept(steps, bounds)


def _kept(steps: Sequence[Step], bounds: Bounds) -> tuple[Step, ...]:
    """Steps rounded, and within the limits of thrust and time; two alike are one."""
    found: list[Step] = []
    for seconds, common, turn in steps[:_MOST_STEPS]:
        levels = _within(common, turn, bounds.thrust)
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
