"""Accelerations by torch: rows to learn from, descent that keeps what validates best, and models made of it."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from math import cos, pi
from typing import ClassVar, NamedTuple, final

import numpy as np
import torch
from torch import Tensor, nn

from undertow.measurements.preparation.prepare import DataSet
from undertow.measurements.preparation.resampling import Standardisation
from undertow.physics.forces import through_water
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import NetworkModel, one_thread, scaling_of
from undertow.residuals.networks.base import Memory, Network, Scaling
from undertow.residuals.scores import target_acceleration

from .stepped import filtered_thrust

STEPS, RATE, DECAY = 800, 2e-2, 1e-4
"""Steps over all rows at once, the learning rate at first (a cosine to a hundredth), and AdamW's decay of weights."""
EVERY = 25
"""Steps from one look at the validation part to the next."""


class Rows(NamedTuple):
    """Rows of motions.

    Attributes
    ----------
    velocity : (n, 3) relative to the vehicle's water [m/s, m/s, rad/s]
    thrust : (n, thrusters) [N]
    target : (n, 3) acceleration, or what a vehicle leaves of it [m/s^2, m/s^2, rad/s^2]
    """

    velocity: Tensor
    thrust: Tensor
    target: Tensor

    @property
    def seen(self) -> Tensor:
        """Velocities and thrusts side by side."""
        return torch.cat((self.velocity, self.thrust), dim=-1)

    @property
    def unit(self) -> Tensor:
        """Root mean square of the target on each axis, (3,)."""
        return self.target.square().mean(dim=0).sqrt().clamp_min(1e-9)


def motions_of(vehicle: Vehicle, data: DataSet, pure: bool) -> list[Rows]:
    """The rows of each motion, filtered alike; of a hybrid the target is what the vehicle leaves."""
    return [
        Rows(
            *map(
                torch.as_tensor,
                (
                    np.stack(through_water(vehicle, motion), axis=-1),
                    filtered_thrust(vehicle, motion, data),
                    target_acceleration(vehicle, motion, data, pure),
                ),
            )
        )
        for motion in data.motions
    ]


def joined(parts: Sequence[Rows]) -> Rows:
    """All rows, one motion below the other."""
    return Rows(*(torch.cat(part) for part in zip(*parts, strict=True)))


class Perceptron(nn.Module):
    """Two layers of 64 tanh on standardised inputs, its outputs in units of `unit`."""

    def __init__(self, seen: Tensor, unit: Tensor, units: int = 64) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Linear(seen.shape[-1], units), nn.Tanh(), nn.Linear(units, units), nn.Tanh(), nn.Linear(units, len(unit))
        ).double()
        for name, values in (("mean", seen.mean(dim=0)), ("scale", seen.std(dim=0).clamp_min(1e-9)), ("unit", unit)):
            self.register_buffer(name, values.clone())

    def forward(self, seen: Tensor) -> Tensor:
        """Outputs (..., outputs) of inputs (..., inputs)."""
        mean, scale, unit = (self.get_buffer(name) for name in ("mean", "scale", "unit"))
        return self.layers((seen - mean) / scale) * unit


@contextmanager
def reproducible(seed: int) -> Iterator[torch.Generator]:
    """Weights by a seed, on one thread; torch is as before afterwards. Gives what draws batches."""
    with torch.random.fork_rng(), one_thread():
        torch.manual_seed(seed)
        yield torch.Generator().manual_seed(seed)


def descend(
    module: nn.Module, loss: Callable[[], Tensor], judge: Callable[[], float], steps: int = STEPS, rate: float = RATE
) -> None:
    """AdamW on a loss; the module ends with the weights at which the judge found least."""
    optimiser = torch.optim.AdamW(module.parameters(), rate, weight_decay=DECAY)
    best, kept = np.inf, deepcopy(module.state_dict())
    for step in range(steps + 1):
        if step % EVERY == 0 or step == steps:
            with torch.no_grad():
                error = judge()
            if error < best:
                best, kept = error, deepcopy(module.state_dict())
        optimiser.param_groups[0]["lr"] = rate * (0.01 + 0.495 * (1.0 + cos(pi * step / steps)))
        optimiser.zero_grad()
        value = loss()
        if not torch.isfinite(value):
            break
        value.backward()
        nn.utils.clip_grad_norm_(module.parameters(), 1.0)
        optimiser.step()
    module.load_state_dict(kept)


def squared_error(module: nn.Module, rows: Rows, unit: Tensor) -> Tensor:
    """Mean squared error of the accelerations, each axis in its unit."""
    return ((module(rows.velocity, rows.thrust) - rows.target) / unit).square().mean()


@final
class Says(Network):
    """A module of velocities and thrusts as one of undertow's networks, so that it is rolled out like these."""

    name: ClassVar[str] = "rival"

    def __init__(self, scaling: Scaling, module: nn.Module) -> None:
        super().__init__(scaling, {})
        self.module = module
        self.double()

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        drives = self.scaling.drives
        return self.module(inputs[..., :3], inputs[..., 3 : 3 + drives]) / self.get_buffer("output_scale"), ()


def as_model(module: nn.Module, vehicle: Vehicle, data: DataSet, name: str, pure: bool) -> NetworkModel:
    """A module in the place of a vehicle's acceleration, or beside it."""
    seen = joined(motions_of(vehicle, data, pure)).seen.numpy()
    scaling = scaling_of(vehicle, Standardisation.of(input_names(vehicle, False), seen), np.ones(3))
    return NetworkModel(vehicle, Says(scaling, module), data.motions[0].time_step, pure=pure, name=name)


def kept_as_is(values: Array) -> nn.Parameter:
    """Numbers that travel with a module and are not trained."""
    return nn.Parameter(torch.as_tensor(values, dtype=torch.float64), requires_grad=False)
