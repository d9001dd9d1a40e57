"""Where a model knows its way: the speeds and thrusts that were seen when it was fitted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from .base import Model
from .network_inputs import network_inputs

FAR = 1.5
"""Half a range beyond what a network counts as seen (two standard deviations) lies what it has hardly ever met."""


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


def known_to(model: Model) -> Domain | None:
    """The box that a model was trained in, `FAR` times as wide as its `seen`; None where it does not tell."""
    if model.seen is None:
        return None
    size = 3 + len(model.vehicle.thrusters)
    low, high = (ends[:size] for ends in model.seen)
    middle, half = 0.5 * (low + high), 0.5 * FAR * (high - low)
    return Domain(model.vehicle, middle - half, middle + half)


def _states(vehicle: Vehicle, motions: Sequence[Motion]) -> Array:
    return np.concatenate([network_inputs(vehicle, motion, heading=False) for motion in motions])
