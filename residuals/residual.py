"""The residual: the force that the motion shows minus the force that the vehicle model explains."""

from dataclasses import dataclass

import numpy as np

from ..measurements.preparation.dataset import DataSet
from ..measurements.preparation.derive import accelerations, low_pass
from ..physics.forces import modelled_acceleration
from ..physics.frames import Array
from ..physics.matrices import mass_matrix
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class Residual:
    """Measured and modelled acceleration of one motion, filtered alike, and the force between them.

    Attributes
    ----------
    motion : the filtered motion
    measured, modelled : (n, 3) [m/s^2, m/s^2, rad/s^2]
    force : (n, 3) M (measured - modelled) [N, N, N m]
    """

    motion: Motion
    measured: Array
    modelled: Array
    force: Array


def residual(vehicle: Vehicle, motion: Motion, data: DataSet) -> Residual:
    """The residual of one motion of a data set.

    The measured acceleration is the central difference of the filtered velocity; the modelled one is evaluated along
    the filtered motion and passes through the same filter.
    """
    measured = accelerations(motion)
    modelled = same_filter(modelled_acceleration(vehicle, motion), motion, data)
    return Residual(motion, measured, modelled, (measured - modelled) @ mass_matrix(vehicle))


def same_filter(values: Array, motion: Motion, data: DataSet) -> Array:
    """Pass a model's output through the filter that the measured velocities went through."""
    if data.recipe.cutoff is None:
        return np.asarray(values, dtype=float)
    return low_pass(values, motion.time_step, data.recipe.cutoff, data.recipe.order)
