"""Nuisances of a field log: what its sensors add to the motion, found and taken away before any effect is judged."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...measurements.alignment import align
from ...measurements.compass import compass_of, corrected
from ...physics.effects import Parameter
from ...physics.motion import Motion
from ..candidates.linearisation import Candidate
from ..evidence.weighing import Evidence

_LONG_ENOUGH = 20.0
_OUT_OF_STEP = 0.5
"""Share of a time step from which an offset between two records is more than rounding."""
_CLEARLY = 2.0
"""Times the misalignment that a lag or a delay must exceed to be believed."""
_TIMES = ("lag", "delay")
_NEEDS_SWAY = ("X_udot", "Y_vdot", "x_g")


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
    compass = compass_of(motions)
    if compass.sound:
        return Nuisances(tuple(motions), (False, False, False), ())
    blind = "no force in sway, and no effect that needs it, is judged"
    if not compass.plain:
        return Nuisances(tuple(motions), (False, True, False), (f"{compass.sentence}; {blind}",))
    note = f"{compass.sentence}; heading and velocities are corrected, and {blind}"
    return Nuisances(tuple(corrected(m, compass) for m in motions), (False, True, False), (note,))


def misalignment(motions: Sequence[Motion]) -> float:
    """How far the channels of motions are out of step with each other [s], 0 where it is no more than rounding.

    The median offset between compass and gyro over the motions of at least 20 s that turn enough to tell, or what the
    reader of a log could not tell of its clocks, whichever is more.
    """
    offsets = []
    for motion in motions:
        if motion.duration >= _LONG_ENOUGH:
            turning = np.gradient(motion.heading, motion.time_step), motion.velocity[:, 2]
            offset = align("the compass", "the gyro", turning, motion.time_step).offset
            if offset is not None:
                offsets.append(abs(offset) if abs(offset) > _OUT_OF_STEP * motion.time_step else 0.0)
    unknown = max((motion.out_of_step for motion in motions), default=0.0)
    return max(float(np.median(offsets)) if offsets else 0.0, unknown)


def believed(e: Evidence, late: float, candidate: Candidate, values: Sequence[float]) -> Evidence:
    """Evidence for a lag or a delay, doubted when it is not clearly larger than the log's own misalignment.

    Parameters
    ----------
    late : misalignment of the channels [s]
    values : of the candidate's parameters
    """
    times = [v for p, v in zip(candidate.parameters, values, strict=True) if p.symbol in _TIMES]
    if e.selected and late > 0.0 and times and max(times) <= _CLEARLY * late:
        return replace(e, out_of_step=late)
    return e


def part_by_sight(pool: Sequence[Candidate], blind: Sequence[bool]) -> tuple[list[Candidate], list[Candidate]]:
    """Candidates that a log with blind axes can judge, and those that it cannot.

    An effect goes when it acts on a blind axis, or in proportion to the velocity along it; wake memory keeps its yaw.
    Added mass in surge goes too: but for Munk's moment and the Coriolis force, which need the sway velocity, it is a
    scale of thrust and drag.
    """
    if not any(blind):
        return list(pool), []
    seen, unseen = [], []
    for candidate in pool:
        kept = tuple(p for p in candidate.parameters if not _blinded(p))
        if len(kept) == len(candidate.parameters):
            seen.append(candidate)
        elif any(not p.grid for p in kept) and candidate.effect.family == "memory":
            seen.append(replace(candidate, effect=replace(candidate.effect, parameters=kept), parameters=kept))
        else:
            unseen.append(candidate)
    return seen, unseen


def _blinded(parameter: Parameter) -> bool:
    """True for a parameter that acts in sway, multiplies the sway velocity, or is told apart by such a force only."""
    if parameter.symbol in (*_NEEDS_SWAY, "memory_sway"):
        return True
    return parameter.axis == 1 or "v" in parameter.form
