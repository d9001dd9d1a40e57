"""A trial of bounded thrust: extremes held and random commands, met from rest; and how fast a vehicle goes in it."""

from itertools import product

import numpy as np

from ..errors import RequestError
from ..forces import calm
from ..frames import Array
from ..laws import Envelope, envelope_of
from ..motion import Motion
from ..simulation import rollout
from ..thrusters import command_of
from ..vehicle import Vehicle

_HOLDS = (2.0, 8.0)
"""Random commands last between these times [s]."""
_RANDOM = 24
_LEVELS = 5
_MOST = 2000


def possible_commands(vehicle: Vehicle, seed: int = 0) -> Array:
    """Commands of all thrusters together (m, thrusters), from full astern to full ahead."""
    count = len(vehicle.thrusters)
    levels = np.linspace(-1.0, 1.0, _LEVELS)
    if _LEVELS**count <= _MOST:
        fractions = np.array(list(product(levels, repeat=count)))
    else:
        fractions = np.random.default_rng([seed, 9]).choice(levels, size=(_MOST, count))
    return np.column_stack([command_of(t, fractions[:, k]) for k, t in enumerate(vehicle.thrusters)])


def trial(vehicle: Vehicle, pool: Array, time_step: float, steps: int, seed: int) -> tuple[Motion, np.ndarray, int]:
    """A motion at rest whose commands are to be rolled out: extremes of a pool held, then random ones.

    Returns
    -------
    (motion, starts, held)
        rows from which to roll out; the first `held` of them meet one command that lasts
    """
    rng = np.random.default_rng([seed, 3])
    parts = [np.repeat(pool[int(np.argmax(pool @ side))][None], steps + 1, axis=0) for side in _sides(pool.shape[1])]
    held, rows = len(parts), 0
    while rows < 3 * steps:
        length = max(1, round(rng.uniform(*_HOLDS) / time_step))
        parts.append(np.repeat(pool[rng.integers(0, pool.shape[0])][None], length, axis=0))
        rows += length
    commands = np.concatenate(parts)
    n, first = commands.shape[0], held * (steps + 1)
    later = np.linspace(first, n - steps - 1, _RANDOM).astype(int)
    motion = Motion(
        time=np.arange(n) * time_step,
        position=np.zeros((n, 2)),
        heading=np.zeros(n),
        velocity=np.zeros((n, 3)),
        commands=commands,
        thrusters=tuple(t.name for t in vehicle.thrusters),
        source="trial",
    )
    return motion, np.concatenate([np.arange(held) * (steps + 1), later]), held


def reachable(vehicle: Vehicle, pool: Array, seed: int = 0) -> Envelope:
    """The envelope of velocities that a vehicle reaches in calm water under a pool of commands.

    Raises
    ------
    RequestError
        when its speeds grow without bound.
    """
    still, steps = calm(vehicle), 600
    motion, starts, _ = trial(still, pool, 0.1, steps, seed)
    done = rollout(still, motion, starts, steps)
    if done.diverged.any():
        raise RequestError(
            f"vehicle {vehicle.name}: its speeds grow without bound under its own thrusters, so they give no envelope; "
            "name a log after the model, whose speeds are the envelope then"
        )
    runs = [
        Motion(motion.time[: steps + 1], x[:, :2], x[:, 2], x[:, 3:], motion.commands[: steps + 1], motion.thrusters)
        for x in done.states
    ]
    return envelope_of(runs, still)


def _sides(count: int) -> list[Array]:
    """Directions among commands in which extremes are sought: all ahead, all astern, each against the rest."""
    found = [np.ones(count), -np.ones(count)]
    for k in range(count if count > 1 else 0):
        side = -np.ones(count)
        side[k] = 1.0
        found.append(side)
    return found
