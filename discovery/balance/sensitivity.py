"""Rollouts of models near one: an added force spreads through a rollout as its linearised equation says.

Along the rollouts of a base model, d(delta nu)/dt = A(t) delta nu + delta a(t), where delta a is what a change of the
model adds to the acceleration at the base model's states and A = da/dnu; in wind or current the heading is a state too,
and so is the wake memory. The steps of that equation are computed once a model, so that each of many candidate columns
costs a few products. Arrays have the rollouts last: matrices of three rows are multiplied for all of them at once.
"""

from collections.abc import Callable
from typing import final

import numpy as np

from ...physics.forces import ForceEquation, Triple, relative_velocity
from ...physics.frames import Array
from ...physics.matrices import mass_matrix
from ...physics.vehicle import Vehicle
from .forces_along import ForcesAlong, LatestTwo
from .starts import Rollings

_STEP = 1e-4
"""Change of a velocity or a heading by which a derivative is taken [m/s, m/s, rad/s, rad]."""


@final
class LinearisedRollouts:
    """Rollouts of models near a base model, to first order in the change of acceleration."""

    def __init__(self, data: Rollings, base: Vehicle) -> None:
        self._data, self._base = data, base
        heading, u, v, r = data.states(base).transpose(2, 1, 0)
        air = None if data.air is None else (data.air[0], data.air[1])
        self._along = ForcesAlong(heading, (u, v, r), air, data.minutes, data.responses, self._wake)
        self._accelerations: LatestTwo[Array] = LatestTwo(lambda vehicle: self._acceleration(vehicle)())
        self._steps: Propagation | None = None

    def change(self, one: Vehicle, other: Vehicle) -> Array:
        """Mean velocities of the bins of one model's rollouts less those of another's, (bins, 3, starts)."""
        inertia = mass_matrix(one)
        force = self._along.change(one, other) if np.array_equal(inertia, mass_matrix(other)) else None
        if force is None:
            return self._propagation.binned(self._accelerations.of(one) - self._accelerations.of(other))
        pushed = np.stack([np.broadcast_to(of_axis, self._along.heading.shape) for of_axis in force])
        return self._propagation.binned(np.tensordot(np.linalg.inv(inertia), pushed, 1))

    def transitions(self) -> Array:
        """How an error of the start velocity spreads along rollouts, (steps + 1, 3, 3, starts)."""
        return self._propagation.transitions()

    def _acceleration(self, vehicle: Vehicle) -> Callable[..., Array]:
        """(3, steps + 1, starts), with a step of a state, u, v, r, or psi, and everything else the same."""
        along, equation = self._along, ForceEquation(vehicle)
        force = along.evaluator(vehicle, equation)

        def acceleration(state: int = 0, step: float = 0.0) -> Array:
            moved = [x + step if k == state and step else x for k, x in enumerate((*along.velocity, along.heading))]
            velocity, heading = (moved[0], moved[1], moved[2]), moved[3]
            relative = relative_velocity(vehicle, heading, velocity, along.minutes)
            return np.stack(equation.acceleration(force(relative, heading), relative, velocity, heading))

        return acceleration

    def _wake(self, vehicle: Vehicle, relative: Triple) -> tuple[Array, Array]:
        """The wake memory from what it holds at the starts, (steps + 1, starts) each."""
        begin, constant = self._data.memory(vehicle), vehicle.values["memory_time"]
        sway, yaw = (_lagged(relative[1 + k], begin[:, k], constant, self._data.step) for k in (0, 1))
        return sway, yaw

    @property
    def _propagation(self) -> "Propagation":
        """Of the velocities, the wake memory's two states where there is one, and the heading where forces turn."""
        if self._steps is not None:
            return self._steps
        equation, acceleration = ForceEquation(self._base), self._acceleration(self._base)

        def derivative(state: int) -> Array:
            return (acceleration(state, _STEP) - acceleration(state, -_STEP)) / (2.0 * _STEP)

        with np.errstate(over="ignore", invalid="ignore"):
            by_heading = derivative(3) if equation.turns else np.zeros(0)
            turns = bool(by_heading.any())
            n = 3 + 2 * equation.has_memory + turns
            jacobian = np.zeros((n, n, *self._along.heading.shape))
            for k in range(3):
                jacobian[:3, k] = derivative(k)
        if equation.has_memory:
            constant = self._base.values["memory_time"]
            for j, gain in enumerate(equation.memory):
                jacobian[:3, 3 + j] = -gain * equation.inverse_mass[:, 1 + j, None, None]
                jacobian[3 + j, 1 + j] = 1.0 / constant
                jacobian[3 + j, 3 + j] = -1.0 / constant
        if turns:
            jacobian[:3, -1] = by_heading
            jacobian[-1, 2] = 1.0
        self._steps = Propagation(jacobian, self._data.step, self._data.per_bin)
        return self._steps


def _lagged(series: Array, begin: Array, constant: float, step: float) -> Array:
    """T q' = x - q along the first axis of (n, starts), x linear between samples, from q = begin (starts,)."""
    a = float(np.exp(-step / constant))
    slope = (1.0 - a) * constant / step
    b0, b1 = slope - a, 1.0 - slope
    found = np.empty_like(series)
    found[0] = begin
    for k in range(series.shape[0] - 1):
        found[k + 1] = a * found[k] + b0 * series[k] + b1 * series[k + 1]
    return found


@final
class Propagation:
    """Steps x' = forward x + drive (a_k + a_k+1) of states whose first three are the velocities.

    Within the steps of a bin all bins go side by side; from bin to bin only their ends are handed on.

    Parameters
    ----------
    jacobian : (n, n, steps + 1, starts) derivative of the rates of change of the states by the states [1/s]
    step : of the integration, by Crank and Nicolson [s]
    per_bin : steps in a bin
    """

    def __init__(self, jacobian: Array, step: float, per_bin: int) -> None:
        n, _, rows, starts = jacobian.shape
        eye = np.eye(n)[:, :, None, None]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            half = 0.5 * step * jacobian
            left = _inverse(eye - half[:, :, 1:])
            forward = _product(left, eye + half[:, :, :-1])
            self._drive = 0.5 * step * left[:, :3]
            self._forward = forward.reshape(n, n, (rows - 1) // per_bin, per_bin, starts)
            reached = self._forward[:, :, :, 0]
            total = reached[:3].copy()
            for k in range(1, per_bin):
                reached = _product(self._forward[:, :, :, k], reached)
                total += reached[:3]
        self._end, self._mean = reached, total / per_bin

    def binned(self, added: Array) -> Array:
        """Mean velocities of the bins (bins, 3, starts) that accelerations (3, steps + 1, starts) make."""
        n, _, bins, per_bin, starts = self._forward.shape
        with np.errstate(over="ignore", invalid="ignore"):
            pushed = np.einsum("ijks,jks->iks", self._drive, added[:, :-1] + added[:, 1:])
            pushed = pushed.reshape(n, bins, per_bin, starts)
            state = pushed[:, :, 0]
            total = state[:3].copy()
            for k in range(1, per_bin):
                state = np.einsum("ijbs,jbs->ibs", self._forward[:, :, :, k], state) + pushed[:, :, k]
                total += state[:3]
            begin = np.zeros((n, bins, starts))
            for b in range(1, bins):
                begin[:, b] = np.einsum("ijs,js->is", self._end[:, :, b - 1], begin[:, b - 1]) + state[:, b - 1]
            found = np.einsum("ijbs,jbs->bis", self._mean, begin) + (total / per_bin).transpose(1, 0, 2)
        return np.asarray(found, dtype=float)

    def transitions(self) -> Array:
        """How velocities at the start spread to those at each row, (steps + 1, 3, 3, starts)."""
        n, _, bins, per_bin, starts = self._forward.shape
        state = np.repeat(np.eye(n, 3)[:, :, None], starts, axis=2)
        found = np.empty((bins * per_bin + 1, 3, 3, starts))
        found[0] = state[:3]
        for k in range(bins * per_bin):
            state = _product(self._forward[:, :, k // per_bin, k % per_bin], state)
            found[k + 1] = state[:3]
        return found


def _product(one: Array, other: Array) -> Array:
    """Matrices (i, j, ...) times matrices (j, k, ...)."""
    return np.asarray(np.einsum("ij...,jk...->ik...", one, other), dtype=float)


def _inverse(matrix: Array) -> Array:
    """Inverses of matrices (n, n, ...); of three rows by cross products, a fifth of the time."""
    if len(matrix) != 3:
        return np.moveaxis(np.linalg.inv(np.moveaxis(matrix, (0, 1), (-2, -1))), (-2, -1), (0, 1)).astype(float)
    first, second, third = matrix
    columns = [np.cross(a, b, axis=0) for a, b in ((second, third), (third, first), (first, second))]
    return np.stack(columns, axis=1) / (first * columns[0]).sum(axis=0)
