"""Means of Gaussian processes (Rasmussen and Williams 2006) as plain arrays: smooth, and asked like any network."""

from typing import ClassVar

import torch
from torch import Tensor, nn

from ...physics.motion import Array
from .base import Grown, Memory, Network, Scaling, fixed

_ROWS = 2048
"""Rows whose bells are held in memory at once."""


class GaussianProcess(Network):
    """Sum of `units` bells for each axis, each at a row that training has seen; without memory.

    With centres c_j and, for each axis, a length l_i of each input, it says sum_j w_j exp(-1/2 sum_i ((s_i - c_ji) /
    l_i)^2) at standardised inputs s: the squared-exponential kernel of several lengths, Rasmussen and Williams 2006,
    equation 5.1. The constants are found by `training.tabular_fit`, not by steps along a gradient; before, it
    says nothing. It has no constant: far from all centres it says nothing again.
    """

    name: ClassVar[str] = "gp"
    grown: ClassVar[Grown | None] = Grown("Gaussian processes", "fitted")

    def __init__(self, scaling: Scaling, *, units: int = 400) -> None:
        super().__init__(scaling, {"units": units})
        self.centres = fixed(torch.zeros(units, self.width))
        self.sharpness = fixed(torch.zeros(3, self.width))  # 1 / l_i, so that 0 is an input that tells nothing
        # What the correction is proportional to, as in the other networks.
        self.head = nn.ParameterDict({"weight": fixed(torch.zeros(3, units))})

    def with_images(self, rows: Array, wanted: Array) -> tuple[Array, Array]:
        """Training rows, and those that follow from them; here there are none.

        Parameters
        ----------
        rows : standardised inputs (rows, inputs)
        wanted : targets (rows, 3) in units of `scaling.output`
        """
        return rows, wanted

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        seen = standardised.reshape(-1, standardised.shape[-1])
        said = torch.cat([self._said(some) for some in seen.split(_ROWS)])
        return said.reshape(*standardised.shape[:-1], 3), ()

    def _said(self, seen: Tensor) -> Tensor:
        """The sums (rows, 3) at standardised inputs (rows, inputs)."""
        sharpness = self.sharpness[:, None]
        # By differences: products of matrices lose digits where a row is near a centre.
        apart = torch.cdist(seen * sharpness, self.centres * sharpness, compute_mode="donot_use_mm_for_euclid_dist")
        said = torch.exp(-0.5 * apart.square()) @ self.head["weight"][..., None]
        return said[..., 0].T
