"""A network asked what a hull does without thrust: the states, its power there, and the verdict of the laws."""

from typing import final

import numpy as np
import torch
from torch import Tensor

from ..physics.energy import TOLERANCE, coasting_power, surplus
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
        columns = [states, np.zeros((count, len(vehicle.thrusters)))]
        if heading:
            angle = np.random.default_rng(7).uniform(-np.pi, np.pi, count)
            columns += [np.cos(angle)[:, None], np.sin(angle)[:, None]]
        base = np.zeros(count) if pure else damping_power(vehicle, states)
        self.scale = scale
        self.rows = max(1, round(SETTLE / time_step)) if remembers else 1
        self.inputs, self.base, self.mass = (
            torch.as_tensor(v, dtype=like.dtype, device=like.device)
            for v in (np.concatenate(columns, axis=1), base, mass_matrix(vehicle))
        )

    @property
    def count(self) -> int:
        """Number of states."""
        return self.inputs.shape[0]

    def excess(self, network: Network, index: Tensor | None = None) -> Tensor:
        """Power that the motion gains at the states (or those of `index`) in units of the scale, 0 where lawful."""
        inputs, base = (self.inputs, self.base) if index is None else (self.inputs[index], self.base[index])
        said, _ = network(inputs[:, None].expand(-1, self.rows, -1))
        power = base + coasting_power(self.mass, inputs[:, :3], said[:, -1])
        return surplus(power) / self.scale

    def violating_share(self, network: Network) -> float:
        """Share of all states at which power is gained, beyond `physics.energy.TOLERANCE`."""
        with torch.no_grad():
            return float((self.excess(network) > TOLERANCE).double().mean())
