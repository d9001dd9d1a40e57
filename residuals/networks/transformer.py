"""A small causal transformer (Vaswani et al. 2017), after the related work's DyTR: attention over some seconds."""

from typing import ClassVar, final

import torch
from torch import Tensor, nn

from ...physics.errors import RequestError
from .base import Memory, Network, Scaling, quiet_head


class _Attention(nn.Module):
    """Causal self-attention over the last `window` rows, with a learnt bias for each distance in time."""

    def __init__(self, units: int, heads: int, window: int) -> None:
        super().__init__()
        self.heads, self.window = heads, window
        self.mixed = nn.Linear(units, 3 * units)
        self.out = nn.Linear(units, units)
        self.bias = nn.Parameter(torch.zeros(heads, window))

    def forward(self, signal: Tensor, past: Tensor | None) -> tuple[Tensor, Tensor]:
        """(batch, rows, units) to the same; `past`: keys and values of earlier rows, (batch, window - 1, 2 units)."""
        batch, rows, units = signal.shape
        query, fresh = self.mixed(signal).split((units, 2 * units), dim=-1)
        before = fresh[:, :1].expand(-1, self.window - 1, -1) if past is None else past
        known = torch.cat((before, fresh), dim=1)
        key, value = known.chunk(2, dim=-1)
        total = known.shape[1]
        now = torch.arange(total - rows, total, device=signal.device)
        distance = now[:, None] - torch.arange(total, device=signal.device)
        seen = (distance >= 0) & (distance < self.window)
        score = torch.where(seen, self.bias[:, distance.clamp(0, self.window - 1)], float("-inf"))

        def by_head(x: Tensor) -> Tensor:
            return x.reshape(batch, -1, self.heads, units // self.heads).transpose(1, 2)

        mixed = nn.functional.scaled_dot_product_attention(
            by_head(query), by_head(key), by_head(value), attn_mask=score[None]
        )
        joined = mixed.transpose(1, 2).reshape(batch, rows, units)
        return self.out(joined), known[:, rows:]


@final
class Transformer(Network):
    """`layers` blocks of attention and a perceptron, normalised first; memory: keys and values.

    Each block sees the `window` last rows of the block before, and remembers `window` - 1 of them.

    Raises
    ------
    RequestError
        where the heads do not divide the units.
    """

    name: ClassVar[str] = "transformer"
    starts_settled = True

    def __init__(self, scaling: Scaling, *, units: int = 32, layers: int = 2, heads: int = 4, window: int = 30) -> None:
        if units % heads:
            raise RequestError(
                f"network transformer: expected units that the heads divide, got {units} units, {heads} heads"
            )
        super().__init__(scaling, {"units": units, "layers": layers, "heads": heads, "window": window})
        self.lift = nn.Linear(self.width, units)
        self.attention = nn.ModuleList(_Attention(units, heads, window) for _ in range(layers))
        self.perceptrons = nn.ModuleList(
            nn.Sequential(nn.Linear(units, 2 * units), nn.GELU(), nn.Linear(2 * units, units)) for _ in range(layers)
        )
        self.before = nn.ModuleList(nn.LayerNorm(units) for _ in range(2 * layers))
        self.head = quiet_head(units)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        signal = self.lift(standardised)
        kept: list[Tensor] = []
        for k, (attention, perceptron) in enumerate(zip(self.attention, self.perceptrons, strict=True)):
            mixed, remembered = attention(self.before[2 * k](signal), None if memory is None else memory[k])
            kept.append(remembered)
            signal = signal + mixed
            signal = signal + perceptron(self.before[2 * k + 1](signal))
        return self.head(signal), tuple(kept)
