"""Hybrids of the literature that none of undertow's networks is: a kinetic prior, physical priors, and a PINN."""

import numpy as np
import torch
from torch import Tensor, nn

from undertow.physics.forces import ForceEquation
from undertow.physics.momentum_balance import mass_matrix, thruster_matrix
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model, VehicleModel

from .cases import Data
from .descent import Perceptron, Rows, as_model, descend, joined, kept_as_is, motions_of, reproducible, squared_error

POWER = 1.0
"""Weight of the power that a correction without thrust must not give, squared, in units of the usual one."""
MOST = 3.0
"""Largest correction, in units of what the vehicle leaves unexplained on each axis."""
EQUATION = 1.0
"""Weight of the equation of motion in the loss of the PINN."""
STATES = 256
"""Random states at which each step asks a law: the power of a correction, or the equation of motion."""
TRAINED: tuple[str, ...] = ("X_udot", "Y_vdot", "N_rdot", "X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr")
"""Coefficients that are trained with the PINN; all of them are negative."""


class Informed(nn.Module):
    """A perceptron that sees the acceleration of a vehicle beside velocities and thrusts, and gives all of it."""

    def __init__(self, vehicle: Vehicle, rows: Rows) -> None:
        super().__init__()
        self.equation = ForceEquation(vehicle)
        self.net = Perceptron(torch.cat((rows.seen, self.prior(rows.velocity, rows.thrust)), dim=-1), rows.unit)

    def prior(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        """Acceleration of the vehicle, (..., 3), on a heading of north."""
        states, north = velocity.unbind(-1), torch.zeros_like(velocity[..., 0])
        force = self.equation.force(states, north, torch.stack(thrust.unbind(-1)))  # type: ignore[arg-type]
        said = self.equation.acceleration(force, states, states, north)  # type: ignore[arg-type]
        return torch.stack(said, dim=-1)  # type: ignore[arg-type]

    def forward(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        """Acceleration (..., 3)."""
        return self.net(torch.cat((velocity, thrust, self.prior(velocity, thrust)), dim=-1))


def kinetic_prior(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """A feed-forward net with a kinetic prior, after Lim and Oh: it sees what the calibrated vehicle says.

    Their paper is not at hand; that the prior is an input, and not a summand, is our reading.
    """
    known, unseen = (joined(motions_of(vehicle, part, pure=True)) for part in (data.split.train, data.split.validation))
    with reproducible(seed):
        module = Informed(vehicle, known)
        descend(
            module,
            lambda: squared_error(module, known, known.unit),
            lambda: float(squared_error(module, unseen, known.unit)),
        )
    return as_model(module, vehicle, data.whole, name, pure=True)


class Priors(nn.Module):
    """A correction that is the same for port and starboard, nothing at rest without thrust, and bounded.

    Parameters
    ----------
    mirror : (thrusters,) number of the thruster on the other side, by which a motion to port is one to starboard
    """

    def __init__(self, rows: Rows, mirror: list[int]) -> None:
        super().__init__()
        self.net, self.mirror = Perceptron(rows.seen, torch.ones(3, dtype=torch.float64)), mirror
        self.sides = kept_as_is(np.array([1.0, -1.0, -1.0]))
        self.register_buffer("unit", rows.unit.clone())

    def forward(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        """Correction (..., 3)."""
        said = self._even(velocity, thrust) - self._even(velocity.new_zeros(3), thrust.new_zeros(thrust.shape[-1]))
        return MOST * torch.tanh(said / MOST) * self.get_buffer("unit")

    def _even(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        own = self.net(torch.cat((velocity, thrust), dim=-1))
        other = self.net(torch.cat((velocity * self.sides, thrust[..., self.mirror]), dim=-1))
        return 0.5 * (own + other * self.sides)


def mirrored(vehicle: Vehicle) -> list[int]:
    """Of each thruster, the one that does on the other side what it does on its own, as near as there is one."""
    reach = thruster_matrix(vehicle)
    image = reach * np.array([[1.0], [-1.0], [-1.0]])
    return [int(np.argmin(np.abs(reach - column[:, None]).sum(axis=0))) for column in image.T]


def physical_priors(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """A residual constrained by physical priors, after Fang et al.: symmetry, rest, bounds, and no power of its own.

    Their paper is not at hand; which priors these are is our reading. Symmetry, rest and the bound hold by
    construction; power without thrust is a penalty at random training rows.
    """
    known, unseen = (
        joined(motions_of(vehicle, part, pure=False)) for part in (data.split.train, data.split.validation)
    )
    mass = torch.as_tensor(mass_matrix(vehicle))
    usual = ((known.velocity @ mass) * known.target).sum(dim=-1).square().mean().sqrt().clamp_min(1e-12)
    with reproducible(seed) as draw:
        module = Priors(known, mirrored(vehicle))

        def loss() -> Tensor:
            drawn = known.velocity[torch.randint(len(known.velocity), (STATES,), generator=draw)]
            idle = module(drawn, known.thrust.new_zeros(STATES, known.thrust.shape[1]))
            power = ((drawn @ mass) * idle).sum(dim=-1) / usual
            return squared_error(module, known, known.unit) + POWER * torch.relu(power).square().mean()

        descend(module, loss, lambda: float(squared_error(module, unseen, known.unit)))
    return as_model(module, vehicle, data.whole, name, pure=False)


class Informing(nn.Module):
    """A perceptron of the acceleration, and the coefficients of an equation of motion that it is to keep."""

    def __init__(self, vehicle: Vehicle, rows: Rows) -> None:
        super().__init__()
        self.net = Perceptron(rows.seen, rows.unit)
        value, mass = vehicle.value, mass_matrix(vehicle)
        speeds = rows.velocity.square().mean(dim=0).sqrt().numpy()
        force = np.abs(thruster_matrix(vehicle) @ rows.thrust.T.numpy()).max(axis=1)
        force = np.maximum(force, 0.1 * force[0])
        usual = [0.1 * mass[k, k] for k in range(3)]
        usual += [x for k in range(3) for x in (force[k] / speeds[k], force[k] / speeds[k] ** 2)]
        start = np.array([max(-value(symbol) / x, 0.05) for symbol, x in zip(TRAINED, usual, strict=True)])
        self.coefficients = nn.Parameter(torch.as_tensor(np.log(np.expm1(start))))
        self.usual = kept_as_is(np.array(usual))
        self.body = kept_as_is(mass_matrix(vehicle.with_values(dict.fromkeys(TRAINED[:3], 0.0))))
        self.reach = kept_as_is(thruster_matrix(vehicle))
        self.scale = kept_as_is(np.diag(mass) * rows.unit.numpy())

    @property
    def values(self) -> Tensor:
        """The coefficients, (9,)."""
        return -nn.functional.softplus(self.coefficients) * self.usual

    def forward(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        """Acceleration (..., 3)."""
        return self.net(torch.cat((velocity, thrust), dim=-1))

    def broken(self, velocity: Tensor, thrust: Tensor) -> Tensor:
        """Mean square of M nu_dot + C(nu) nu + D(nu) nu - B T, each axis in units of its usual force."""
        found = self.values
        mass, (u, v, r) = self.body - torch.diag(found[:3]), velocity.unbind(-1)
        along, across = mass[0, 0] * u + mass[0, 2] * r, mass[1, 1] * v + mass[1, 2] * r
        turning = torch.stack((-across * r, along * r, across * u - along * v), dim=-1)
        damping = found[3::2] * velocity + found[4::2] * velocity.abs() * velocity
        left = self(velocity, thrust) @ mass.mT + turning - damping - thrust @ self.reach.mT
        return (left / self.scale).square().mean()


def informed(data: Data, vehicle: Vehicle, name: str, seed: int, *, equation: bool) -> Model:
    """A PINN (Xu, Han, Cheng, Cheng and Ge 2022, doi:10.3390/jmse10020148), or the equation that is trained with it.

    Its loss is the error of the acceleration and the equation of motion, with linear and quadratic damping on each
    axis, at the rows and at random states of their envelope. Its unknowns are `TRAINED`.
    """
    known, unseen = (joined(motions_of(vehicle, part, pure=True)) for part in (data.split.train, data.split.validation))
    with reproducible(seed) as draw:
        module = Informing(vehicle, known)
        low, high = known.seen.min(dim=0).values, known.seen.max(dim=0).values

        def loss() -> Tensor:
            drawn = low + (high - low) * torch.rand(STATES, len(low), generator=draw, dtype=low.dtype)
            along = module.broken(known.velocity, known.thrust) + module.broken(drawn[:, :3], drawn[:, 3:])
            return squared_error(module, known, known.unit) + 0.5 * EQUATION * along

        descend(module, loss, lambda: float(squared_error(module, unseen, known.unit)))
    if equation:
        found = dict(zip(TRAINED, module.values.tolist(), strict=True))
        return VehicleModel(vehicle.with_values(found), name, parameters=len(found))
    return as_model(module, vehicle, data.whole, name, pure=True)
