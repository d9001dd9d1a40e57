"""Augmentation: noise on what the network sees, thrusters that push differently, and sister hulls beside it."""

from typing import final

import numpy as np
import torch
from torch import Tensor

from ...measurements.preparation.dataset import DataSet
from ...measurements.statistics.signals import noise_on_rows
from ...physics.errors import RequestError
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from ...physics.worlds.typical_effects import random_hull
from .training_settings import Augmentation, TrainingSettings
from .windows import windows_of

SISTERS = 8
"""Hulls among which the physics of a window is drawn."""


def sister_targets(
    data: DataSet,
    vehicle: Vehicle,
    settings: TrainingSettings,
    target: Array,
    *,
    pure: bool,
    heading: bool,
    warm_up: float,
) -> Array | None:
    """Targets (sisters, windows, rows, 3) beside the physics of random sister hulls; None where none are asked for.

    They are centred on `target`, that beside the vehicle itself (windows, rows, 3): the network cannot see which sister
    is meant, so their mean is what it learns.

    Raises
    ------
    RequestError
        for a pure network, which has no physics to vary.
    """
    spread = settings.augmentation.hull_spread
    if not spread:
        return None
    if pure:
        raise RequestError("augmentation: hull_spread varies the physics beside a network; a pure network has none")
    rng = np.random.default_rng([settings.seed, 12])
    hulls = [random_hull(vehicle, rng, spread) for _ in range(SISTERS)]
    cuts = [
        windows_of(
            data,
            hull,
            pure=False,
            heading=heading,
            seconds=settings.window,
            warm_up=warm_up,
            overlap=settings.overlap,
        )
        for hull in hulls
    ]
    targets = np.stack([c.target for c in cuts])
    return targets - targets.mean(axis=0) + target


def seen_noise(data: DataSet, settings: TrainingSettings, remembers: bool) -> Array:
    """White noise (3,) that is drawn onto the velocities that a network sees [m/s, m/s, rad/s]."""
    wanted = settings.augmentation
    noise = np.array([wanted.speed_noise, wanted.speed_noise, wanted.yaw_rate_noise])
    own = settings.sensor_noise * noise_on_rows(data.raw) if remembers else 0.0
    return np.hypot(noise, own)


@final
class Augmenter:
    """Draws the variants of a batch of windows.

    Parameters
    ----------
    wanted : how much of what
    noise : (3,) white noise on u, v [m/s] and r [rad/s]
    thrusters : number of thrust inputs
    targets : (sisters, windows, compared rows, 3), or None
    """

    def __init__(self, wanted: Augmentation, noise: Array, thrusters: int, targets: Tensor | None) -> None:
        self.wanted, self.thrusters, self.targets = wanted, thrusters, targets
        self.noise = torch.as_tensor(noise, dtype=torch.float32)

    def __call__(self, inputs: Tensor, target: Tensor, index: Tensor, draw: torch.Generator) -> tuple[Tensor, Tensor]:
        """Inputs (batch, rows, inputs) and target (batch, compared rows, 3) of the windows `index`, varied."""
        wanted, batch = self.wanted, inputs.shape[0]
        if self.noise.any():
            noise = torch.zeros(inputs.shape)
            noise[..., :3] = torch.randn((*inputs.shape[:2], 3), generator=draw) * self.noise
            inputs = inputs + noise.to(inputs)
        if wanted.thrust_spread:
            gain = torch.ones((batch, 1, inputs.shape[-1]))
            spread = 2.0 * torch.rand((batch, 1, self.thrusters), generator=draw) - 1.0
            gain[..., 3 : 3 + self.thrusters] += wanted.thrust_spread * spread
            inputs = inputs * gain.to(inputs)
        if self.targets is not None:
            sister = torch.randint(self.targets.shape[0], (batch,), generator=draw).to(index)
            target = self.targets[sister, index]
        return inputs, target
