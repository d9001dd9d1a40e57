"""The energy balance of a hull as inequalities between powers, for arrays and tensors alike.

Kinetic energy changes by nu^T M nu_dot, to which Coriolis forces add nothing (Fossen 2021, property 6.3). Without
thrust that power is never above zero; with thrust it is at most what the thrusters put in. Each law stands here once,
with its one tolerance, for the loss and the judge of a training and for the audit of any model.
"""

from typing import Any

import numpy as np

from ..forces import actuation, held_thrust, through_water
from ..momentum_balance import mass_matrix, thruster_matrix
from ..motion import Array, Motion
from ..thrusters import command_of
from ..vehicle import Vehicle
from .damping_power import Envelope

MARGIN = 1.5
"""Thrusters may put in this multiple of what the vehicle file says: nominal thrust is seldom known better."""
ASKEW = 0.1
"""Side force of a thruster that is counted with even where the file has none [N/N]: 6 degrees of its mounting."""
TOLERANCE = 0.01
"""Share of full thrust (elsewhere of a typical power) that a learnt model is let pass: it is never exactly zero."""
INSIDE = 0.5
"""Share of the tolerance that training aims at, so that what lies between the states that it asks stays lawful."""
EXCESS_UNIT = 10.0 * TOLERANCE
"""Share of full thrust in which an excess is counted in a loss: about the correction that a network learns."""
CRAWL = 1e-3
"""Speed at whose power what is let pass starts [m/s]: at rest itself there is none to compare with."""


def coasting_power(mass: Any, velocity: Any, acceleration: Any) -> Any:
    """Power nu^T M nu_dot [W] that goes into the motion, (...); of a hull without thrust, never above zero.

    Parameters
    ----------
    mass : (3, 3) mass matrix [kg, kg m, kg m^2]
    velocity : (..., 3) relative to the water [m/s, m/s, rad/s]
    acceleration : (..., 3) [m/s^2, m/s^2, rad/s^2]
    """
    return ((velocity @ mass) * acceleration).sum(-1)


def surplus(power: Any, driven: Any = 0.0, margin: float = MARGIN) -> Any:
    """Power [W] above max(0, margin * driven), 0 where the law is kept.

    Parameters
    ----------
    power : nu^T M nu_dot [W]
    driven : power nu^T tau [W] of the thrusters by the vehicle file; 0 for a hull that coasts
    margin : multiple of `driven` that is allowed
    """
    return _positive(power - _positive(margin * driven))


def full_force(vehicle: Vehicle) -> Array:
    """Force of full thrust on each axis (3,) [N, N, N m]; at least surge's, at the radius of gyration in yaw."""
    ends = [[command_of(t, np.array(side)) for t in vehicle.thrusters] for side in (-1.0, 1.0)]
    most = np.abs(held_thrust(vehicle, np.array(ends, dtype=float))[0]).max(axis=1)
    force, mass = np.abs(thruster_matrix(vehicle)) @ most, mass_matrix(vehicle)
    least = max(float(force.max() if force[0] <= 0.0 else force[0]), 1e-9)
    return np.maximum(force, least * np.array([1.0, 1.0, np.sqrt(abs(mass[2, 2] / mass[0, 0]))]))


def full_power(full: Any, velocity: Any) -> Any:
    """Power of full thrust `full` (3,) along all axes at velocities (..., 3) [W], at least that at `CRAWL`."""
    return abs(velocity) @ full + CRAWL * full[0]


def let_pass(full: Any, velocity: Any) -> Any:
    """Gain [W] without thrust that is no violation: the power of `TOLERANCE` of full thrust, (...).

    That is the force which `rest stays at rest` lets pass. It depends on the state and on the thrusters alone.
    """
    return TOLERANCE * full_power(full, velocity)


def most_driven(reach: Any, velocity: Any, thrust: Any, margin: float = MARGIN) -> Any:
    """Most power [W] that thrusters of a learnt model may put in, (...); where they brake that may be below zero.

    Each may push `margin` times as hard, on every axis as the strongest one does there, and be mounted askew.

    Parameters
    ----------
    reach : (3, thrusters) thruster matrix
    velocity : (..., 3) relative to the water
    thrust : (..., thrusters) by the vehicle file [N]
    """
    driven = (velocity * (thrust @ reach.T)).sum(-1)
    surge, sway, yaw = (float(abs(row).max()) for row in reach)
    u, v, r = (abs(velocity[..., k]) for k in range(3))
    spread = max(surge, 1.0) * u + max(sway, ASKEW) * v + yaw * r
    return driven + (margin - 1.0) * spread * abs(thrust).sum(-1)


def allowed_power(vehicle: Vehicle, velocity: Array, thrust: Array, share: float = 1.0) -> Array:
    """Gain [W] that a learnt model is allowed at velocities (..., 3) with thrusts (..., thrusters) [N], (...).

    What its thrusters may give or, where that is more, a `share` of what is let pass without thrust.

    Parameters
    ----------
    vehicle : whose thrusters drive
    velocity : (..., 3) relative to the water [m/s, m/s, rad/s]
    thrust : (..., thrusters) [N]
    share : of the tolerance, 0..1
    """
    driven = most_driven(thruster_matrix(vehicle), velocity, thrust)
    return np.maximum(driven, share * let_pass(full_force(vehicle), velocity))


def thrust_power(vehicle: Vehicle, motion: Motion) -> Array:
    """Power nu_r^T tau [W] of the thrusters along a motion, (n,), by the vehicle's curves and advance losses."""
    velocity = np.stack(through_water(vehicle, motion), axis=-1)
    act = actuation(vehicle, motion)
    thrust = act.thrust - act.load * velocity[:, 0]
    return (velocity * (thruster_matrix(vehicle) @ thrust).T).sum(-1)


def coasting_states(envelope: Envelope, count: int, seed: int = 0) -> Array:
    """Velocities (count, 3) at which a hull without thrust is asked for its power.

    A half fills the envelope evenly, a quarter lies on rays at all scales (linear terms show at low speed), and a
    quarter has motion along one axis only: there the power is that axis' own, and the law is that of its damping.

    Parameters
    ----------
    envelope : of velocities [m/s, m/s, rad/s]
    count : of states
    seed : of the draws
    """
    rng = np.random.default_rng([seed, 11])
    low, high = np.array(envelope.lower), np.array(envelope.upper)
    states = low + (high - low) * rng.random((count, 3))
    quarter = count // 4
    states[:quarter] *= 10.0 ** rng.uniform(-2.0, 0.0, (quarter, 1))
    states[quarter : 2 * quarter] *= np.eye(3)[rng.integers(0, 3, quarter)]
    return states


def _positive(value: Any) -> Any:
    return 0.5 * (value + abs(value))
