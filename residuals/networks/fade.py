"""Where a network knows its way: the reach of its training, beyond which its correction fades to nothing.

The reach is a polytope: the least and the most that each input, and each sum and difference of two, had in training.
A box alone would call full ahead at full astern thrust known to a boat that met the two apart.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import final

import numpy as np
import torch
from torch import Tensor, nn

from ...physics.frames import Array

NARROW = 0.5
"""Distance at which nothing is left of a correction where its log does not say that it holds farther [deviations].
Chosen by seed 100 of `benchmarks/fading.py`: beside the corrected model of one run hybrids were at most 1 % worse on a
harder one at 0.5, 2 % at 0.75, 5 % at 1, 19 % at 1.5."""
_ROUNDING = 1e-5
"""Deviations that training may be left by, so that rounding in single precision fades nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """What a training has seen, in standard deviations of each input.

    Attributes
    ----------
    fade : distance beyond, root of the squared excess over all sides, at which nothing is left [deviations]
    lower, upper : (directions,) least and most along each of `directions`, the inputs first
    """

    fade: float
    lower: Array
    upper: Array

    @classmethod
    def of(cls, seen: Array, fade: float) -> "Reach":
        """The reach of standardised inputs (rows, inputs)."""
        along = seen @ directions(seen.shape[-1]).T
        return cls(fade, along.min(axis=0) - _ROUNDING, along.max(axis=0) + _ROUNDING)


def directions(size: int) -> Array:
    """Unit vectors along each axis, and the sum and difference of each two, (size + size (size - 1), size)."""
    axes = np.eye(size)
    pairs = [axes[i] + sign * axes[j] for i, j in combinations(range(size), 2) for sign in (1.0, -1.0)]
    return np.concatenate([axes, np.sqrt(0.5) * np.array(pairs).reshape(-1, size)])


@final
class Fade(nn.Module):
    """The weight of a correction: 1 within the reach, (1 - (distance / fade)^2)^2 beyond it, and 0 from `fade` on.

    Its slope is continuous. Its constants are no weights: they do not stand among those of the network.

    Parameters
    ----------
    reach : of the training
    inputs : how many of the network's inputs, from the first, are known: velocities and thrusts
    """

    def __init__(self, reach: Reach, inputs: int) -> None:
        super().__init__()
        self.reach, self.inputs = reach, inputs
        along = directions(inputs)
        sides = {"rows": np.concatenate([along, -along]), "ends": np.concatenate([reach.upper, -reach.lower])}
        for label, values in sides.items():
            self.register_buffer(label, torch.as_tensor(values, dtype=torch.float32), persistent=False)

    @property
    def box(self) -> tuple[Array, Array]:
        """Least and most of each known input in training [deviations]."""
        return self.reach.lower[: self.inputs], self.reach.upper[: self.inputs]

    def squared_distance(self, standardised: Tensor) -> Tensor:
        """Squared distance of inputs (..., inputs or more) beyond the reach (...) [deviations squared]."""
        over = standardised[..., : self.inputs] @ self.get_buffer("rows").mT - self.get_buffer("ends")
        return torch.relu(over).square().sum(dim=-1)

    def forward(self, standardised: Tensor) -> Tensor:
        """The weight (..., 1) at inputs (..., inputs or more)."""
        left = 1.0 - self.squared_distance(standardised) / self.reach.fade**2
        return torch.relu(left).square()[..., None]
