"""Temporal convolutional network (Bai, Kolter and Koltun 2018): dilated causal convolutions, residual connections."""

from typing import ClassVar, final

import torch
from torch import Tensor, nn

from .base import Memory, Network, Scaling, quiet_head


@final
class TCN(Network):
    """`layers` residual blocks of two causal convolutions; the dilation doubles from block to block.

    It sees 1 + 2 (kernel - 1) (2^layers - 1) rows back, 61 rows as it stands. Memory: for each convolution the
    (kernel - 1) dilation rows before the next one, so that a single new row costs a single row's work.
    """

    name: ClassVar[str] = "tcn"
    starts_settled = True

    def __init__(self, scaling: Scaling, *, units: int = 32, layers: int = 4, kernel: int = 3) -> None:
        super().__init__(scaling, {"units": units, "layers": layers, "kernel": kernel})
        self.lift = nn.Linear(self.width, units)
        self.blocks = nn.ModuleList(
            nn.ModuleList(nn.Conv1d(units, units, kernel, dilation=2**k) for _ in range(2)) for k in range(layers)
        )
        self.head = quiet_head(units)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        signal = self.lift(standardised).transpose(1, 2)
        past = iter(memory or ())
        kept: list[Tensor] = []
        for block in self.blocks:
            inner = signal
            for convolution in block:  # type: ignore[union-attr]
                reach = (convolution.kernel_size[0] - 1) * convolution.dilation[0]
                before = inner[..., :1].expand(-1, -1, reach) if memory is None else next(past).transpose(1, 2)
                longer = torch.cat((before, inner), dim=2)
                kept.append(longer[..., longer.shape[2] - reach :].transpose(1, 2))
                inner = torch.relu(convolution(longer))
            signal = signal + inner
        return self.head(signal.transpose(1, 2)), tuple(kept)
