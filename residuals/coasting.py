"""A network asked what a hull does without thrust: the states, its power there, and the verdict of the laws.

What the network says of a hull at rest is a push from outside, as of wind or of a trim; it is no damping, and is taken
off before power is asked for. That nothing should move at rest is another law.
"""

from typing import final

import numpy as np
import torch
from torch import Tensor

from ..physics.energy import coasting_power, surplus, violated
from ..physics.frames import Array
from ..physics.laws import damping_power
from ..physics.matrices import mass_matrix
from ..physics.vehicle import Vehicle
from .networks.base import Network

SETTLE = 2.0
"""Time for which a state is held, so that a network with memory settles [s]."""


@final
class Coasting:
    """States without thrust, ready to be put to a network many times.

    Parameters
    ----------
    vehicle : of the mass, and of the physics beside the network
    states : (n, 3) velocities relative to the water [m/s, m/s, rad/s]
    scale : power by which a surplus is measured [W]
    pure : whether the network gives the whole acceleration
    heading : whether it sees the heading; then headings are drawn
    time_step : [s]
    remembers : whether the network has a memory; then each state is held for `SETTLE`
    like : a tensor of the type and on the device of the weights
    """

    def __init__(
        self,
        vehicle: Vehicle,
        states: Array,
        scale: float,
        *,
        pure: bool,
        heading: bool,
        time_step: float,
        remembers: bool,
        like: Tensor,
    ) -> None:
        count = states.shape[0]
        idle = np.zeros((count, len(vehicle.thrusters)))
        angle = np.random.default_rng(7).uniform(-np.pi, np.pi, count)
        turned = [np.cos(angle)[:, None], np.sin(angle)[:, None]] if heading else []
        base = np.zeros(count) if pure else damping_power(vehicle, states)
        self.scale, self.heading = scale, heading
        self.rows = max(1, round(SETTLE / time_step)) if remembers else 1
        rest = np.concatenate([np.zeros_like(states), idle, *turned], axis=1)
        self.inputs, self.still, self.base, self.mass = (
            torch.as_tensor(v, dtype=like.dtype, device=like.device)
            for v in (
                np.concatenate([states, idle, *turned], axis=1),
                rest if heading else rest[:1],
                base,
                mass_matrix(vehicle),
            )
        )

    @property
    def count(self) -> int:
        """Number of states."""
        return self.inputs.shape[0]

    def push(self, network: Network, index: Tensor | None = None) -> Tensor:
        """What the network says of a hull at rest: (1, 3), or for the heading of each state (n, 3)."""
        still = self.still if index is None or not self.heading else self.still[index]
        said, _ = network(still[:, None].expand(-1, self.rows, -1))
        return said[:, -1]

    def power(self, network: Network, index: Tensor | None = None) -> Tensor:
        """Power that the motion gains at the states (or those of `index`) [W], (n,)."""
        inputs, base = (self.inputs, self.base) if index is None else (self.inputs[index], self.base[index])
        said, _ = network(inputs[:, None].expand(-1, self.rows, -1))
        return base + coasting_power(self.mass, inputs[:, :3], said[:, -1] - self.push(network, index))

    def excess(self, network: Network, index: Tensor | None = None) -> Tensor:
        """Power above what the law allows, in units of the scale, 0 where lawful."""
        return surplus(self.power(network, index)) / self.scale

    def violating_share(self, network: Network) -> float:
        """Share of all states at which power is gained, beyond `physics.energy.TOLERANCE`."""
        with torch.no_grad():
            return float(violated(self.power(network), self.scale).double().mean())
