"""Long short-term memory (Hochreiter and Schmidhuber 1997) with a linear head."""

from typing import ClassVar, final

from torch import Tensor, nn

from .base import Memory, Network, Scaling, quiet_head


@final
class LSTM(Network):
    """`layers` LSTM layers of `units` cells; memory: hidden and cell state, (batch, layers, units) each."""

    name: ClassVar[str] = "lstm"

    def __init__(self, scaling: Scaling, *, units: int = 64, layers: int = 1) -> None:
        super().__init__(scaling, {"units": units, "layers": layers})
        self.body = nn.LSTM(self.width, units, layers, batch_first=True)
        self.head = quiet_head(units)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        state = None if memory is None else tuple(m.transpose(0, 1).contiguous() for m in memory)
        hidden, after = self.body(standardised, state)
        return self.head(hidden), tuple(m.transpose(0, 1) for m in after)
