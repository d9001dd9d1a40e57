"""A perceptron that sees how the velocities have just changed, in the place of what an inertial sensor says."""

from typing import ClassVar, final

import torch
from torch import Tensor

from undertow.residuals.networks.base import Memory, Network, Scaling, hidden_layers, quiet_head

RATE = 10.0
"""Rows a second: a change of one deviation in a second counts as much as one deviation."""


@final
class Inertial(Network):
    """The paper's perceptron, with the change of the velocities since the row before beside them.

    What an accelerometer says of the row itself is the answer, and no rollout has one; those of boats also hold gravity
    wherever the hull trims. The change up to the row is what a rollout knows, too, and stands in for it. It has a
    memory, and so two seconds of each window warm it up; noise is drawn onto it as onto the perceptron: none.
    Memory: the velocities of the last row, (batch, 1, 3).
    """

    name: ClassVar[str] = "inertial"

    def __init__(self, scaling: Scaling, *, units: int = 128) -> None:
        super().__init__(scaling, {"units": units})
        self.body = hidden_layers(self.width + 3, units, 1)
        self.head = quiet_head(units)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        velocity = standardised[..., :3]
        before = velocity[:, :1] if memory is None else memory[0]
        felt = RATE * torch.cat((before, velocity), dim=1).diff(dim=1)
        return self.head(self.body(torch.cat((standardised, felt), dim=-1))), (velocity[:, -1:],)
