"""What a change of a hull was: each cause as a law of what parameters do, weighed by all days about the change."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr
from scipy.stats import chi2

from ..physics.frames import Array
from ..reports.diary_facts import Cause
from .boat_days import BoatDays
from .causes import Story
from .pooling import LEVEL

SURE = 3.0
"""Deviations by which the main parameter of a cause must have moved for its name to be used."""
MISFIT = 1e-3
"""Chance of so bad a fit of a cause, were it the true one, below which its name is not used."""
ALIKE, NAMELESS = float(np.log(1000.0)), float(np.log(20.0))
"""Causes whose evidence differs by less than a thousand times explain a change alike, and are told together: what one
law has more freedom than another is worth about as much. A change without a name, which may be any, is told beside
them where its evidence differs by less than twenty times."""


@dataclass(frozen=True, slots=True, eq=False)
class HullChange:
    """One change of one boat.

    Attributes
    ----------
    alarm : index of the day after whose logs it was known
    first : index of the day that most likely was the first with the change
    between : the first and the last index that may be that day, at 95 %
    causes : what explains it; several where they explain it alike, `UNNAMED` where none does
    thrusters : parameters of the thrusters that the causes concern
    slope : True where it goes on from day to day
    days : how long it went on until the next change or the last log [days]; of a change at once 0
    change, deviation : (p,) of each parameter in that time, in shares
    """

    alarm: int
    first: int
    between: tuple[int, int]
    causes: tuple[Cause, ...]
    thrusters: tuple[str, ...]
    slope: bool
    days: float
    change: Array
    deviation: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Told:
    """How well a story explains the days: evidence of each first day (n - 1,), and the fit at the best of them."""

    story: Story
    evidence: Array
    misfit: float
    place: float

    @property
    def total(self) -> float:
        return float(np.logaddexp.reduce(self.evidence))


def changes(
    boat: BoatDays, scatter: Array, known: Sequence[int], stories: Sequence[Story], odd: Sequence[int] = ()
) -> tuple[HullChange, ...]:
    """The changes behind the alarms of a boat, in order of time.

    Alarms that follow each other because one slope goes on are one change.

    Parameters
    ----------
    scatter : (p, p) of its days
    known : index of the day of each alarm
    odd : days that say nothing
    """
    inverse = np.linalg.inv(boat.covariance + scatter).astype(float)
    inverse[list(odd)] = 0.0
    found: list[HullChange] = []
    begun: list[int] = []
    for start, alarm, end in zip([0, *known], known, [*known[1:], boat.time.size], strict=False):
        one = _named(boat, inverse, (start, alarm, end), stories)
        goes_on = one.causes == (Cause.UNNAMED,) or Cause.FOULING in one.causes
        if found and goes_on and Cause.FOULING in found[-1].causes:
            longer = _named(boat, inverse, (begun[-1], found[-1].alarm, end), stories)
            if Cause.FOULING in longer.causes:
                found[-1] = longer
                continue
        found.append(one)
        begun.append(start)
    return tuple(found)


def _named(boat: BoatDays, inverse: Array, span: tuple[int, int, int], stories: Sequence[Story]) -> HullChange:
    start, alarm, end = span
    days, values, inverse = boat.days[start:end], boat.values[start:end], inverse[start:end]
    gap = np.log(np.diff(days))
    last = alarm - start  # nothing that began after the alarm raised it
    sums = {slope: _sums(days, values, inverse, slope=slope) for slope in (False, True)}
    tellings = [_tell(s, sums[s.slope][0][:last], sums[s.slope][1][:last], gap[:last]) for s in stories]
    limit = float(chi2.isf(MISFIT, values.shape[1]))
    named = [t for t in tellings if t.story.cause is not Cause.UNNAMED and t.misfit <= limit and t.place >= SURE]
    others = [t for t in tellings if t.story.cause is Cause.UNNAMED]
    most = max(t.total for t in [*named, *others])
    alike = [t for t in named if t.total > most - ALIKE] + [t for t in others if t.total > most - NAMELESS]
    told = sorted(alike, key=lambda t: -t.total)
    best = told[0]
    weight = np.exp(best.evidence - best.total)
    row = int(np.argmax(weight))
    information, score = sums[best.story.slope][0][row], sums[best.story.slope][1][row]
    covariance = np.linalg.inv(information + 1e-9 * np.eye(score.size))
    lasted = float(days[-1] - days[row]) if best.story.slope else 0.0
    size = lasted if best.story.slope else 1.0
    tail = 0.5 * (1.0 - LEVEL)
    ends = np.searchsorted(np.cumsum(weight), (tail, 1.0 - tail))
    first = start + 1 + row
    return HullChange(
        alarm,
        first,
        (min(first, start + 1 + int(ends[0])), max(first, start + 1 + min(int(ends[1]), last - 1))),
        tuple(dict.fromkeys(t.story.cause for t in told)),
        tuple(t.story.thruster for t in told if t.story.thruster),
        best.story.slope,
        lasted,
        covariance @ score * size,
        np.sqrt(np.diag(covariance)) * size,
    )


def _sums(days: Array, values: Array, inverse: Array, *, slope: bool) -> tuple[Array, Array]:
    """Information on the size of a change from each day but the first on, and its score (n - 1, p, p), (n - 1, p)."""
    weighed = np.einsum("npq,nq->np", inverse, values - values[0])

    def since(of: Array) -> Array:
        return np.cumsum(of[::-1], axis=0)[::-1][1:]

    every, all_seen = inverse.sum(axis=0), weighed.sum(axis=0)
    level = np.linalg.inv(every)
    flat, seen = since(inverse), since(weighed)
    if not slope:
        return flat - flat @ level @ flat, seen - flat @ level @ all_seen
    begins = days[:-1]
    time = days[:, None]
    first, product = since(inverse * time[..., None]), since(weighed * time)
    second = since(inverse * time[..., None] ** 2)
    at = begins[:, None, None]
    drive = first - at * flat
    square = second - 2.0 * at * first + at**2 * flat
    return square - drive @ level @ drive, product - begins[:, None] * seen - drive @ level @ all_seen


def _tell(story: Story, information: Array, score: Array, gap: Array) -> _Told:
    """Weigh a story by the marginal likelihood of a normal change, of the sign that it must have."""
    root = np.linalg.cholesky(story.covariance)
    inner = np.eye(root.shape[0]) + root.T @ information @ root
    inside = np.linalg.inv(inner)
    seen = score @ root
    gained = np.einsum("np,npq,nq->n", seen, inside, seen)
    evidence = 0.5 * gained - 0.5 * np.linalg.slogdet(inner)[1] + gap
    towards = story.main @ root
    mean = np.einsum("p,npq,nq->n", towards, inside, seen)
    deviation = np.sqrt(np.einsum("p,npq,q->n", towards, inside, towards))
    place = np.divide(mean, deviation, out=np.zeros_like(mean), where=deviation > 0.0)
    if not story.either:
        evidence = evidence + np.log(2.0) + log_ndtr(place)
    row = int(np.argmax(evidence))
    ridge = 1e-9 * np.eye(root.shape[0])
    whole = score[row] @ np.linalg.solve(information[row] + ridge, score[row])
    return _Told(story, evidence, float(whole - gained[row]), float(abs(place[row]) if story.either else place[row]))
