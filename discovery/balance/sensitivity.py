"""Sensitivity of rollouts: how an added force spreads through a rollout, by its linearised equation of motion.

Along the rollouts of a base model, d(delta nu)/dt = A(t) delta nu + delta a(t), with delta a the added acceleration at
the base model's states and A = da/dnu; in wind or current the heading is a state too. The steps of that equation are
computed once a model, so that each candidate column costs a few products.
"""

from collections.abc import Callable
from typing import final

import numpy as np

from ...physics.forces import ForceEquation, relative_velocity
from ...physics.momentum_balance import balances, mass_matrix
from ...physics.motion import Array
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle
from .products import Products, merge_products, subtract_products, water
from .starts import Rollings

_Rows = Callable[[Array], Array]


@final
class Propagation:
    """Steps x' = forward x + drive (a_k + a_k+1) of states whose first three are the velocities.

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
        """Mean velocities of the bins (bins, 3, starts) that accelerations (steps + 1, 3, starts) make."""
        n, _, bins, per_bin, starts = self._forward.shape
        with np.errstate(over="ignore", invalid="ignore"):
            pushed = np.einsum("ijks,kjs->iks", self._drive, added[:-1] + added[1:])
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
        """Sensitivity of the velocities at each row to those at the start, (steps + 1, 3, 3, starts)."""
        n, _, bins, per_bin, starts = self._forward.shape
        state = np.repeat(np.eye(n, 3)[:, :, None], starts, axis=2)
        result = np.empty((bins * per_bin + 1, 3, 3, starts))
        result[0] = state[:3]
        for k in range(bins * per_bin):
            state = _product(self._forward[:, :, k // per_bin, k % per_bin], state)
            result[k + 1] = state[:3]
        return result


def _product(one: Array, other: Array) -> Array:
    """Matrices (i, j, ...) times matrices (j, k, ...)."""
    return np.asarray(np.einsum("ij...,jk...->ik...", one, other), dtype=float)


def _inverse(matrix: Array) -> Array:
    """Inverses of matrices (n, n, ...); of three rows by cross products, which is arithmetic on whole arrays."""
    if len(matrix) != 3:
        return np.moveaxis(np.linalg.inv(np.moveaxis(matrix, (0, 1), (-2, -1))), (-2, -1), (0, 1)).astype(float)
    first, second, third = matrix
    columns = (_crossed(second, third), _crossed(third, first), _crossed(first, second))
    return np.stack(columns, axis=1) / (first * columns[0]).sum(axis=0)


def _crossed(one: Array, other: Array) -> Array:
    """Cross products (3, ...)."""
    return np.stack([one[j] * other[k] - one[k] * other[j] for j, k in ((1, 2), (2, 0), (0, 1))])


_STEP = 1e-4
"""Change of a velocity or a heading by which a derivative is taken [m/s, m/s, rad/s, rad]."""

_KEPT = (60, 60)
"""Products that are kept: those of one model, for the next one has other rollouts."""


class Tangent:
    """The balance of a shooting form for models near a base model.

    Parameters
    ----------
    data : the rollouts
    base : the model about which they are linearised
    finished : errors (bins, 3, starts) as rows (tests, 3) of the balance
    with_noise : the balance and its noisier copy, (2, tests, 3)
    """

    def __init__(self, data: Rollings, base: Vehicle, finished: _Rows, with_noise: _Rows) -> None:
        self.base, self._data, self._finished, self._with_noise = base, data, finished, with_noise
        self._states = data.states(base)
        predicted = data.binned(self._states[:, :, 1:].transpose(1, 2, 0))
        self._errors = data.measured - predicted
        self._balances = with_noise(finished(self._errors))
        self._products = _RolloutTerms(data, self._states)
        self._spread: Propagation | None = None

    def balances(self, vehicle: Vehicle) -> Array:
        """The balance of a model near the base model and its noisier copy, (2, tests, 3), see `Shooting.balances`.

        To first order in the change of acceleration.
        """
        if vehicle is self.base:
            return self._balances
        return self._with_noise(self._finished(self._errors - self._change(vehicle, self.base)))

    def difference(self, one: Vehicle, other: Vehicle) -> Array:
        """The balances of one model less those of another, (2, tests, 3)."""
        rows = self._finished(self._change(other, one))
        return np.stack([rows] * self._balances.shape[0])

    def _change(self, one: Vehicle, other: Vehicle) -> Array:
        """What one model's rollouts add to another's, (bins, 3, starts)."""
        if self._spread is None:
            self._spread = propagation(self._data, self.base, self._states)
        return self._spread.binned(self._products.added(one, other))


@final
class _RolloutTerms(Products):
    """The summands of the balance along the states of rollouts, (steps + 1, starts) each."""

    def __init__(self, data: Rollings, states: Array) -> None:
        self._data = data
        heading, u, v, r = states.transpose(2, 1, 0)
        air = None if data.air is None else (data.air[0], data.air[1])
        super().__init__(heading, (u, v, r), air, data.minutes, _KEPT)

    def added(self, one: Vehicle, other: Vehicle) -> Array:
        """Acceleration over ground that one model gives along the rollouts beyond another, (steps + 1, 3, starts)."""
        inertia = mass_matrix(one)
        if water(one) == water(other) and np.array_equal(inertia, mass_matrix(other)):
            parts = [merge_products(self.force_parts(balances(vehicle), vehicle)) for vehicle in (one, other)]
            inverse = np.linalg.inv(inertia)
            return np.asarray(np.einsum("ij,jks->kis", inverse, self.summed(subtract_products(*parts))), dtype=float)
        return self._accelerations(one) - self._accelerations(other)

    def _accelerations(self, vehicle: Vehicle) -> Array:
        force = self.forces(vehicle)
        relative = self.relative(vehicle)
        pushed = (force[0], force[1], force[2])
        found = ForceEquation(vehicle).acceleration(pushed, relative, self.velocity, self.heading)
        return np.stack(found, axis=1)

    @property
    def shape(self) -> tuple[int, ...]:
        """(steps + 1, starts)."""
        return self.heading.shape

    def passed(self, rows: Array) -> Array:
        """The rows themselves."""
        return rows

    def wake(self, axis: int, vehicle: Vehicle) -> Array:
        """The wake memory from what it holds at the starts."""
        begin, constant = self._data.memory(vehicle), vehicle.values["memory_time"]
        return _remembered(self.relative(vehicle)[axis], begin[:, axis - 1], constant, self._data.step)

    def response(self, index: int, unit: Thruster) -> tuple[Array, Array]:
        """Force [N] and load [N s/m] of a thruster."""
        return self._data.response(index, unit)


def _remembered(series: Array, begin: Array, constant: float, step: float) -> Array:
    """T q' = x - q along the first axis of (n, starts), x linear between samples, from q = begin (starts,)."""
    a = float(np.exp(-step / constant))
    slope = (1.0 - a) * constant / step
    b0, b1 = slope - a, 1.0 - slope
    result = np.empty_like(series)
    result[0] = begin
    for k in range(series.shape[0] - 1):
        result[k + 1] = a * result[k] + b0 * series[k] + b1 * series[k + 1]
    return result


def propagation(data: Rollings, vehicle: Vehicle, states: Array) -> Propagation:
    """The linearised rollouts of a model.

    Their states are the velocities, the wake memory's two where there is one, and the heading where wind or current
    make the forces depend on it: n = 3 to 6.

    Parameters
    ----------
    data : the rollouts, their starts and bins
    vehicle : the model that was rolled out
    states : psi, u, v, r along its rollouts (starts, steps + 1, 4) [rad, m/s, m/s, rad/s]
    """
    equation, (thrust, load) = ForceEquation(vehicle), data.inputs(vehicle)
    lost, air = load if load.any() else None, None if data.air is None else (data.air[0], data.air[1])
    heading, *velocity = states.transpose(2, 1, 0)
    constant, memory = vehicle.values["memory_time"], None
    if equation.has_memory:
        u, v, r = velocity
        followed = relative_velocity(vehicle, heading, (u, v, r), data.minutes)[1:]
        begun = zip(followed, data.memory(vehicle).T, strict=True)
        sway, rate = (_remembered(series, begin, constant, data.step) for series, begin in begun)
        memory = sway, rate

    def acceleration(u: Array, v: Array, r: Array, turned: Array) -> Array:
        """(3, steps + 1, starts) at other velocities and headings, everything else the same."""
        relative = relative_velocity(vehicle, turned, (u, v, r), data.minutes)
        force = equation.force(relative, turned, thrust, lost, memory, air, data.minutes)
        return np.stack(equation.acceleration(force, relative, (u, v, r), turned))

    def derivative(state: int) -> Array:
        """(3, steps + 1, starts) change of acceleration with u, v, r, or psi (`state` 0 to 3), central differences."""
        ends = [
            acceleration(*(x + step * (k == state) for k, x in enumerate((*velocity, heading))))
            for step in (_STEP, -_STEP)
        ]
        return (ends[0] - ends[1]) / (2.0 * _STEP)

    with np.errstate(over="ignore", invalid="ignore"):
        by_heading = derivative(3) if equation.turns else np.zeros(0)
        turns = bool(by_heading.any())
        n = 3 + 2 * (memory is not None) + turns
        jacobian = np.zeros((n, n, *heading.shape))
        for k in range(3):
            jacobian[:3, k] = derivative(k)
    if memory is not None:
        for j, gain in enumerate(equation.memory):
            jacobian[:3, 3 + j] = -gain * equation.inverse_mass[:, 1 + j, None, None]
            jacobian[3 + j, 1 + j] = 1.0 / constant
            jacobian[3 + j, 3 + j] = -1.0 / constant
    if turns:
        jacobian[:3, -1] = by_heading
        jacobian[-1, 2] = 1.0
    return Propagation(jacobian, data.step, data.per_bin)
