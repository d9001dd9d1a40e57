"""A correction that cannot create energy, of the present state and thrust alone."""

from typing import ClassVar, final

from torch import Tensor

from .base import Memory, Scaling
from .lossy import Dissipation


@final
class Dissipative(Dissipation):
    """See `Dissipation`."""

    name: ClassVar[str] = "dissipative"

    def __init__(self, scaling: Scaling, *, units: int = 128, layers: int = 1, gain: float = 0.5) -> None:
        super().__init__(scaling, units, layers, gain)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        return self.said(self.force(self.body(standardised), inputs)), ()
