"""The interface of a network: a causal map from inputs in SI units to a correction of the acceleration in SI units.

Standardisation is inside, with constants as buffers. Memory (a recurrent state, past rows of a convolution) is a tuple
of tensors: a call with the memory of the call before goes on where that one ended, whatever the number of rows.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
import torch
from torch import Tensor, nn

from ...measurements.preparation.resampling import Standardisation
from ...physics.motion import Array
from .trust import Gain, Trust

Memory = tuple[Tensor, ...]
"""What a network remembers between calls, first dimension the batch; empty for one without memory.

Its shapes depend on the network and the batch, not on how many rows have gone by, so that batches can be joined."""

BLOCK = 256
"""Rows that go through a network at once; see `through`."""


@dataclass(frozen=True, slots=True, eq=False)
class Scaling:
    """The physical constants that a network needs.

    Attributes
    ----------
    inputs : names, mean and scale of the inputs, in their units; the first three are u, v [m/s] and r [rad/s]
    output : (3,) scale of the correction [m/s^2, m/s^2, rad/s^2]
    mass : (3, 3) mass matrix [kg, kg m, kg m^2], by which a force becomes an acceleration
    reach : (3, drives) force that each drive input gives per unit of it [N/N, N/N, N m/N]: the thruster matrix
    """

    inputs: Standardisation
    output: Array
    mass: Array
    reach: Array

    @property
    def drives(self) -> int:
        """Number of inputs that are thrusts or commands; they follow u, v, r."""
        return self.reach.shape[1]


@dataclass(frozen=True, slots=True)
class Grown:
    """A network that is fitted at once to all rows, and not by steps along a gradient.

    No law plays a part while it is, and no training goes on from it. `training.tabular_fit` knows how it is found.

    Attributes
    ----------
    parts : what it consists of, such as trees
    how : what is done to them, such as grown
    """

    parts: str
    how: str


class Network(nn.Module, ABC):
    """A causal network.

    Attributes
    ----------
    name : how the command line and the files call it
    grown : of a network that is grown and not trained; else None
    starts_settled : without a memory it says of its first row what it would say if that had lasted; a recurrence has to
        see a state for a while
    rests_on : what makes sure that it dissipates: `itself` by construction, `bounds` that `residuals.models.bounds` may
        find, or `nothing`
    scaling : physical constants
    options : what it was built with, by name
    gain : by which its correction is multiplied; None for one that is said whole everywhere
    """

    name: ClassVar[str]
    grown: ClassVar[Grown | None] = None
    starts_settled: ClassVar[bool] = False
    rests_on: ClassVar[Literal["itself", "bounds", "nothing"]] = "nothing"
    gain: Gain | None
    input_mean: Tensor
    input_scale: Tensor
    output_scale: Tensor

    def __init__(self, scaling: Scaling, options: dict[str, int | float]) -> None:
        super().__init__()
        self.scaling = scaling
        self.options = options
        self.gain = None
        inputs = scaling.inputs
        self.hold({"input_mean": inputs.mean, "input_scale": inputs.scale, "output_scale": scaling.output})

    def hold(self, constants: Mapping[str, Array], *, persistent: bool = True) -> None:
        """Keep constants as buffers in single precision.

        Parameters
        ----------
        constants : by name
        persistent : whether they stand among the weights of a file
        """
        for name, values in constants.items():
            self.register_buffer(name, torch.as_tensor(values, dtype=torch.float32), persistent=persistent)

    @property
    def width(self) -> int:
        """Number of inputs."""
        return len(self.scaling.inputs.names)

    def trust(self, given: Trust | None) -> None:
        """Let the correction be said by this gain, of velocities and thrusts; None: let it be said whole everywhere."""
        self.gain = None if given is None else Gain(given, 3 + self.scaling.drives).to(self.input_mean)

    @classmethod
    def alike(cls, rows: Array, reach: Array) -> Array:
        """Inputs (rows, inputs) in SI units, and below them those of which it says the same, by a thruster matrix."""
        del reach
        return rows

    def known(self, rows: Array) -> Array:
        """Velocities and thrusts that a training on inputs (rows, inputs) in standard deviations covers."""
        inputs, drives = self.scaling.inputs, self.scaling.drives
        told = self.alike(inputs.undo(rows), self.scaling.reach)
        return np.concatenate([rows, inputs.apply(told[len(rows) :])])[:, : 3 + drives]

    def plain(self) -> "Network":
        """The same correction by layers that exports and proofs know; itself, where it consists of these."""
        return self

    def forward(self, inputs: Tensor, memory: Memory | None = None) -> tuple[Tensor, Memory]:
        """Correction of the acceleration along rows of inputs.

        Parameters
        ----------
        inputs : (batch, rows, inputs) in SI units
        memory : of the rows before; None where there are none, as if the first row had lasted (or, in a recurrence,
            from a state of zero)

        Returns
        -------
        (correction, memory)
            (batch, rows, 3) [m/s^2, m/s^2, rad/s^2], and what to remember after the last row
        """
        seen = (inputs - self.input_mean) / self.input_scale
        said, remembered = self.correct(seen, inputs, memory)
        if self.gain is not None:
            said = said * self.gain(seen)
        return said * self.output_scale, remembered

    @abstractmethod
    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """Correction in units of `scaling.output`, (batch, rows, 3), and the memory after the last row.

        Parameters
        ----------
        standardised, inputs : (batch, rows, inputs), without and with their units
        memory : as `forward` has it
        """


def through(network: Network, inputs: Tensor, memory: Memory | None = None) -> tuple[Tensor, Memory | None]:
    """Send many rows through a network block by block, so that attention costs no more than a block squared.

    Parameters
    ----------
    inputs : (batch, rows, inputs) in SI units, at least one row
    memory : of the rows before

    Returns
    -------
    (correction, memory)
        (batch, rows, 3) [m/s^2, m/s^2, rad/s^2], as one call would give it
    """
    parts = []
    for block in inputs.split(BLOCK, dim=1):
        part, memory = network(block, memory)
        parts.append(part)
    return torch.cat(parts, dim=1), memory


def quiet_head(inputs: int, outputs: int = 3) -> nn.Linear:
    """Linear layer, to the three axes if nothing is said, that starts at zero: training starts from the physics alone.

    Parameters
    ----------
    inputs, outputs : sizes
    """
    head = nn.Linear(inputs, outputs)
    nn.init.zeros_(head.weight)
    nn.init.zeros_(head.bias)
    return head


def fixed(values: Tensor) -> nn.Parameter:
    """A parameter that is found at once, and that no step along a gradient moves."""
    return nn.Parameter(values, requires_grad=False)


def hidden_layers(inputs: int, units: int, layers: int, activation: Callable[[], nn.Module] = nn.ReLU) -> nn.Sequential:
    """Fully connected layers, ReLU unless said otherwise.

    Parameters
    ----------
    inputs, units, layers : sizes
    activation : made anew for each layer
    """
    parts: list[nn.Module] = []
    for _ in range(layers):
        parts += [nn.Linear(inputs, units), activation()]
        inputs = units
    return nn.Sequential(*parts)
