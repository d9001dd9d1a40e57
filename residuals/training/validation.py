"""What an epoch is judged by: the error on held-out motions, filtered as scores filter it, and the laws."""

from typing import final

import numpy as np
import torch

from ...measurements.preparation.dataset import DataSet
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from ..models.coasting import Coasting
from ..models.network_inputs import network_inputs
from ..networks.base import Network, through
from ..scores import same_filter
from .windows import target_acceleration


@final
class Judge:
    """Held-out motions, ready to be judged after every epoch.

    Parameters
    ----------
    data : validation motions
    coasting : states at which the laws are asked for
    unit : (3,) of the error on each axis [m/s^2, m/s^2, rad/s^2]
    """

    def __init__(
        self,
        data: DataSet,
        vehicle: Vehicle,
        coasting: Coasting,
        unit: Array,
        *,
        pure: bool,
        heading: bool,
    ) -> None:
        self.data, self.coasting, self.unit = data, coasting, unit
        self.targets = [target_acceleration(vehicle, motion, data, pure) for motion in data.motions]
        seen = [network_inputs(vehicle, motion, heading) for motion in data.motions]
        longest = max(see.shape[0] for see in seen)
        # Networks are causal: rows after the end of a shorter motion change nothing before it.
        padded = np.stack([np.pad(see, ((0, longest - see.shape[0]), (0, 0)), mode="edge") for see in seen])
        self.inputs = torch.as_tensor(padded).to(coasting.inputs)

    def error(self, network: Network) -> float:
        """Root mean square error of the acceleration, each axis in its unit; the axes count alike."""
        with torch.no_grad():
            said = through(network, self.inputs)[0].double().cpu().numpy()
        if not np.isfinite(said).all():
            return float("nan")
        rows = [
            same_filter(s[: target.shape[0]], motion, self.data) - target
            for s, target, motion in zip(said, self.targets, self.data.motions, strict=True)
        ]
        return float(np.sqrt(((np.concatenate(rows) / self.unit) ** 2).mean()))

    def violating(self, network: Network) -> float:
        """Share of the states without thrust at which the network creates energy."""
        return self.coasting.violating_share(network)
