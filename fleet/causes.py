"""Causes of changes of a hull: directions in which parameters move, for the watch and for the name of a change."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr
from scipy.stats import chi2

from ..physics.motion import Array
from ..reports.hull_diary import Cause
from .boat_days import LEVEL, BoatDays, Part, part_of

STEP = 0.3
"""Deviation of a change at once, in shares: loads, blades and cleanings are of this size; a guess."""
SLOPE = 0.01
"""Deviation of a slope [shares a day]: a hull that doubles its drag in a season; a guess."""
HEAD_START = 0.9
"""Weight of fouling among all that is watched: its growth is slow, and every factor of two in its weight saves a fifth
of a day; changes at once stand out so far that they do not miss theirs (with 0.9 in the place of 0.6 a payload is found
0.07 logged days later, and a blade no later)."""
ASIDE = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Shares in which the drag in sway and yaw grows beside that ahead: between two of them no more than a twentieth of
what the logs tell is lost."""
LOOSE = 0.05
"""Share of a change by which a parameter that has no part in it may seem to move: models are not exact."""


@dataclass(frozen=True, slots=True, eq=False)
class Ray:
    """One direction that the watch looks along.

    Attributes
    ----------
    cause : whose it is
    direction : (p,) how parameters move, in shares
    slope : True for a change that goes on, False for one at once
    weight : how likely it is thought among all rays; they add up to one
    """

    cause: Cause
    direction: Array
    slope: bool
    weight: float


@dataclass(frozen=True, slots=True, eq=False)
class Story:
    """One cause as a law of what parameters do, for the name of a change.

    Attributes
    ----------
    cause : whose it is
    covariance : (p, p) of the change in shares, or of the slope in shares a day
    main : (p,) what must move for this cause, of the sign that it must have
    either : True where either sign will do
    slope : True for a change that goes on
    thruster : the name of the parameter of the one thruster that it concerns; empty for any other
    """

    cause: Cause
    covariance: Array
    main: Array
    either: bool
    slope: bool
    thruster: str = ""


def rays(parameters: Sequence[str]) -> tuple[Ray, ...]:
    """All directions that are watched, for the parameters that are followed."""
    ahead, aside, thrust, mass = (_marked(parameters, part) for part in _PARTS)
    drag = [ahead + share * aside for share in ASIDE] if aside.any() else [ahead]
    alone = np.eye(len(parameters))
    found: list[tuple[Cause, Array, bool]] = []
    if ahead.any():
        found += [(Cause.FOULING, d, True) for d in drag]
        found += [(Cause.CLEANING, -d, False) for d in drag]
    found += [(Cause.PROPELLER, -one, False) for one in alone[thrust > 0.0]]
    if mass.any():
        loads = [mass + share * (ahead + 0.4 * aside) for share in ((0.0, 0.5) if ahead.any() else (0.0,))]
        found += [(Cause.PAYLOAD, sign * load, False) for load in loads for sign in (1.0, -1.0)]
    if thrust.sum() > 1:
        found += [(Cause.BATTERY, sign * thrust, False) for sign in (1.0, -1.0)]
    found += [(Cause.UNNAMED, s * one, slope) for one in alone for s in (1.0, -1.0) for slope in (False, True)]
    if ahead.any():
        found += [(Cause.UNNAMED, d, False) for d in drag]
    causes = [cause for cause, _, _ in found]
    slow = HEAD_START if Cause.FOULING in causes else 0.0
    others = (1.0 - slow) / max(len(set(causes) - {Cause.FOULING}), 1)
    shares = {cause: slow if cause is Cause.FOULING else others for cause in causes}
    return tuple(Ray(c, d, slope, shares[c] / causes.count(c)) for c, d, slope in found)


def stories(parameters: Sequence[str]) -> tuple[Story, ...]:
    """All laws by which a change is named; that of a change without a name last, which may go anywhere."""
    ahead, aside, thrust, mass = (_marked(parameters, part) for part in _PARTS)
    size = len(parameters)
    # Drags of one hull move together, each with a share of its own.
    both = np.outer(ahead, aside)
    hull = np.outer(ahead, ahead) + 0.25 * np.outer(aside, aside) + 0.5 * (both + both.T)
    hull = hull + np.diag(0.25 * ahead + 0.25 * aside)
    loose = LOOSE**2 * np.eye(size)

    def at_once(cause: Cause, shape: Array, main: Array, *, either: bool = False, thruster: str = "") -> Story:
        return Story(cause, STEP**2 * (shape + loose), main, either, False, thruster)

    found = []
    if ahead.any():
        found.append(Story(Cause.FOULING, SLOPE**2 * (hull + loose), ahead / ahead.sum(), False, True))
        found.append(at_once(Cause.CLEANING, hull, -ahead / ahead.sum()))
        found.append(at_once(Cause.UNNAMED, hull, ahead / ahead.sum()))
    for k in np.flatnonzero(thrust):
        one = np.eye(size)[k]
        found.append(at_once(Cause.PROPELLER, np.outer(one, one), -one, thruster=parameters[int(k)]))
    if mass.any():
        load = mass + 0.5 * ahead + 0.2 * aside
        spread = np.outer(load, load) + np.diag(0.1 * ahead + 0.05 * aside)
        found.append(at_once(Cause.PAYLOAD, spread, mass, either=True))
    if thrust.sum() > 1:
        found.append(at_once(Cause.BATTERY, np.outer(thrust, thrust), thrust / thrust.sum(), either=True))
    for slope, size_of in ((False, STEP), (True, SLOPE)):
        found.append(Story(Cause.UNNAMED, size_of**2 * np.eye(size), np.zeros(size), True, slope))
    return tuple(found)


_PARTS = (Part.DRAG_AHEAD, Part.DRAG_ASIDE, Part.THRUST, Part.MASS)


def _marked(parameters: Sequence[str], part: Part) -> Array:
    """One for each parameter of a part, (p,)."""
    return np.array([float(part_of(name) is part) for name in parameters])


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
class _StoryFit:
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
    tellings = [_tell(s, sums[s.slope], gap[:last]) for s in stories]
    limit = float(chi2.isf(MISFIT, values.shape[1]))
    named = [t for t in tellings if t.story.cause is not Cause.UNNAMED and t.misfit <= limit and t.place >= SURE]
    others = [t for t in tellings if t.story.cause is Cause.UNNAMED]
    most = max(t.total for t in [*named, *others])
    alike = [t for t in named if t.total > most - ALIKE] + [t for t in others if t.total > most - NAMELESS]
    told = sorted(alike, key=lambda t: -t.total)
    best = told[0]
    weight = np.exp(best.evidence - best.total)
    row = int(np.argmax(weight))
    information, score = (part[row] for part in sums[best.story.slope])
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
    drive = square = since(inverse)
    product = since(weighed)
    if slope:
        time, at = days[:, None, None], days[:-1, None, None]
        first, second = since(inverse * time), since(inverse * time**2)
        drive, square = first - at * drive, second - 2.0 * at * first + at**2 * drive
        product = since(weighed * days[:, None]) - days[:-1, None] * product
    return square - drive @ level @ drive, product - drive @ level @ all_seen


def _tell(story: Story, sums: tuple[Array, Array], gap: Array) -> _StoryFit:
    """Weigh a story by the marginal likelihood of a normal change, of the sign that it must have.

    Parameters
    ----------
    sums : information and score of the size of a change from each day but the first on
    gap : (n,) logarithm of the time before each of the first of these days, which alone are weighed
    """
    information, score = (part[: gap.size] for part in sums)
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
    moved = abs(place[row]) if story.either else place[row]
    return _StoryFit(story, evidence, float(whole - gained[row]), float(moved))
