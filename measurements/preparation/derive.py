"""What follows from a motion: smoothed velocities, accelerations, and the inputs of a network."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...physics.errors import RequestError
from ...physics.frames import Array
from ...physics.motion import Motion
from ..statistics import zero_phase


def smooth(motion: Motion, cutoff: float, order: int = 4) -> Motion:
    """Low-pass the velocities of a motion by a zero-phase Butterworth filter (forward and backward).

    Position, heading and commands stay as they are. A model's force that is compared with these velocities has to
    go through the same filter.

    Parameters
    ----------
    motion : the motion
    cutoff : -3 dB frequency of one pass [Hz]
    order : of one pass

    Raises
    ------
    RequestError
        when the cutoff is not below half the motion's rate.
    """
    velocity = low_pass(motion.velocity, motion.time_step, cutoff, order)
    return replace(motion, velocity=velocity)


def low_pass(values: Array, step: float, cutoff: float, order: int = 4) -> Array:
    """Zero-phase Butterworth low-pass along the first axis of `values` (n, ...) sampled every `step` [s].

    Raises
    ------
    RequestError
        when the cutoff [Hz] is not below half the rate.
    """
    rate = 1.0 / step
    if not 0.0 < cutoff < rate / 2:
        raise RequestError(
            f"a low-pass at {cutoff:g} Hz needs a rate above {2 * cutoff:g} Hz, got {rate:g} Hz; lower the cutoff."
        )
    # Three periods of the cutoff let the filter settle before the first row.
    padding = min(values.shape[0] - 1, int(np.ceil(3.0 * rate / cutoff)))
    return zero_phase.low_pass(values, step, cutoff, order, padding)


def accelerations(motion: Motion) -> Array:
    """Rates of change of u, v [m/s^2] and r [rad/s^2], (n, 3): central differences, one-sided at both ends."""
    edge = 2 if motion.time.size > 2 else 1
    return np.gradient(motion.velocity, motion.time_step, axis=0, edge_order=edge)


def feature_names(motion: Motion) -> tuple[str, ...]:
    """Name the columns of `features`."""
    return ("u", "v", "r", "cos_psi", "sin_psi", *(f"command_{name}" for name in motion.thrusters))


def features(motion: Motion) -> Array:
    """Inputs of a network, (n, 5 + thrusters): u, v [m/s], r [rad/s], cos psi, sin psi, commands [their unit]."""
    heading = motion.heading
    return np.column_stack((motion.velocity, np.cos(heading), np.sin(heading), motion.commands))


def stacked(motions: Sequence[Motion]) -> Array:
    """Stack the features of several motions, one below the other."""
    return np.concatenate([features(motion) for motion in motions])
