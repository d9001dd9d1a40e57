"""Networks that are trained through rollouts of their own: a neural ODE and a port-Hamiltonian network."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn

from undertow.physics.integration import runge_kutta
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model

from .cases import Data
from .descent import Perceptron, Rows, as_model, descend, joined, motions_of, reproducible, squared_error

STARTS = 32
"""Rollouts of a step."""
ONE_STEP, SHORT, LONG = 800, 150, 100
"""Steps on the accelerations themselves, which find a start, and through rollouts of 1 s and of 2 s."""
_GENTLE = 3e-3
"""Learning rate of those through rollouts."""
_LEAST = 1e-3
"""Added to the factor of a mass, so that it has an inverse."""


_runge_kutta: Any = runge_kutta  # annotated for arrays; what acts on them acts on tensors, too


class Free(nn.Module):
    """nu_dot = f(nu, T), a perceptron."""

    def __init__(self, rows: Rows) -> None:
        super().__init__()
        self.net = Perceptron(rows.seen, rows.unit)

    def forward(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        """Acceleration (..., 3)."""
        return self.net(torch.cat((velocity, thrust), dim=-1))


class PortHamiltonian(nn.Module):
    """M nu_dot = (J(nu) - R(nu)) nu + G T, with M and R positive definite and J skew-symmetric.

    The energy is H = nu^T M nu / 2, so that nu = dH/dp. M and G are numbers, J and the factor of R a perceptron of nu.
    """

    def __init__(self, rows: Rows) -> None:
        super().__init__()
        speeds = rows.velocity.square().mean(dim=0).sqrt().clamp_min(1e-9)
        self.net = Perceptron(rows.velocity, torch.ones(9, dtype=torch.float64))
        self.mass = nn.Parameter(torch.eye(3, dtype=torch.float64)[torch.tril_indices(3, 3).unbind()])
        self.gain = nn.Parameter(torch.zeros(3, rows.thrust.shape[1], dtype=torch.float64))
        push = rows.thrust.square().mean().sqrt().clamp_min(1e-9)
        for name, values in (("speeds", speeds), ("push", push), ("unit", rows.unit)):
            self.register_buffer(name, values.clone())

    def forward(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        """Acceleration (..., 3)."""
        speeds, push, unit = (self.get_buffer(name) for name in ("speeds", "push", "unit"))
        said, (x, y, z) = self.net(velocity).unbind(-1), (velocity / speeds).unbind(-1)
        along = said[0] * x + said[1] * y + said[3] * z, said[2] * y + said[4] * z, said[5] * z  # L^T nu
        damped = (
            said[0] * along[0],
            said[1] * along[0] + said[2] * along[1],
            said[3] * along[0] + said[4] * along[1] + said[5] * along[2],
        )
        turned = said[6] * y + said[7] * z, said[8] * z - said[6] * x, -said[7] * x - said[8] * y
        force = torch.stack(turned, dim=-1) - torch.stack(damped, dim=-1) + (thrust / push) @ self.gain.mT
        factor = torch.zeros(3, 3, dtype=velocity.dtype)
        factor[tuple(torch.tril_indices(3, 3))] = self.mass
        inverse = torch.cholesky_inverse(factor + _LEAST * torch.eye(3, dtype=velocity.dtype))
        # On speeds in units of the usual ones; the ratio on both sides keeps M symmetric and makes ones a fair start.
        ratio = (unit / speeds).sqrt()
        return (force * ratio) @ inverse * ratio * speeds


def neural_ode(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """A neural ODE (Chen, Rubanova, Bettencourt and Duvenaud 2018), trained through Runge-Kutta steps."""
    return _trained(Free, data, vehicle, name, seed)


def port_hamiltonian(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """A port-Hamiltonian network (Desai et al. 2021, doi:10.1103/PhysRevE.104.034312), trained like the neural ODE.

    Its form is that of van der Schaft and Jeltsema (2014, doi:10.1561/2600000002). It has no port for a constant force,
    and can therefore not hold a current.
    """
    return _trained(PortHamiltonian, data, vehicle, name, seed)


def _trained(made: type[nn.Module], data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    parts, held = (motions_of(vehicle, part, pure=True) for part in (data.split.train, data.split.validation))
    step = data.whole.motions[0].time_step
    known, unseen = joined(parts), joined(held)
    spread = known.velocity.std(dim=0).clamp_min(1e-9)
    with reproducible(seed) as draw:
        module = made(known)
        descend(
            module,
            lambda: squared_error(module, known, known.unit),
            lambda: float(squared_error(module, unseen, known.unit)),
            ONE_STEP,
        )
        every = _starts(held, round(2.0 / step))[::5]
        for steps, seconds in ((SHORT, 1.0), (LONG, 2.0)):
            rows = round(seconds / step)
            starts = _starts(parts, rows)

            def loss(rows: int = rows, starts: Tensor = starts) -> Tensor:
                chosen = starts[torch.randint(len(starts), (STARTS,), generator=draw)]
                return _astray(module, known, chosen, rows, step, spread)

            descend(
                module,
                loss,
                lambda: float(_astray(module, unseen, every, round(2.0 / step), step, spread)),
                steps,
                _GENTLE,
            )
    return as_model(module, vehicle, data.whole, name, pure=True)


def _starts(parts: Sequence[Rows], rows: int) -> Tensor:
    """Rows of the joined motions (starts,) that have so many rows of their own motion after them."""
    found, begun = [], 0
    for part in parts:
        found.append(begun + torch.arange(max(0, len(part.target) - rows)))
        begun += len(part.target)
    return torch.cat(found)


def _astray(module: nn.Module, known: Rows, starts: Tensor, rows: int, step: float, spread: Tensor) -> Tensor:
    """Mean squared error of the velocities along rollouts, in their spread."""
    taken = torch.arange(rows + 1)[:, None] + starts
    velocity, thrust = known.velocity[taken], known.thrust[taken]
    state, error = velocity[0], torch.zeros((), dtype=velocity.dtype)

    def slope(state: Tensor, pushed: Tensor) -> Tensor:
        return module(state, pushed)

    for k in range(rows):
        ends = thrust[k], 0.5 * (thrust[k] + thrust[k + 1]), thrust[k + 1]
        state = _runge_kutta(slope, state, ends, step)
        error = error + ((state - velocity[k + 1]) / spread).square().mean()
    return error / rows
