"""The loss of a batch of windows: data, laws, smoothness, and short rollouts."""

from typing import final

import torch
from torch import Tensor

from ...physics.laws.energy import EXCESS_UNIT, coasting_power, full_force, full_power, surplus
from ...physics.vehicle import Vehicle
from ..models.coasting import Coasting
from ..networks.base import Network
from .augment import Augmenter
from .rollouts import Forcing, Shooter
from .training_settings import TrainingSettings
from .windows import Windows

STATES = 64
"""States with and without thrust that are drawn for each batch."""


@final
class Objective:
    """lambda_data |a - a_measured|^2 + lambda_phys |power beyond the laws|^2 + lambda_smooth |delta r|^2 + rollouts.

    The network's output passes through the filter of the measured acceleration before they are compared. All that does
    not depend on weights is worked out once.

    Parameters
    ----------
    windows : of the training part
    filter_matrix : see `Windows.filter_matrix`; its type and device are those of the weights
    unit : (3,) of the error on each axis [m/s^2, m/s^2, rad/s^2]
    coasting : states with and without thrust from the training envelope
    vehicle : rolled out with the network, where `settings.rollout_rows` asks for it
    augmenter : varies each batch, or None

    Attributes
    ----------
    met : states more at which the laws are asked for: those that an audit met against them
    """

    met: Coasting | None = None

    def __init__(
        self,
        windows: Windows,
        filter_matrix: Tensor,
        unit: Tensor,
        coasting: Coasting,
        vehicle: Vehicle,
        settings: TrainingSettings,
        *,
        pure: bool,
        augmenter: Augmenter | None = None,
    ) -> None:
        def tensor(values: object) -> Tensor:
            return torch.as_tensor(values, dtype=filter_matrix.dtype, device=filter_matrix.device)

        self.settings, self.coasting, self.augmenter = settings, coasting, augmenter
        self.filter, self.unit = filter_matrix[:, windows.first :], unit
        self.inputs, self.allowed, self.base = map(tensor, (windows.inputs, windows.allowed, windows.base))
        self.scale = tensor(EXCESS_UNIT * full_power(full_force(vehicle), windows.inputs[..., :3]))
        self.target = tensor(windows.target[:, windows.compared])
        self.shooter = Shooter(vehicle, pure=pure, time_step=windows.time_step)
        self.states, self.thrust, self.load, self.air = map(
            tensor, (windows.states, windows.thrust, windows.load, windows.air)
        )
        self.warm_rows, self.time_step = windows.first, windows.time_step

    @property
    def count(self) -> int:
        """Number of windows."""
        return self.inputs.shape[0]

    def __call__(self, network: Network, index: Tensor, draw: torch.Generator) -> Tensor:
        """Loss of the windows `index`; `draw` decides states, starts and variants."""
        settings, unit = self.settings, self.unit
        inputs, target = self.inputs[index], self.target[index]
        if self.augmenter is not None:
            inputs, target = self.augmenter(inputs, target, index, draw)
        said = self._said(network, inputs)
        loss = settings.lambda_data * robust((self.filter @ said - target) / unit, settings.huber).mean()
        if settings.lambda_smooth:
            loss = loss + settings.lambda_smooth * (said.diff(dim=1) / unit).square().mean()
        if settings.lambda_phys:
            loss = loss + settings.lambda_phys * self._unlawful(network, index, inputs, said, draw)
        if settings.rollout_rows and settings.lambda_rollout:
            loss = loss + settings.lambda_rollout * self._astray(network, index, inputs, draw)
        return loss

    def _said(self, network: Network, inputs: Tensor) -> Tensor:
        """What a network says of windows behind their first rows, on which its memory warms up, and learns nothing."""
        memory = None
        if self.warm_rows:
            with torch.no_grad():
                _, memory = network(inputs[:, : self.warm_rows])
        return network(inputs[:, self.warm_rows :], memory)[0]

    def _unlawful(self, network: Network, index: Tensor, inputs: Tensor, said: Tensor, draw: torch.Generator) -> Tensor:
        """Mean squared power beyond the laws: along the windows, and at states with and without thrust."""
        base, allowed, scale = (x[index, self.warm_rows :] for x in (self.base, self.allowed, self.scale))
        power = base + coasting_power(self.coasting.mass, inputs[:, self.warm_rows :, :3], said)
        along = surplus(power - allowed) / scale
        loss = along.square().mean()
        for asked in (self.coasting, self.met):
            if asked is not None:
                drawn = torch.randint(asked.count, (STATES,), generator=draw).to(index)
                loss = loss + asked.penalty(network, drawn)
        return loss

    def _astray(self, network: Network, index: Tensor, inputs: Tensor, draw: torch.Generator) -> Tensor:
        """Mean squared velocity error along rollouts from one random row, in what the unit adds up to on them.

        The rows before it are those that the network sees in `inputs`, noise included.
        """
        steps, warm = self.settings.rollout_rows, self.warm_rows
        most = self.inputs.shape[1] - steps - 1
        start = int(torch.randint(warm, most + 1, (), generator=draw))
        rows = slice(start - warm, start + steps + 1)
        states = self.states[index, rows]
        forcing = Forcing(self.thrust[index, rows], self.load[index, rows], self.air[index, rows])
        rolled = self.shooter.velocities(network, inputs[:, rows], states, forcing, warm)
        error = (rolled - states[:, warm + 1 :, 1:4]) / (self.unit * steps * self.time_step)
        return error.square().mean()


def robust(error: Tensor, huber: float) -> Tensor:
    """The square of errors up to `huber`, and a line of the same slope beyond it (Huber 1964); all squares if 0."""
    if not huber:
        return error.square()
    size = error.abs()
    return torch.where(size <= huber, error.square(), huber * (2.0 * size - huber))
