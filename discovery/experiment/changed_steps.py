"""Manoeuvres of a few steps, drawn and changed at random, within the limits of whoever drives them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import inf

import numpy as np

from ...physics.worlds.trials import TRIALS, Step

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

    def told(self, limit: Limit) -> str:
        """One of them with its number."""
        numbers = {
            Limit.SPEED: f"{self.speed:g} m/s",
            Limit.SPACE: f"{self.space:g} m",
            Limit.THRUST: f"{100.0 * self.thrust:.0f} % thrust",
            Limit.SECONDS: f"{self.seconds:g} s",
        }
        return numbers[limit]


def first_manoeuvres(count: int, bounds: Bounds, rng: np.random.Generator) -> list[Steps]:
    """The library's manoeuvres and random ones."""
    library = [kept(trial.steps[:_MOST_STEPS], bounds) for trial in TRIALS]
    return library + [kept(_random(rng), bounds) for _ in range(count - len(library))]


def _random(rng: np.random.Generator) -> list[Step]:
    return [_step(rng) for _ in range(int(rng.integers(2, 7)))]


def _step(rng: np.random.Generator) -> Step:
    turn = rng.uniform(-1.0, 1.0) if rng.random() < 0.7 else 0.0
    common = rng.uniform(-1.0, 1.0) if rng.random() < 0.8 else 0.0
    return float(rng.uniform(1.5, 8.0)), float(common), float(turn)


def changed(parents: Sequence[Steps], bounds: Bounds, rng: np.random.Generator) -> Steps:
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
    return kept(steps, bounds)


def shorter(steps: Steps, bounds: Bounds) -> list[Steps]:
    """The same with a step shorter or left out, or all of them shorter."""
    found = [kept([(share * s, c, t) for s, c, t in steps], bounds) for share in (0.8, 0.9, 0.95)]
    for at, (seconds, common, turn) in enumerate(steps):
        for less in (0.5, 1.0, 2.0, seconds):
            left = [(seconds - less, common, turn)] if seconds - less >= _SHORTEST else []
            found.append(kept([*steps[:at], *left, *steps[at + 1 :]], bounds))
    return found


def kept(steps: Sequence[Step], bounds: Bounds) -> Steps:
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
