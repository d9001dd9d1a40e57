"""The paper's network: a perceptron of the present state and thrust, without memory; of ReLU or, smooth, of tanh."""

from typing import ClassVar, final

from torch import Tensor, nn

from .base import Memory, Network, Scaling, hidden_layers, quiet_head

_ACTIVATIONS = (nn.ReLU, nn.Tanh)
"""By the number that the option has, from 1 on."""


@final
class MLP(Network):
    """Fully connected: `layers` of `units`, then a linear head; 5 -> 128 -> 3 for two thrusters.

    `activation` is 1 for ReLU, whose correction has kinks, and 2 for tanh, whose correction is smooth and bounded.
    """

    name: ClassVar[str] = "mlp"
    rests_on = "bounds"

    def __init__(self, scaling: Scaling, *, units: int = 128, layers: int = 1, activation: int = 1) -> None:
        super().__init__(scaling, {"units": units, "layers": layers, "activation": activation})
        self.body = hidden_layers(self.width, units, layers, _ACTIVATIONS[activation - 1])
        self.head = quiet_head(units)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        return self.head(self.body(standardised)), ()
