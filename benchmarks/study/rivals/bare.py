"""A residual as the literature trains it: undertow's network and data, and no law in its loss or in its choice."""

from copy import deepcopy
from math import cos, pi

import numpy as np
import torch

from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.training.epochs import adam, one_pass
from undertow.residuals.training.preparation import prepare_training
from undertow.residuals.training.training_settings import Choice, TrainingSettings

from .cases import Data
from .descent import reproducible

EPOCHS = 40
"""Of all networks of undertow here, so that a seed of a case takes some minutes; `train` has 150."""


def bare(choice: Choice, data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """A hybrid that is fitted to the error of the acceleration alone, and counts whole everywhere.

    Kept is the average of the weights, as `train` has it, after the epoch of the least validation error. `train` asks
    rollouts, too, and may keep the vehicle alone.
    """
    settings = TrainingSettings(
        seed=seed, epochs=EPOCHS, patience=EPOCHS, device="cpu", trust=False, lambda_phys=0.0, lambda_smooth=0.0
    )
    with reproducible(seed) as draw:
        prepared = prepare_training(data.split, vehicle, choice, settings)
        network, mean = prepared.network, deepcopy(prepared.network)
        optimiser = adam(network, settings)
        best, kept = np.inf, deepcopy(mean)
        for epoch in range(1, EPOCHS + 1):
            share = 0.5 * (1.0 + cos(pi * (epoch - 1) / (EPOCHS - 1)))
            optimiser.param_groups[0]["lr"] = settings.learning_rate * (0.01 + 0.99 * share)
            follow = 1.0 - min(settings.averaging, epoch / (epoch + 0.1))

            @torch.no_grad()
            def average(follow: float = follow) -> None:
                for slow, now in zip(mean.parameters(), network.parameters(), strict=True):
                    slow.lerp_(now, follow)

            one_pass(network, prepared.objective, optimiser, settings, draw, average)
            error = prepared.judge.error(mean)
            if error < best:
                best, kept = error, deepcopy(mean)
    return NetworkModel(vehicle, kept, prepared.time_step, name=name)
