"""Corrections that cannot create energy: -(L L^T + S) nu_r with S skew-symmetric, and a bounded drive."""

from abc import ABC

import numpy as np
import torch
from torch import Tensor, nn

from .base import Network, Scaling, hidden_layers, quiet_head

START = -2.0
"""Logarithm of the diagonal of L over its scale at the start: L is a seventh of its scale, damping a fiftieth. It does
not start at zero, where the gradient of L L^T vanishes."""

_STRONGEST = (1.0, 0.1, 0.0)
"""Effect of a thruster that counts on each axis even where the vehicle has a weaker one [N/N, N/N, N m/N]."""


class Dissipation(Network, ABC):
    """Force -(L L^T + S) nu_r + G T, where L, S and G depend on state and thrust through layers of tanh.

    Its power without thrust is -|L^T nu_r|^2 <= 0, whatever the weights: S does no work, and the drive G T vanishes
    with the thrust T. Each element of G is at most `gain` times the strongest effect that a thruster has on its axis,
    and at least `gain` N per N counts on surge, a tenth of that on sway. The layers are bounded, so that damping
    beyond the data is that at its border. The form -D(nu) nu with D + D^T >= 0 is that of Fossen (2021), section 6.4.
    """

    rests_on = "itself"
    factor_scale: Tensor
    skew_scale: Tensor
    drive_scale: Tensor
    inverse_mass: Tensor
    triangle: Tensor

    def __init__(self, scaling: Scaling, units: int, layers: int, gain: float, **more: int) -> None:
        super().__init__(scaling, {"units": units, "layers": layers, "gain": gain, **more})
        self.drives = scaling.drives
        self.body = hidden_layers(self.width, units, layers, nn.Tanh)
        self.factor, self.skew, self.drive = (quiet_head(units, size) for size in (6, 3, 3 * self.drives))
        speeds = np.asarray(scaling.inputs.scale[:3], dtype=float)
        per_speed = np.sqrt(np.abs(scaling.mass) @ scaling.output / speeds)
        most = np.maximum(np.abs(scaling.reach).max(axis=1), _STRONGEST)
        pairs = np.outer(per_speed, per_speed)[np.triu_indices(3, 1)]
        self.hold({"factor_scale": per_speed, "skew_scale": pairs, "drive_scale": gain * most})
        # In double precision, or rounding would turn the force and let S do work.
        self.register_buffer("inverse_mass", torch.as_tensor(np.linalg.inv(scaling.mass), dtype=torch.float64))
        self.register_buffer("triangle", torch.tril_indices(3, 3), persistent=False)
        with torch.no_grad():
            start = float(np.exp(START))
            self.factor.bias.copy_(torch.tensor([start, 0.0, start, 0.0, 0.0, start]))

    def said(self, force: Tensor) -> Tensor:
        """A force (..., 3) [N, N, N m] as a network says it."""
        return force @ self.inverse_mass.to(force.dtype).mT / self.output_scale

    def force(self, hidden: Tensor, inputs: Tensor) -> Tensor:
        """Force (..., 3) [N, N, N m] of damping, turning and drive, by what the layers make of the inputs."""
        shape = inputs.shape[:-1]
        velocity, thrust = inputs[..., :3], inputs[..., 3 : 3 + self.drives]
        lower = inputs.new_zeros(*shape, 3, 3)
        lower[..., *self.triangle] = self.factor(hidden)
        lower = lower * self.factor_scale[:, None]
        a, b, c = (self.skew(hidden) * self.skew_scale).unbind(-1)
        along = (lower.mT @ velocity[..., None]).squeeze(-1)
        damping = (lower @ along[..., None]).squeeze(-1)
        u, v, r = velocity.unbind(-1)
        turning = torch.stack((a * v + b * r, c * r - a * u, -b * u - c * v), dim=-1)
        gains = torch.tanh(self.drive(hidden)).reshape(*shape, 3, self.drives) * self.drive_scale[:, None]
        return (gains @ thrust[..., None]).squeeze(-1) - damping - turning
