"""A port-Hamiltonian correction with a memory: what it takes from the hull it may give back, and never more."""

from math import exp, log10
from typing import ClassVar, final

import torch
from torch import Tensor, nn

from .base import Memory, Scaling, quiet_head
from .lossy import START, Dissipation

_SHORTEST, _LONGEST = 2.0, 60.0
"""Rows in which the first and the last store forget, at the start: 0.2 to 6 s at 10 Hz, evenly by their logarithm."""


@final
class PortHamiltonian(Dissipation):
    """The force of `Dissipation`, and -E y of stores y that follow E^T nu_r: water that the hull has set in motion.

    With y_dot = Lambda (E^T nu_r - y) and the energy H = (nu_r^T M nu_r + y^T Lambda^-1 y) / 2, dH/dt without thrust is
    -|L^T nu_r|^2 - |y|^2 <= 0, whatever the weights: hull and stores are joined by a skew-symmetric matrix, which does
    no work (van der Schaft and Jeltsema 2014, doi:10.1561/2600000002). In a state that lasts the stores take the power
    |E^T nu_r|^2. E depends on state and thrust through the layers; Lambda is diagonal, and the same everywhere. Rows
    are exact for E^T nu_r that is held between them: y_k = a y_(k-1) + (1 - a) E_k^T nu_k. Where the gain of the
    correction is small, stores take as much less as they push less, or they would give back within what they took for
    nothing beyond.

    Memory: the stores of the last row, (batch, stores).
    """

    name: ClassVar[str] = "port_hamiltonian"

    def __init__(
        self, scaling: Scaling, *, units: int = 128, layers: int = 1, gain: float = 0.5, stores: int = 12
    ) -> None:
        super().__init__(scaling, units, layers, gain, stores=stores)
        self.stores = stores
        self.ports = quiet_head(units, 3 * stores)
        rows = torch.logspace(log10(_SHORTEST), log10(_LONGEST), stores)
        self.kept = nn.Parameter(torch.logit(torch.exp(-1.0 / rows)))
        with torch.no_grad():
            own = torch.eye(3).repeat(1, -(-stores // 3))[:, :stores]  # each store begins with an axis of its own
            self.ports.bias.copy_((exp(START) * own).flatten())

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        hidden = self.body(standardised)
        ports = self.ports(hidden).unflatten(-1, (3, self.stores)) * self.factor_scale[:, None]
        wanted = (ports * inputs[..., :3, None]).sum(dim=-2)
        if self.gain is not None:
            wanted = wanted * self.gain(standardised)[..., :1]  # the same on all axes, see `training.probes`
        before = wanted[:, 0] if memory is None else memory[0]
        stored = _followed(nn.functional.logsigmoid(self.kept), wanted, before)
        back = (ports * stored[..., None, :]).sum(dim=-1)
        return self.said(self.force(hidden, inputs) - back), (stored[:, -1],)


def _followed(kept: Tensor, wanted: Tensor, before: Tensor) -> Tensor:
    """Stores (batch, rows, stores) that keep a share of themselves from row to row, and take the rest from `wanted`.

    `kept` is the logarithm of that share (stores,).
    """
    rows = torch.arange(wanted.shape[1], device=wanted.device)
    left = torch.exp(kept * (rows[:, None] + 1.0))  # of what was there after 1, 2, ... rows
    none, whole = torch.zeros_like(left), torch.ones_like(left[:1])
    since = torch.cat((none, whole, left[:-1]))  # of what comes later, now, and 1, 2, ... rows ago
    weight = since[rows[:, None] - rows + len(rows)]
    return torch.einsum("kjs,bjs->bks", weight, -torch.expm1(kept) * wanted) + left * before[:, None]
