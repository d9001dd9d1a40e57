"""Baselines: motion that goes on as it is. A model that predicts worse than these knows nothing of the boat."""

from abc import abstractmethod
from typing import ClassVar, final

import numpy as np

from ...physics.integration import Rollouts
from ...physics.motion import Array, Motion, body_to_earth, earth_to_body
from ...physics.vehicle import Vehicle
from .base import Kind, Model

_STRAIGHT = 1e-9
"""Yaw rate [rad/s] below which an arc is a straight line."""


class Baseline(Model):
    """Motion without forces, whose rollouts have a closed form."""

    kind: Kind = "baseline"
    parameters = 0
    seconds_to_fit = 0.0
    remembers = False

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle

    def acceleration(self, motion: Motion) -> Array:
        """See `Model.acceleration`."""
        return self.settled(motion.velocity, motion.heading, motion.commands)

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """See `Model.rollout`."""
        rows = np.asarray(starts, dtype=int)
        t = np.arange(steps + 1, dtype=float) * motion.time_step
        psi, nu = motion.heading[rows], motion.velocity[rows]
        states = np.empty((rows.size, steps + 1, 6))
        states[..., 2] = psi[:, None] + nu[:, 2:] * t
        states[..., 5] = nu[:, 2:]
        self._go(states, t, psi, nu)
        states[..., :2] += motion.position[rows][:, None]
        return Rollouts(states, np.zeros(rows.size, dtype=bool))

    @abstractmethod
    def _go(self, states: Array, t: Array, psi: Array, nu: Array) -> None:
        """Fill in the way made [m] and the velocities u, v [m/s] of states (starts, steps + 1, 6) at times t [s]."""


@final
class ZeroAcceleration(Baseline):
    """No acceleration: nu_dot = 0. Body velocities are held, so a boat that turns goes round in a circle."""

    name: ClassVar[str] = "zero acceleration"

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`."""
        return np.zeros_like(velocity)

    def _go(self, states: Array, t: Array, psi: Array, nu: Array) -> None:
        u, v, r = (x[:, None] for x in nu.T)
        states[..., 3], states[..., 4] = u, v
        turned = r * t
        still = np.abs(r) < _STRAIGHT
        rate = np.where(still, 1.0, r)
        ahead = np.where(still, t, np.sin(turned) / rate)
        aside = np.where(still, 0.5 * turned * t, 2.0 * np.sin(0.5 * turned) ** 2 / rate)
        states[..., 0], states[..., 1] = body_to_earth(psi[:, None], u * ahead - v * aside, u * aside + v * ahead)


@final
class HoldVelocity(Baseline):
    """No force in earth axes: velocity over ground and turn rate are held, u_dot = r v and v_dot = -r u."""

    name: ClassVar[str] = "hold velocity"

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`."""
        u, v, r = velocity.T
        return np.column_stack([r * v, -r * u, np.zeros_like(r)])

    def _go(self, states: Array, t: Array, psi: Array, nu: Array) -> None:
        north, east = (x[:, None] for x in body_to_earth(psi, nu[:, 0], nu[:, 1]))
        states[..., 0], states[..., 1] = north * t, east * t
        states[..., 3], states[..., 4] = earth_to_body(states[..., 2], north, east)


def baselines(vehicle: Vehicle) -> tuple[Model, ...]:
    """All baselines, for the commands of a vehicle."""
    return ZeroAcceleration(vehicle), HoldVelocity(vehicle)
