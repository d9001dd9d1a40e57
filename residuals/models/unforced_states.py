"""The audit of a network by the laws of a hull: states with and without thrust, the power there, and the ruling.

Laws and tolerance are those of `physics.laws.energy`: power without thrust, power under thrust, and the push at rest.
Current, wind and trim of the vehicle file are forces from outside; any other push of a network at rest counts.
"""

from typing import final

import numpy as np
import torch
from torch import Tensor

from ...physics.forces import ForceEquation, calm, held_thrust, relative_velocity, stated_push
from ...physics.laws.energy import (
    EXCESS_UNIT,
    INSIDE,
    TOLERANCE,
    allowed_power,
    coasting_power,
    full_force,
    full_power,
    let_pass,
)
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import Array
from ...physics.thrusters import neutral_command
from ...physics.vehicle import Vehicle
from ..networks.base import Network

SETTLE = 2.0
"""Time for which a state is held, so that a network with memory settles [s]."""


@final
class UnforcedStates:
    """States that are ready to be put to a network many times.

    Parameters
    ----------
    vehicle : of the mass, the thrust, and the physics beside the network
    states : (n, 3) velocities relative to the water [m/s, m/s, rad/s], or (n, 4) with the headings [rad] at which they
        were met against the laws: then less is aimed at than thrusters may give, too, for at the limit itself a loss
        has no slope. Other headings are drawn
    commands : (n, thrusters) that are held there; without: no thrust
    pure : whether the network gives the whole acceleration
    heading : whether it sees the heading
    time_step : [s]
    settles : whether the network has a memory that settles; then each state is held for `SETTLE`
    like : a tensor of the type and on the device of the weights
    """

    def __init__(
        self,
        vehicle: Vehicle,
        states: Array,
        commands: Array | None = None,
        *,
        pure: bool,
        heading: bool,
        time_step: float,
        settles: bool,
        like: Tensor,
    ) -> None:
        count, met = states.shape[0], states.shape[1] > 3
        neutral = np.tile([neutral_command(t) for t in vehicle.thrusters], (count, 1))
        thrust, load = held_thrust(vehicle, neutral if commands is None else commands)
        angle = states[:, 3] if met else np.random.default_rng(7).uniform(-np.pi, np.pi, count)
        states = states[:, :3]
        turned = [np.cos(angle)[:, None], np.sin(angle)[:, None]] if heading else []
        effective = (thrust - load * states[:, 0]).T
        mass, full = mass_matrix(vehicle), full_force(vehicle)
        allowed, aimed = (allowed_power(vehicle, states, effective, share) for share in (1.0, INSIDE))
        if met:
            aimed = allowed - (1.0 - INSIDE) * let_pass(full, states)
        base, push = _beside(vehicle, states, angle, thrust, load, pure)
        self.heading = heading
        self.rows = max(1, round(SETTLE / time_step)) if settles else 1
        (
            self.allowed,
            self.aimed,
            self.unit,
            self.inputs,
            self.still,
            self.base,
            self.push_stated,
            self.full,
            self.mass,
        ) = (
            torch.as_tensor(np.ascontiguousarray(v), dtype=like.dtype, device=like.device)
            for v in (
                allowed,
                aimed,
                EXCESS_UNIT * full_power(full, states),
                np.concatenate([states, thrust.T, *turned], axis=1),
                np.concatenate([0.0 * states, 0.0 * thrust.T, *turned], axis=1),
                base,
                push,
                full / np.diag(mass),
                mass,
            )
        )

    @property
    def count(self) -> int:
        """Number of states."""
        return self.inputs.shape[0]

    def push(self, network: Network, index: Tensor | None = None) -> Tensor:
        """Acceleration of a hull at rest without thrust beside what is stated, as a share of full thrust, (n, 3)."""
        still, stated = (x if index is None else x[index] for x in (self.still, self.push_stated))
        if not self.heading:
            still = still[:1]
        said, _ = network(still[:, None].expand(-1, self.rows, -1))
        return (said[:, -1] - stated) / self.full

    def power(self, network: Network, index: Tensor | None = None) -> Tensor:
        """Power that the motion gains at the states (or those of `index`) [W], (n,)."""
        inputs, base = (self.inputs, self.base) if index is None else (self.inputs[index], self.base[index])
        said, _ = network(inputs[:, None].expand(-1, self.rows, -1))
        return base + coasting_power(self.mass, inputs[:, :3], said[:, -1])

    def penalty(self, network: Network, index: Tensor) -> Tensor:
        """Mean squared power above what is aimed at at states, and push at rest above it; 0 where lawful."""
        over = ((self.power(network, index) - self.aimed[index]) / self.unit[index]).clamp(min=0.0)
        pushed = ((self.push(network, index).abs() - INSIDE * TOLERANCE) / EXCESS_UNIT).clamp(min=0.0)
        return over.square().mean() + pushed.square().sum(dim=1).mean()

    def violating_share(self, network: Network) -> float:
        """Share of all states at which more power is gained than is allowed; rest counts as one of them."""
        with torch.no_grad():
            over = self.power(network) > self.allowed
            pushed = (self.push(network).abs() > TOLERANCE).any()
            return float(torch.cat([over, pushed[None]]).double().mean())


def _beside(
    vehicle: Vehicle, states: Array, heading: Array, thrust: Array, load: Array, pure: bool
) -> tuple[Array, Array]:
    """Power (n,) [W] of all that is not the network, and acceleration (n, 3) at rest that is stated, of a pure network.

    A pure network says the stated wind and trim, and the turning of the water, with all else: they are taken out.
    """
    u, v, r = triple = (states[:, 0], states[:, 1], states[:, 2])
    if not pure:
        force = ForceEquation(calm(vehicle)).force(triple, heading, thrust, load, (v, r))
        return (states * np.stack(force, axis=-1)).sum(axis=1), np.zeros_like(states)
    none = (0.0 * u, 0.0 * u, 0.0 * u)
    drift = np.stack(relative_velocity(vehicle, heading, none), axis=-1)
    turning = np.stack(ForceEquation(vehicle).acceleration(none, triple, tuple((states - drift).T), heading), axis=-1)
    mass = mass_matrix(vehicle)
    taken = (states * stated_push(vehicle, heading, triple)).sum(axis=1) + coasting_power(mass, states, turning)
    return -taken, stated_push(vehicle, heading, none) @ np.linalg.inv(mass).T
