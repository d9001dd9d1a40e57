"""Rollouts of models near one: an added force spreads through a rollout as its linearised equation says.

Along the rollouts of a base model, d(delta nu)/dt = A(t) delta nu + delta a(t), where delta a is what a change of the
model adds to the acceleration at the base model's states and A = da/dnu. One operator for each rollout takes delta a
to the change of the binned velocities, so that hundreds of candidate columns cost a matrix product each.
"""

from typing import TYPE_CHECKING

import numpy as np

from ..physics.forces import ForceEquation, relative_velocity
from ..physics.frames import Array
from ..physics.vehicle import Vehicle

if TYPE_CHECKING:
    from .shooting import Rollings, Shooting

_STEP = 1e-4
"""Change of a velocity by which its derivative is taken [m/s, m/s, rad/s]."""


class Tangent:
    """The balance of a shooting form for models near a base model.

    Attributes
    ----------
    memo : columns about this base model, which no other model shares
    linear, step_share : see `WeakForm`; added mass bends a column, so that its steps are small
    """

    linear = False
    step_share = 0.02

    def __init__(self, form: "Shooting", base: Vehicle) -> None:
        self.form, self.base = form, base
        self.memo: dict[tuple[object, ...], Array] = {}
        data = form.data
        self._states = data.states(base)
        predicted = data.binned(self._states[:, :, 3:].transpose(1, 2, 0))
        self._errors = data.measured - predicted
        self._balances = form.with_noise(form.finished(self._errors))
        self._acceleration = self._accelerations(base)
        self._operator: Array | None = None

    def balances(self, vehicle: Vehicle) -> Array:
        """The balance of a model near the base model and its noisier copy, (2, tests, 3), see `Shooting.balances`.

        To first order in the change of acceleration. Wake memory has states of its own and is rolled out in full.
        """
        if vehicle is self.base:
            return self._balances
        if ForceEquation(vehicle).has_memory or ForceEquation(self.base).has_memory:
            return self.form.balances(vehicle)
        added = self._accelerations(vehicle) - self._acceleration
        steps, _, starts = added.shape
        flat = np.ascontiguousarray(added.transpose(2, 0, 1)).reshape(starts, steps * 3, 1)
        bins = self._errors.shape[0]
        change = (self._spread() @ flat)[..., 0].reshape(starts, bins, 3).transpose(1, 2, 0)
        return self.form.with_noise(self.form.finished(self._errors - change))

    def _accelerations(self, vehicle: Vehicle) -> Array:
        return accelerations(self.form.data, vehicle, self._states)

    def _spread(self) -> Array:
        """(starts, 3 bins, 3 (steps + 1)): the binned velocities that an added acceleration makes."""
        if self._operator is None:
            self._operator = _operator(self.form.data, *_propagators(self.form.data, self.base, self._states))
        return self._operator


def accelerations(data: "Rollings", vehicle: Vehicle, states: Array) -> Array:
    """Acceleration over ground that a model gives along rollouts (starts, steps + 1, 6), as (steps + 1, 3, starts)."""
    equation = ForceEquation(vehicle)
    thrust, load, _ = data.inputs(vehicle)
    heading = states[:, :, 2].T
    velocity = (states[:, :, 3].T, states[:, :, 4].T, states[:, :, 5].T)
    return _acceleration(equation, heading, velocity, thrust, load)


def transitions(data: "Rollings", vehicle: Vehicle, states: Array) -> Array:
    """How an error of the start velocity spreads along rollouts, (steps + 1, 3, 3, starts)."""
    forward, _ = _propagators(data, vehicle, states)
    steps, starts = data.steps, states.shape[0]
    spread = np.empty((steps + 1, starts, 3, 3))
    spread[0] = np.eye(3)
    for k in range(steps):
        spread[k + 1] = forward[k] @ spread[k]
    return spread.transpose(0, 2, 3, 1)


def _acceleration(
    equation: ForceEquation, heading: Array, velocity: tuple[Array, Array, Array], thrust: Array, load: Array
) -> Array:
    relative = relative_velocity(equation.vehicle, heading, velocity)
    force = equation.force(relative, heading, thrust, load if load.any() else None)
    return np.stack(equation.acceleration(force, relative, velocity), axis=1)


def _propagators(data: "Rollings", vehicle: Vehicle, states: Array) -> tuple[Array, Array]:
    """Crank-Nicolson steps of the linearised rollout: x' = forward x + drive (a_k + a_k+1), (steps, starts, 3, 3)."""
    equation = ForceEquation(vehicle)
    thrust, load, _ = data.inputs(vehicle)
    heading = states[:, :, 2].T
    velocity = [states[:, :, 3].T, states[:, :, 4].T, states[:, :, 5].T]
    jacobian = np.empty((*heading.shape, 3, 3))
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(3):
            ends = []
            for sign in (1.0, -1.0):
                moved = (*velocity[:k], velocity[k] + sign * _STEP, *velocity[k + 1 :])
                ends.append(_acceleration(equation, heading, (moved[0], moved[1], moved[2]), thrust, load))
            jacobian[..., k] = ((ends[0] - ends[1]) / (2.0 * _STEP)).transpose(0, 2, 1)
    half = 0.5 * data.step * jacobian
    left: Array = np.linalg.inv(np.eye(3) - half[1:]).astype(float)
    return left @ (np.eye(3) + half[:-1]), 0.5 * data.step * left


def _operator(data: "Rollings", forward: Array, drive: Array) -> Array:
    steps, starts = forward.shape[:2]
    bins = steps // data.per_bin
    operator = np.zeros((starts, bins, 3, steps + 1, 3))
    response = np.zeros((starts, 3, steps + 1, 3))
    for k in range(steps):
        live = response[:, :, : k + 2].reshape(starts, 3, -1)
        response[:, :, : k + 2] = (forward[k] @ live).reshape(starts, 3, k + 2, 3)
        response[:, :, k] += drive[k]
        response[:, :, k + 1] += drive[k]
        operator[:, k // data.per_bin] += response / data.per_bin
    return operator.reshape(starts, bins * 3, (steps + 1) * 3)
