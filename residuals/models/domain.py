"""Where a model knows its way: the speeds and thrusts that some motions span, and how far others lie beyond."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from .network_inputs import network_inputs


@dataclass(frozen=True, slots=True, eq=False)
class Domain:
    """A box of velocities relative to the water and of thrusts.

    Attributes
    ----------
    vehicle : by whose water and thrusters
    lower, upper : ends of u, v [m/s], r [rad/s] and the thrust of each thruster [N]
    """

    vehicle: Vehicle
    lower: Array
    upper: Array

    def inside(self, motions: Sequence[Motion]) -> np.ndarray:
        """True for each row of the motions that lies in the box."""
        seen = _states(self.vehicle, motions)
        return np.all((seen >= self.lower) & (seen <= self.upper), axis=1)


def spanned(vehicle: Vehicle, motions: Sequence[Motion]) -> Domain:
    """The box that some motions span."""
    seen = _states(vehicle, motions)
    return Domain(vehicle, seen.min(axis=0), seen.max(axis=0))


def excess(seen: Array, lower: Array, upper: Array) -> Array:
    """How far rows (n, inputs) lie beyond a box that reaches two standard deviations to each side, (n,) [deviations].

    Parameters
    ----------
    lower, upper : ends of the box (inputs or more,)
    """
    low, high = lower[: seen.shape[1]], upper[: seen.shape[1]]
    over = np.maximum(np.maximum(low - seen, seen - high), 0.0) / (0.25 * (high - low))
    return np.sqrt((over**2).sum(axis=1))


def _states(vehicle: Vehicle, motions: Sequence[Motion]) -> Array:
    return np.concatenate([network_inputs(vehicle, motion, heading=False) for motion in motions])
