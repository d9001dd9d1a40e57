"""Models that go from row to row: a linear system in lifted or estimated states, asked like any other model."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from undertow.measurements.preparation.prepare import DataSet
from undertow.physics.forces import actuation, held_thrust
from undertow.physics.integration import SPEED_LIMIT, Rollouts, check_starts
from undertow.physics.motion import Array, Motion, body_to_earth
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Kind, Model
from undertow.residuals.scores import rollout_scores, same_filter

Lift = Callable[[Array], Array]
_HORIZONS = (10.0, 2.0)
"""Of the rollouts that choose a setting, the longest that fits into the validation part [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """z_(k+1) = A z_k + B T_k, nu_k = C z_k.

    Attributes
    ----------
    A, B, C : (states, states), (states, thrusters) [1/N and the unit of the state], (3, states)
    lift : states (n, states) from velocities (n, 3); None where `window` rows tell them
    window : rows before and with a row from whose velocities and thrusts its state is estimated
    """

    A: Array
    B: Array
    C: Array
    lift: Lift | None = None
    window: int = 1

    def states(self, velocity: Array, pushed: Array) -> Array:
        """The states along measured rows, (n, states); least squares over the window where they are not lifted."""
        if self.lift is not None:
            return self.lift(velocity)
        free = self._free(velocity.shape[0])
        found = np.empty((velocity.shape[0], self.A.shape[0]))
        for k in range(velocity.shape[0]):
            first = max(0, k + 1 - self.window)
            inputs = pushed[first : k + 1]
            driven = self.simulate(np.zeros(self.A.shape[0]), inputs)
            left = velocity[first : k + 1] - driven @ self.C.T
            start = free[len(inputs) - 1] @ left.ravel()
            found[k] = np.linalg.matrix_power(self.A, len(inputs) - 1) @ start + driven[-1]
        return found

    def simulate(self, start: Array, inputs: Array) -> Array:
        """States (rows, states) from the first row on, each after the inputs (rows, thrusters) of the rows before."""
        state, found = start, [start]
        for pushed in inputs[:-1]:
            state = self.A @ state + self.B @ pushed
            found.append(state)
        return np.array(found)

    def _free(self, rows: int) -> list[Array]:
        """What makes a first state of the stacked velocities of 1, 2 ... rows that nothing drives."""
        seen, power, found = [], np.eye(self.A.shape[0]), []
        for _ in range(min(self.window, rows)):
            seen.append(self.C @ power)
            power = self.A @ power
            found.append(np.linalg.pinv(np.concatenate(seen)))
        return found


class Stepped(Model):
    """A linear system as a model.

    A step takes the mean of the thrusts of its two rows. The acceleration of a row is the mean of the steps to it and
    from it over the time step, as the measured one is a central difference.

    Parameters
    ----------
    system : what steps
    vehicle : of whose thrusters' curves and mass it knows
    time_step : of a row [s]
    """

    kind: Kind = "baseline"
    seconds_to_fit = 0.0

    def __init__(self, system: Linear, vehicle: Vehicle, time_step: float, name: str) -> None:
        self.system, self.vehicle, self.time_step, self.name = system, vehicle, time_step, name
        self.remembers = system.lift is None
        self.parameters = system.A.size + system.B.size

    def acceleration(self, motion: Motion) -> Array:
        """See `Model.acceleration`."""
        pushed = step_means(actuation(self.vehicle, motion).thrust.T)
        step = self._step(self.system.states(motion.velocity, pushed), pushed)
        return np.concatenate([step[:1], 0.5 * (step[:-1] + step[1:])])

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """See `Model.rollout`."""
        rows = check_starts(motion, starts, steps)
        pushed = step_means(actuation(self.vehicle, motion).thrust.T)
        lifted = self.system.states(motion.velocity, pushed)[rows]
        state = np.column_stack([motion.position, motion.heading, motion.velocity])[rows]
        found, diverged = np.empty((rows.size, steps + 1, 6)), np.zeros(rows.size, dtype=bool)
        found[:, 0] = state
        for k in range(steps):
            lifted = lifted @ self.system.A.T + pushed[rows + k] @ self.system.B.T
            velocity = lifted @ self.system.C.T
            diverged |= ~(np.abs(velocity).max(axis=1) <= SPEED_LIMIT)
            lifted[diverged] = 0.0
            velocity[diverged] = SPEED_LIMIT
            state = _moved(state, velocity, motion.time_step)
            found[:, k + 1] = state
        return Rollouts(found, diverged)

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`."""
        lift = self.system.lift
        states = velocity @ np.linalg.pinv(self.system.C).T if lift is None else lift(velocity)
        return self._step(states, held_thrust(self.vehicle, commands)[0].T)

    def _step(self, states: Array, pushed: Array) -> Array:
        after = states @ self.system.A.T + pushed @ self.system.B.T
        return (after - states) @ self.system.C.T / self.time_step


def _moved(state: Array, velocity: Array, step: float) -> Array:
    """States (n, 6) one step on, with these velocities (n, 3) at its end; heading and place by the trapezoid rule."""
    heading = state[:, 2] + 0.5 * step * (state[:, 5] + velocity[:, 2])
    ways = [body_to_earth(state[:, 2], *state[:, 3:5].T), body_to_earth(heading, *velocity[:, :2].T)]
    place = state[:, :2] + 0.5 * step * (np.stack(ways[0], axis=-1) + np.stack(ways[1], axis=-1))
    return np.column_stack([place, heading, velocity])


def step_means(thrust: Array) -> Array:
    """Mean thrust over the step after each row, (n, thrusters) [N]; the last is that of its row."""
    return np.concatenate([0.5 * (thrust[:-1] + thrust[1:]), thrust[-1:]])


def filtered_thrust(vehicle: Vehicle, motion: Motion, data: DataSet) -> Array:
    """Thrusts along a motion (n, thrusters) [N], through the filter that its velocities went through."""
    return same_filter(actuation(vehicle, motion).thrust.T, motion, data)


def transitions(vehicle: Vehicle, data: DataSet) -> tuple[Array, Array, Array]:
    """Velocities before and after each step (n, 3), and the mean thrust over it (n, thrusters)."""
    parts = [
        (m.velocity[:-1], m.velocity[1:], step_means(filtered_thrust(vehicle, m, data))[:-1]) for m in data.motions
    ]
    before, after, pushed = (np.concatenate(part) for part in zip(*parts, strict=True))
    return before, after, pushed


def validation_error(model: Model, data: DataSet) -> float:
    """Error of the velocities in rollouts of a part, in their spread there, mean of the axes."""
    found = rollout_scores(model, data, _HORIZONS)
    horizon = next(h for h in _HORIZONS if f"{h:g}" in found)
    spread = np.concatenate([m.velocity for m in data.motions]).std(axis=0)
    return float((found[f"{horizon:g}"].velocity / np.maximum(spread, 1e-9)).mean())


def best_of(made: Sequence[Callable[[DataSet], Model]], train: DataSet, validation: DataSet, whole: DataSet) -> Model:
    """The setting whose model, fitted to the training part, errs least in validation, fitted anew to the whole run."""
    errors = [validation_error(make(train), validation) for make in made]
    return made[int(np.nanargmin(errors))](whole)
