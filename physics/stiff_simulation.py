"""A step for any acceleration, however stiff: bounds are asked of rollouts that nobody made stable beforehand."""

from collections.abc import Callable

import numpy as np

from .frames import Array, body_to_earth
from .integration import Rollouts

_ERROR, _PARTS = 0.3, 8
"""Error of a step, as a share of the speeds, above which it is halved, and most parts of a step: what turns fast under
a force that only turns it has no other limit. Stability needs no more, and only bounds are asked of such rollouts."""
_PROBE = 1e-4
"""Step of a difference [m/s, rad/s], at rest: above the rounding of single precision, below what drag bends over."""

Answer = Callable[[Array, Array, Array], Array]
"""Acceleration (n, 3) of velocities (n, 3), headings (n,) and commands (n, thrusters)."""


def integrate_stiff(answer: Answer, initial: Array, commands: Array, time_step: float, limit: float) -> Rollouts:
    """Integrate an acceleration that may be stiff, by a linearly implicit step of second order.

    ROS2 of Verwer et al. (1999, SIAM J. Sci. Comput. 20(4), eq. 2.1) with gamma = 1 - 1/sqrt(2): L-stable, so that
    damping of any size decays in a step of any size, and of second order whatever matrix stands for the Jacobian. Here
    that is made of differences, its growing part taken off: else an L-stable step would damp what truly explodes.

    Parameters
    ----------
    answer : called twice a step, once with four times the batch
    initial : (batch, 6) north, east, psi, u, v, r
    commands : (batch, steps + 1, thrusters), linear between steps
    limit : speed [m/s] and yaw rate [rad/s] beyond which a rollout counts as diverged and is held
    """
    batch, steps = commands.shape[0], commands.shape[1] - 1
    history = np.empty((batch, steps + 1, 6))
    history[:, 0] = state = initial.astype(float)
    diverged, parts = np.zeros(batch, dtype=bool), 1
    for k in range(steps):
        ends, done = (commands[:, k], commands[:, k + 1]), 0
        while done < parts:
            pushed = ends[0] + (ends[1] - ends[0]) * ((done + 0.5) / parts)
            trial, error = _implicit_step(answer, state, pushed, time_step / parts)
            if parts < _PARTS and float(error[~diverged].max(initial=0.0)) > _ERROR:
                done, parts = 2 * done, 2 * parts
                continue
            gone = ~(np.abs(trial[:, 3:]).max(axis=1) <= limit) | ~np.isfinite(trial).all(axis=1)
            trial[gone, 3:] = np.clip(np.nan_to_num(trial[gone, 3:], nan=limit), -limit, limit)
            diverged |= gone
            state, done = np.where(diverged[:, None] & ~gone[:, None], state, np.nan_to_num(trial)), done + 1
        history[:, k + 1] = state
        if parts > 1 and float(error[~diverged].max(initial=0.0)) < 0.1 * _ERROR:
            parts //= 2
    return Rollouts(history, diverged)


def _implicit_step(answer: Answer, state: Array, pushed: Array, h: float) -> tuple[Array, Array]:
    """States (batch, 6) one step of `integrate_stiff` later, and its error (batch,) as a share of the speeds."""
    gamma, eye, batch = 1.0 - np.sqrt(0.5), np.eye(3), state.shape[0]
    psi, nu = state[:, 2], state[:, 3:]
    probe = _PROBE * (1.0 + np.abs(nu))
    asked = np.concatenate([nu[:, None], nu[:, None] + probe[:, :, None] * eye], axis=1).reshape(-1, 3)
    said = answer(asked, np.repeat(psi, 4), np.repeat(pushed, 4, axis=0)).reshape(batch, 4, 3)
    jacobian = np.swapaxes((said[:, 1:] - said[:, :1]) / probe[:, :, None], 1, 2)
    growth = np.maximum(np.linalg.eigvals(jacobian).real.max(axis=1), 0.0)
    inverse = np.linalg.inv(eye - gamma * h * (jacobian - growth[:, None, None] * eye))
    one = np.einsum("bij,bj->bi", inverse, said[:, 0])
    two = np.einsum("bij,bj->bi", inverse, answer(nu + h * one, psi + h * nu[:, 2], pushed) - 2.0 * one)
    after = nu + h * (1.5 * one + 0.5 * two)
    turned = psi + 0.5 * h * (nu[:, 2] + after[:, 2])
    before, later = (body_to_earth(a, x[:, 0], x[:, 1]) for a, x in ((psi, nu), (turned, after)))
    moved = 0.5 * h * (np.stack(before, axis=-1) + np.stack(later, axis=-1))
    size = np.maximum(np.abs(nu), np.abs(after))
    size = np.maximum(size, 0.1 * size.max(axis=0)) + _PROBE
    error = np.abs(0.5 * h * (one + two) / size).max(axis=1)
    return np.column_stack([state[:, :2] + moved, turned, after]), error
