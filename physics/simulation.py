"""Simulation: fixed-step RK4 of many rollouts at once."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .errors import RequestError
from .forces import Actuation, ForceEquation, actuation, memory_states, relative_velocity
from .frames import Array, body_to_earth
from .motion import Motion
from .vehicle import Vehicle

SPEED_LIMIT = 50.0
"""Speed [m/s] and yaw rate [rad/s] beyond which a rollout counts as diverged and is held."""

Added = Callable[[int, Array], Array]
"""Acceleration over ground (3, batch) that is held during a step beside the vehicle's own, from the number of the step
and the state (6, batch) at its beginning; called once a step, in order."""


@dataclass(frozen=True, slots=True)
class Rollouts:
    """Open-loop rollouts from measured starts.

    `states` (starts, steps + 1, 6): north, east [m], psi [rad], u, v [m/s], r [rad/s]; `diverged` (starts,) bool.
    """

    states: Array
    diverged: np.ndarray


def integrate(
    vehicle: Vehicle | None,
    time_step: float,
    initial: Array,
    thrust: Array,
    load: Array,
    memory: Array | None = None,
    air: Array | None = None,
    added: Added | None = None,
) -> Rollouts:
    """Integrate the force equation by classical Runge-Kutta for a batch of starts.

    Parameters
    ----------
    vehicle : None for a body on which no force acts, so that `added` is its whole acceleration
    time_step : [s]
    initial : (batch, 6) north, east, psi, u, v, r
    thrust, load : (thrusters, steps + 1, batch) [N], [N s/m], linear between steps
    memory : (batch, 2) initial wake memory of sway speed and yaw rate; default: the initial velocities
    air : (2, steps + 1, batch) velocity of the air over ground, north and east [m/s], linear between steps; default:
        still
    added : acceleration beside the vehicle's; default: none
    """
    equation = None if vehicle is None else ForceEquation(vehicle)
    steps, batch = thrust.shape[1] - 1, initial.shape[0]
    state = np.zeros((8, batch))
    state[:6] = initial.T
    if memory is not None:
        state[6:] = memory.T
    elif vehicle is not None:
        state[6:] = relative_velocity(vehicle, state[2], (state[3], state[4], state[5]))[1:]
    loaded = bool(load.any())
    held = None

    def slope(x: Array, push: Array, loss: Array | None, wind: Array | None) -> Array:
        out = np.empty_like(x)
        out[0], out[1] = body_to_earth(x[2], x[3], x[4])
        out[2] = x[5]
        out[3:] = 0.0
        if equation is not None:
            velocity = (x[3], x[4], x[5])
            relative = relative_velocity(equation.vehicle, x[2], velocity)
            blowing = None if wind is None else (wind[0], wind[1])
            force = equation.force(relative, x[2], push, loss, (x[6], x[7]), blowing)
            out[3], out[4], out[5] = equation.acceleration(force, relative, velocity)
            if equation.has_memory:
                constant = equation.vehicle.values["memory_time"]
                out[6], out[7] = (relative[1] - x[6]) / constant, (x[5] - x[7]) / constant
        if held is not None:
            out[3:6] += held
        return out

    h = time_step
    history = np.empty((steps + 1, 6, batch))
    history[0] = state[:6]
    diverged = np.zeros(batch, dtype=bool)
    for k in range(steps):
        held = None if added is None else added(k, state[:6])
        push0, push1 = thrust[:, k], thrust[:, k + 1]
        middle = 0.5 * (push0 + push1)
        loss0, loss1 = (load[:, k], load[:, k + 1]) if loaded else (None, None)
        lost = 0.5 * (loss0 + loss1) if loss0 is not None and loss1 is not None else None
        wind0, wind1 = (None, None) if air is None else (air[:, k], air[:, k + 1])
        wind = None if air is None else 0.5 * (air[:, k] + air[:, k + 1])
        k1 = slope(state, push0, loss0, wind0)
        k2 = slope(state + 0.5 * h * k1, middle, lost, wind)
        k3 = slope(state + 0.5 * h * k2, middle, lost, wind)
        k4 = slope(state + h * k3, push1, loss1, wind1)
        state = state + (h / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        fast = ~(np.abs(state[3:6]).max(axis=0) <= SPEED_LIMIT)
        if fast.any():
            diverged |= fast
            state[:, fast] = np.nan_to_num(state[:, fast], nan=0.0, posinf=0.0, neginf=0.0)
            state[3:, fast] = np.clip(state[3:, fast], -SPEED_LIMIT, SPEED_LIMIT)
        history[k + 1] = state[:6]
    return Rollouts(np.ascontiguousarray(history.transpose(2, 0, 1)), diverged)


def rollout(
    vehicle: Vehicle | None, motion: Motion, starts: np.ndarray, steps: int, added: Added | None = None
) -> Rollouts:
    """Open-loop rollouts from measured starts along a motion, with its commands, their history, and its wind.

    Parameters
    ----------
    vehicle, added : see `integrate`
    starts : (batch,) row numbers of `motion`; each needs `steps` rows after it
    steps : number of steps of `motion.time_step`

    Raises
    ------
    RequestError
        when a start leaves fewer than `steps` rows.
    """
    starts = np.asarray(starts, dtype=int)
    if starts.size == 0 or starts.min() < 0 or starts.max() + steps >= motion.time.size:
        raise RequestError(
            f"rollout of {steps} steps: starts must lie in 0..{motion.time.size - steps - 1}, got {starts.tolist()[:5]}"
        )
    if vehicle is None:
        idle = np.zeros((0, motion.time.size))
        act, memory = Actuation(idle, idle), None
    else:
        act, memory = actuation(vehicle, motion), np.column_stack(memory_states(vehicle, motion))[starts]
    window = starts[None, :] + np.arange(steps + 1)[:, None]
    initial = np.column_stack([motion.position, motion.heading, motion.velocity])[starts]
    air = None if motion.air is None else motion.air.T[:, window]
    thrust, load = act.thrust[:, window], act.load[:, window]
    with np.errstate(over="ignore", invalid="ignore"):
        return integrate(vehicle, motion.time_step, initial, thrust, load, memory, air, added)


def simulate_motion(vehicle: Vehicle, motion: Motion) -> Motion:
    """The motion that a vehicle makes from the first state of `motion` under its commands."""
    result = rollout(vehicle, motion, np.array([0]), motion.time.size - 1).states[0]
    return replace(motion, position=result[:, :2].copy(), heading=result[:, 2].copy(), velocity=result[:, 3:].copy())
