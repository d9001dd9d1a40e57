"""Gaussian processes of the acceleration, alone and beside a vehicle."""

import warnings
from typing import Any

import numpy as np
import torch
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from torch import Tensor, nn

from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model

from .cases import Data
from .descent import Rows, as_model, joined, kept_as_is, motions_of

SAMPLE = 400
"""Rows drawn from the training run: a fit of three axes then takes some seconds."""


class Mean(nn.Module):
    """The mean of three Gaussian processes, as torch evaluates it."""

    def __init__(self, rows: Rows, fitted: list[GaussianProcessRegressor], known: Tensor) -> None:
        super().__init__()
        kernels: list[Any] = [one.kernel_ for one in fitted]
        self.mean, self.scale = kept_as_is(rows.seen.mean(dim=0).numpy()), kept_as_is(rows.seen.std(dim=0).numpy())
        self.known = kept_as_is(known.numpy())
        self.lengths = kept_as_is(np.array([kernel.k1.k2.length_scale for kernel in kernels]))
        self.weights = kept_as_is(
            np.array([k.k1.k1.constant_value * one.alpha_ for k, one in zip(kernels, fitted, strict=True)])
        )
        self.spread = kept_as_is(np.array([one._y_train_std for one in fitted]))
        self.middle = kept_as_is(np.array([one._y_train_mean for one in fitted]))

    def forward(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        """The mean (..., 3) at velocities and thrusts."""
        seen = (torch.cat((velocity, thrust), dim=-1) - self.mean) / self.scale
        flat, said = seen.reshape(-1, seen.shape[-1]), []
        for length, weight in zip(self.lengths, self.weights, strict=True):
            apart = torch.cdist(flat / length, self.known / length)
            said.append(torch.exp(-0.5 * apart.square()) @ weight)
        found = torch.stack(said, dim=-1) * self.spread + self.middle
        return found.reshape(*velocity.shape[:-1], 3)


def gaussian(data: Data, vehicle: Vehicle, name: str, seed: int, *, pure: bool) -> Model:
    """A Gaussian process for each axis (Rasmussen and Williams 2006, algorithm 2.1), on a random part of the rows.

    A squared-exponential kernel with a length for each input, and noise; both by the marginal likelihood, so that no
    validation part is needed.
    """
    rows = joined(motions_of(vehicle, data.whole, pure))
    drawn = np.random.default_rng([seed, 37]).choice(len(rows.target), min(SAMPLE, len(rows.target)), replace=False)
    seen = ((rows.seen - rows.seen.mean(dim=0)) / rows.seen.std(dim=0))[drawn]
    lengths: Any = np.full(seen.shape[1], 2.0)  # annotated as a number alone
    fitted = []
    for column in rows.target[drawn].T:
        kernel = ConstantKernel(1.0) * RBF(lengths, (0.1, 1e3)) + WhiteKernel(0.1, (1e-6, 10.0))
        process = GaussianProcessRegressor(kernel, normalize_y=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is an input that tells nothing
            fitted.append(process.fit(seen.numpy(), column.numpy()))
    return as_model(Mean(rows, fitted, seen), vehicle, data.whole, name, pure)
