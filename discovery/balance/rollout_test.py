"""The second judge: an effect must not make open-loop rollouts worse, whatever the force balance says of it."""

from collections.abc import Sequence

import numpy as np

from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.simulation import rollout
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
"""Relative rise of the mean square rollout error from which an effect is doubted, if it is also significant."""
SIGNIFICANT = 2.5
"""Standard errors by which the rise must exceed zero."""


def rollout_squares(motions: Sequence[Motion], vehicle: Vehicle, horizon: float = HORIZON) -> Array:
    """Mean square velocity errors of `horizon` [s] open-loop rollouts from measured starts every 2.5 s, (starts, 3)."""
    squares = [np.zeros((0, 3))]
    for motion in motions:
        steps = round(horizon / motion.time_step)
        starts = np.arange(0, motion.time.size - steps, max(1, round(SPACING / motion.time_step)))
        if starts.size:
            states = rollout(vehicle, motion, starts, steps).states[:, 1:, 3:]
            window = starts[:, None] + np.arange(1, steps + 1)
            squares.append(((states - motion.velocity[window]) ** 2).mean(axis=1))
    return np.concatenate(squares)


def rollouts_object(without: Array, within: Array) -> bool:
    """True when rollouts with an effect are worse than without it, materially and significantly.

    Each start's squared errors are divided by the mean over all starts and both models, axis by axis, and summed.

    Parameters
    ----------
    without, within : (starts, 3) from `rollout_squares`
    """
    if without.shape[0] < 8:
        return False
    scale = np.maximum(0.5 * (without + within).mean(axis=0), 1e-12)
    rise = ((within - without) / scale).mean(axis=1)
    error = rise.std(ddof=1) / np.sqrt(rise.size)
    return bool(rise.mean() > WORSE and rise.mean() > SIGNIFICANT * error)


def rollouts_part(motions: Sequence[Motion], one: Vehicle, other: Vehicle, horizon: float = WHOLE_HORIZON) -> Array:
    """How far two models part along a log, (3,): rms difference of their rollouts, as a share of the rms motion.

    Rollouts of `horizon` [s] from common measured starts; zeros when no motion is long enough.
    """
    gap, size = np.zeros(3), np.full(3, 1e-12)
    for motion in motions:
        steps = round(horizon / motion.time_step)
        starts = np.arange(0, motion.time.size - steps, max(1, round(_PARTING / motion.time_step)))
        if starts.size:
            a, b = (rollout(vehicle, motion, starts, steps).states[:, :, 3:] for vehicle in (one, other))
            gap += ((a - b) ** 2).sum(axis=(0, 1))
            size += (a**2).sum(axis=(0, 1))
    return np.sqrt(gap / size)
