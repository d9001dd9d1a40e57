"""The paper's network: a perceptron of the present state and thrust, without memory."""

from typing import ClassVar, final

from torch import Tensor

from .base import Memory, Network, Scaling, hidden_layers, quiet_head


@final
class MLP(Network):
    """Fully connected: `layers` of `units` ReLU, then a linear head; 5 -> 128 -> 3 for two thrusters."""

    name: ClassVar[str] = "mlp"

    def __init__(self, scaling: Scaling, *, units: int = 128, layers: int = 1) -> None:
        super().__init__(scaling, {"units": units, "layers": layers})
        self.body = hidden_layers(self.width, units, layers)
        self.head = quiet_head(units)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        return self.head(self.body(standardised)), ()
