"""Open-loop rollouts from measured starts along motions, with their commands, their history and their wind."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .errors import RequestError
from .forces import Actuation, actuation, memory_states
from .integration import Added, Around, Driven, Rollouts, integrate, integrate_together
from .motion import Motion
from .vehicle import Vehicle


class Legs(NamedTuple):
    """Rollouts that are asked of a motion: row numbers of their starts (batch,), and their number of time steps."""

    motion: Motion
    starts: np.ndarray
    steps: int


def rollout(
    vehicle: Vehicle | None,
    motion: Motion,
    starts: np.ndarray,
    steps: int,
    added: Added | None = None,
    placed: bool = True,
) -> Rollouts:
    """Open-loop rollouts from measured starts along a motion, with its commands, their history, and its wind.

    Parameters
    ----------
    vehicle, added : see `integrate`
    starts : (batch,) row numbers of `motion`; each needs `steps` rows after it
    steps : number of steps of `motion.time_step`
    placed : north and east are followed, too

    Raises
    ------
    RequestError
        when a start leaves fewer than `steps` rows.
    """
    driven = _driven(vehicle, Legs(motion, starts, steps), placed)
    with np.errstate(over="ignore", invalid="ignore"):
        return integrate(driven, motion.time_step, added)


def rollouts(asked: Sequence[tuple[Vehicle, Legs]], placed: bool = True) -> list[Rollouts]:
    """`rollout` of several vehicles and motions, in one batch for each time step.

    Raises
    ------
    RequestError
        when a start leaves fewer rows than its steps.
    """
    steps = [legs.motion.time_step for _, legs in asked]
    found: dict[int, Rollouts] = {}
    for step in dict.fromkeys(steps):
        alike = [k for k, other in enumerate(steps) if other == step]
        with np.errstate(over="ignore", invalid="ignore"):
            done = integrate_together([_driven(*asked[k], placed) for k in alike], step)
        found |= dict(zip(alike, done, strict=True))
    return [found[k] for k in range(len(asked))]


def _driven(vehicle: Vehicle | None, legs: Legs, placed: bool = True) -> Driven:
    motion, steps = legs.motion, legs.steps
    starts = check_starts(motion, legs.starts, steps)
    if vehicle is None:
        idle = np.zeros((0, motion.time.size))
        act, memory = Actuation(idle, idle), None
    else:
        act, memory = actuation(vehicle, motion), np.column_stack(memory_states(vehicle, motion))[starts]
    window = starts[None, :] + np.arange(steps + 1)[:, None]
    where = (motion.position,) if placed else ()
    initial = np.column_stack([*where, motion.heading, motion.velocity])[starts]
    air = None if motion.air is None else motion.air.T[:, window]
    around = Around(air, motion.minutes[starts])
    return Driven(vehicle, initial, act.thrust[:, window], act.load[:, window], memory, around)


def check_starts(motion: Motion, starts: np.ndarray, steps: int) -> np.ndarray:
    """Rows from which a motion is rolled out, as whole numbers.

    Raises
    ------
    RequestError
        when a start leaves fewer than `steps` rows.
    """
    found = np.asarray(starts, dtype=int)
    if found.size == 0 or found.min() < 0 or found.max() + steps >= motion.time.size:
        raise RequestError(
            f"rollout of {steps} steps: starts must lie in 0..{motion.time.size - steps - 1}, got {found.tolist()[:5]}"
        )
    return found


def simulate_motion(vehicle: Vehicle, motion: Motion) -> Motion:
    """The motion that a vehicle makes from the first state of `motion` under its commands."""
    result = rollout(vehicle, motion, np.array([0]), motion.time.size - 1).states[0]
    return replace(motion, position=result[:, :2].copy(), heading=result[:, 2].copy(), velocity=result[:, 3:].copy())
