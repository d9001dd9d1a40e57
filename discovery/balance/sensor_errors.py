"""Nuisances of a field log: what its sensors add to the motion, found and taken away before any effect is judged."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...measurements.compass import corrected
from ...measurements.kinematics import compass_shown, gyro_lateness
from ...physics.motion import Motion

STRAIGHT_RUNS = "compass_on_straight_runs"
"""Name of the correction for a compass deviation that straight runs show: of what is fitted on rollouts alone."""


@dataclass(frozen=True, slots=True)
class Nuisances:
    """What sensors add to the motion.

    Attributes
    ----------
    motions : the motions without it
    blind : (3,) True for an axis of which the log shows too little to judge its forces
    notes : the same in words
    """

    motions: tuple[Motion, ...]
    blind: tuple[bool, bool, bool]
    notes: tuple[str, ...]


def nuisances(motions: Sequence[Motion]) -> Nuisances:
    """Find a compass deviation, and correct headings and velocities for it.

    What is left of the sway velocity is then the difference of two large numbers, and no force is learnt from it; nor
    where the runs do not show that the compass is right.
    """
    compass = compass_shown(motions)
    if compass.sound:
        return Nuisances(tuple(motions), (False, False, False), ())
    blind = "no force in sway, and no effect that needs it, is judged"
    if not compass.plain:
        return Nuisances(tuple(motions), (False, True, False), (f"{compass.sentence}; {blind}",))
    note = f"{compass.sentence}; heading and velocities are corrected, and {blind}"
    return Nuisances(tuple(corrected(m, compass) for m in motions), (False, True, False), (note,))


def misalignment(motions: Sequence[Motion]) -> float:
    """How far the channels of motions are out of step with each other [s], 0 where it is no more than rounding.

    Compass and gyro, or what the reader of a log could not tell of its clocks, whichever is more.
    """
    return max([abs(gyro_lateness(motions)), *(motion.out_of_step for motion in motions)])
