"""A trained network as a model: beside the physics of a vehicle (hybrid), or in its place (pure)."""

from typing import final

import numpy as np
import torch

from ..physics.forces import modelled_acceleration
from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.simulation import Rollouts
from ..physics.vehicle import Vehicle
from .inputs import network_inputs
from .models import Kind, Model
from .networks.base import Network


@final
class NetworkModel(Model):
    """A network that corrects the acceleration of a vehicle, or gives all of it.

    Attributes
    ----------
    vehicle : the nominal model: of its physics, of the thrust that the network sees, and of the mass that laws ask for
    network : trained; its input names say whether it sees the heading
    pure : whether the network gives the whole acceleration, without the vehicle's physics
    time_step : of the rows that it was trained on [s]; it knows no other
    """

    def __init__(
        self,
        vehicle: Vehicle,
        network: Network,
        time_step: float,
        *,
        pure: bool = False,
        name: str = "",
        seconds_to_fit: float = 0.0,
    ) -> None:
        self.vehicle = vehicle
        self.network = network.eval()
        self.time_step = time_step
        self.pure = pure
        self.name = name or f"{'pure' if pure else 'hybrid'} {network.name}"
        self.kind: Kind = "network" if pure else "hybrid"
        self.parameters = sum(p.numel() for p in network.parameters())
        self.seconds_to_fit = seconds_to_fit

    @property
    def heading(self) -> bool:
        """Whether the network sees the heading."""
        return "cos_psi" in self.network.scaling.inputs.names

    def correction(self, motion: Motion) -> Array:
        """What the network says along a measured motion, (n, 3) [m/s^2, m/s^2, rad/s^2]."""
        seen = torch.as_tensor(network_inputs(self.vehicle, motion, self.heading), dtype=torch.float32)
        with torch.no_grad():
            said, _ = self.network(seen[None])
        return np.asarray(said[0].double().numpy())

    def acceleration(self, motion: Motion) -> Array:
        """See `Model.acceleration`."""
        said = self.correction(motion)
        return said if self.pure else modelled_acceleration(self.vehicle, motion) + said

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """See `Model.rollout`."""
        raise NotImplementedError
