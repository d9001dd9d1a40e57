"""What happens to hulls, as directions in which their parameters move: for the watch and for the name of a change."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..physics.frames import Array
from ..reports.diary_facts import Cause
from .boat_days import Part, part_of

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
    found: list[tuple[Cause, Array, bool]] = []
    if ahead.any():
        found += [(Cause.FOULING, d, True) for d in drag]
        found += [(Cause.CLEANING, -d, False) for d in drag]
    each = [np.eye(len(parameters))[k] for k in np.flatnonzero(thrust)]
    found += [(Cause.PROPELLER, -one, False) for one in each]
    if mass.any():
        loads = [mass + share * (ahead + 0.4 * aside) for share in ((0.0, 0.5) if ahead.any() else (0.0,))]
        found += [(Cause.PAYLOAD, sign * load, False) for load in loads for sign in (1.0, -1.0)]
    if len(each) > 1:
        found += [(Cause.BATTERY, sign * thrust, False) for sign in (1.0, -1.0)]
    for k in range(len(parameters)):
        for sign in (1.0, -1.0):
            found += [(Cause.UNNAMED, sign * np.eye(len(parameters))[k], slope) for slope in (False, True)]
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
    hull = (
        np.outer(ahead, ahead) + 0.25 * np.outer(aside, aside) + 0.5 * (np.outer(ahead, aside) + np.outer(aside, ahead))
    )
    hull = hull + np.diag(0.25 * ahead + 0.25 * aside)
    loose = LOOSE**2 * np.eye(size)
    found = []
    if ahead.any():
        found.append(Story(Cause.FOULING, SLOPE**2 * (hull + loose), ahead / ahead.sum(), False, True))
        found.append(Story(Cause.CLEANING, STEP**2 * (hull + loose), -ahead / ahead.sum(), False, False))
        found.append(Story(Cause.UNNAMED, STEP**2 * (hull + loose), ahead / ahead.sum(), False, False))
    for k in np.flatnonzero(thrust):
        one = np.eye(size)[k]
        law = STEP**2 * (np.outer(one, one) + loose)
        found.append(Story(Cause.PROPELLER, law, -one, False, False, parameters[int(k)]))
    if mass.any():
        load = mass + 0.5 * ahead + 0.2 * aside
        law = STEP**2 * (np.outer(load, load) + np.diag(0.1 * ahead + 0.05 * aside) + loose)
        found.append(Story(Cause.PAYLOAD, law, mass, True, False))
    if thrust.sum() > 1:
        law = STEP**2 * (np.outer(thrust, thrust) + loose)
        found.append(Story(Cause.BATTERY, law, thrust / thrust.sum(), True, False))
    for slope, size_of in ((False, STEP), (True, SLOPE)):
        found.append(Story(Cause.UNNAMED, size_of**2 * np.eye(size), np.zeros(size), True, slope))
    return tuple(found)


_PARTS = (Part.DRAG_AHEAD, Part.DRAG_ASIDE, Part.THRUST, Part.MASS)


def _marked(parameters: Sequence[str], part: Part) -> Array:
    """One for each parameter of a part, (p,)."""
    return np.array([float(part_of(name) is part) for name in parameters])
