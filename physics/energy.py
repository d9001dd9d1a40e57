"""The energy balance of a hull as inequalities between powers, for arrays and tensors alike.

Each law stands here once, for three uses: a penalty while a network is trained, a verdict on what it learnt, and an
audit of any model. Only operators and methods that numpy arrays and torch tensors share act on the values.

Along a motion the kinetic energy changes by nu^T M nu_dot, to which Coriolis forces add nothing (Fossen 2021, property
6.3). Without thrust that power is what damping takes out, so it is never above zero: not in any state, and, on a hull
that moves along one axis only, not on any axis. With thrust it is at most what the thrusters put in.
"""

from typing import Any

import numpy as np

from .forces import actuation, relative_velocity
from .frames import Array
from .laws import Envelope
from .matrices import thruster_matrix
from .motion import Motion
from .vehicle import Vehicle

MARGIN = 1.5
"""Thrusters may put in this multiple of what the vehicle file says: nominal thrust is seldom known better."""
TOLERANCE = 0.01
"""Share of a boat's typical power below which a surplus is no violation; networks are never exactly zero at rest."""


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


def violated(power: Any, scale: float, driven: Any = 0.0, margin: float = MARGIN) -> Any:
    """True where the surplus is more than `TOLERANCE` of a typical power `scale` [W]."""
    return surplus(power, driven, margin) > TOLERANCE * scale


def thrust_power(vehicle: Vehicle, motion: Motion) -> Array:
    """Power nu_r^T tau [W] of the thrusters along a motion, (n,), by the vehicle's curves and advance losses."""
    velocity = np.stack(relative_velocity(vehicle, motion.heading, tuple(motion.velocity.T)), axis=-1)
    act = actuation(vehicle, motion)
    thrust = act.thrust - act.load * velocity[:, 0]
    return (velocity * (thruster_matrix(vehicle) @ thrust).T).sum(-1)


def coasting_states(envelope: Envelope, count: int, seed: int = 0) -> Array:
    """Velocities (count, 3) at which a hull without thrust is asked for its power.

    A half fills the envelope evenly, a quarter lies on rays at all scales (linear terms show at low speed), and a
    quarter has motion along one axis only: there the power is that axis' own, and the law is that of its damping.
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
