"""Inputs of a network: the paper's s = [u, v, r, T_1 ... T_n], and the heading where it is asked for."""

from collections.abc import Sequence

import numpy as np

from ...physics.forces import Triple, actuation, relative_velocity
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle


def input_names(vehicle: Vehicle, heading: bool) -> tuple[str, ...]:
    """Name the columns of `network_inputs`."""
    thrusts = tuple(f"thrust_{thruster.name}" for thruster in vehicle.thrusters)
    return ("u", "v", "r", *thrusts, *(("cos_psi", "sin_psi") if heading else ()))


def network_inputs(vehicle: Vehicle, motion: Motion, heading: bool) -> Array:
    """Inputs along a motion, (n, 3 + thrusters [+ 2]).

    u, v [m/s] and r [rad/s] relative to the vehicle's water, the thrust of each thruster at rest [N] by the vehicle's
    curve, and cos psi and sin psi if `heading`.

    Parameters
    ----------
    vehicle : whose water and thrusters count
    motion : measured or simulated
    heading : whether the network sees it
    """
    return stacked_inputs(vehicle, motion.heading, tuple(motion.velocity.T), actuation(vehicle, motion).thrust, heading)


def in_box(vehicle: Vehicle, known: Sequence[Motion], asked: Sequence[Motion]) -> np.ndarray:
    """Mask of the rows of some motions that lie in the box of speeds and thrusts that others span.

    Parameters
    ----------
    vehicle : whose water and thrusters count
    known : motions that span the box
    asked : motions in question
    """
    box, seen = (np.concatenate([network_inputs(vehicle, m, heading=False) for m in some]) for some in (known, asked))
    return np.all((seen >= box.min(axis=0)) & (seen <= box.max(axis=0)), axis=1)


def stacked_inputs(vehicle: Vehicle, psi: Array, velocity: Triple, thrust: Array, heading: bool) -> Array:
    """Inputs at any states, (*shape, 3 + thrusters [+ 2]), for a measured motion and a simulated one alike.

    Parameters
    ----------
    psi : any shape [rad]
    velocity : over ground, three arrays of that shape [m/s, m/s, rad/s]
    thrust : (thrusters, *shape) at rest [N]
    """
    columns = [*relative_velocity(vehicle, psi, velocity), *thrust]
    if heading:
        columns += [np.cos(psi), np.sin(psi)]
    return np.stack(columns, axis=-1)
