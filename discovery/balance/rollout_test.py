"""Open-loop rollouts of two models held against each other: by how much one errs more, and how sure that is."""

from collections.abc import Sequence
from math import ceil

import numpy as np

from ...measurements.statistics.blocks import Difference, paired_ratio
from ...physics.integration import Legs, rollouts
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle

HORIZON = 5.0
"""Length of a rollout [s]: long enough to accumulate a wrong force, short enough to forget a noisy start."""
WHOLE_HORIZON = 10.0
"""Length of the rollouts [s] by which a corrected model as a whole must not be worse than the nominal one."""
SPACING = 2.5
"""Distance between starts [s]."""
_PARTING = 10.0
"""Distance between starts [s] where two models are only held against each other."""
WORSE = 0.03
"""Rise of the logarithm of the mean square rollout error from which a model is called worse, if it is also sure."""
FEWEST = 8
"""Rollouts below which nothing is said: as few as a log that is judged by rollouts has."""
_NO_ERROR = 1e-12
"""Mean square error [m^2/s^2, rad^2/s^2] that is none: rollouts of an axis that does not move differ by rounding."""


def rollout_squares(motions: Sequence[Motion], vehicle: Vehicle, horizon: float = HORIZON) -> Array:
    """Mean square velocity errors of `horizon` [s] open-loop rollouts from measured starts every 2.5 s, (starts, 3)."""
    asked = _every(motions, horizon, SPACING)
    squares = [np.zeros((0, 3))]
    for legs, rolled in zip(asked, rollouts([(vehicle, legs) for legs in asked], placed=False), strict=True):
        window = legs.starts[:, None] + np.arange(1, legs.steps + 1)
        squares.append(((rolled.states[:, 1:, 1:] - legs.motion.velocity[window]) ** 2).mean(axis=1))
    return np.concatenate(squares)


def _every(motions: Sequence[Motion], horizon: float, spacing: float) -> list[Legs]:
    """Rollouts of `horizon` [s] from measured starts every `spacing` [s]; of motions long enough for one."""
    found = []
    for motion in motions:
        steps = round(horizon / motion.time_step)
        starts = np.arange(0, motion.time.size - steps, max(1, round(spacing / motion.time_step)))
        found += [Legs(motion, starts, steps)] if starts.size else []
    return found


def overlap_of(horizon: float, spacing: float = SPACING) -> int:
    """How many rollouts of `horizon` [s] from starts every `spacing` [s] run at any time, and are not independent."""
    return max(1, ceil(horizon / spacing))


def rise_of(without: Array, within: Array, overlap: int) -> Difference:
    """How much larger the rollout errors of one model are than another's, paired over blocks of time.

    Parameters
    ----------
    without, within : (starts, 3) squared errors in the order of time, as from `rollout_squares`
    overlap : see `overlap_of`

    Returns
    -------
    Difference
        `difference` is the mean over the axes of the logarithm of the ratio of root mean square errors.
    """
    return paired_ratio(within + _NO_ERROR, without + _NO_ERROR, overlap, FEWEST)


def rollouts_object(without: Array, within: Array, overlap: int) -> bool:
    """True when rollouts with an effect are worse than without it, materially and surely (95 %); see `rise_of`."""
    if without.shape[0] < FEWEST:
        return False
    rise = rise_of(without, within, overlap)
    return rise.ci95 is not None and rise.ci95[0] > 0.0 and 2.0 * rise.difference > WORSE


def worse_as_a_whole(motions: Sequence[Motion], without: Vehicle, within: Vehicle) -> bool:
    """True when 10 s open-loop rollouts of one model are surely worse than another's: fits can wreck predictions."""
    before, after = (rollout_squares(motions, vehicle, WHOLE_HORIZON) for vehicle in (without, within))
    return rollouts_object(before, after, overlap_of(WHOLE_HORIZON))


def rollouts_part(motions: Sequence[Motion], one: Vehicle, other: Vehicle, horizon: float = WHOLE_HORIZON) -> Array:
    """How far two models part along a log, (3,): rms difference of their rollouts, as a share of the rms motion.

    Rollouts of `horizon` [s] from common measured starts; zeros when no motion is long enough.
    """
    gap, size = np.zeros(3), np.full(3, 1e-12)
    asked = _every(motions, horizon, _PARTING)
    rolled = rollouts([(vehicle, legs) for vehicle in (one, other) for legs in asked], placed=False)
    states = [each.states[:, :, 1:] for each in rolled]
    for a, b in zip(states[: len(asked)], states[len(asked) :], strict=True):
        gap += ((a - b) ** 2).sum(axis=(0, 1))
        size += (a**2).sum(axis=(0, 1))
    return np.sqrt(gap / size)
