"""A trial of bounded thrust: extremes held and random commands, met from rest; and how fast a vehicle goes in it."""

from itertools import product

import numpy as np

from ..errors import RequestError
from ..forces import calm
from ..frames import Array
from ..laws import Envelope, envelope_of
from ..motion import Motion
from ..simulation import Rollouts, rollout
from ..thrusters import command_of
from ..vehicle import Vehicle

_HOLDS = (2.0, 8.0)
"""Random commands last between these times [s]."""
_RANDOM = 24
_LEVELS = 5
_MOST = 2000
_STEPS = 600
_SETTLING, _LITTLE = 0.95, 0.01
"""A held speed settles where 20 s gain less than this share of the 20 s before, or this share of the largest speed."""


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
    still = calm(vehicle)
    motion, done, _ = _tried(vehicle, pool, seed)
    if done.diverged.any():
        raise RequestError(
            f"vehicle {vehicle.name}: its speeds grow without bound under its own thrusters, so they give no envelope; "
            "name a log after the model, whose speeds are the envelope then"
        )
    rows = done.states.shape[1]
    runs = [
        Motion(motion.time[:rows], x[:, :2], x[:, 2], x[:, 3:], motion.commands[:rows], motion.thrusters)
        for x in done.states
    ]
    return envelope_of(runs, still)


def settling_speeds(vehicle: Vehicle, pool: Array, seed: int = 0) -> tuple[float, float] | None:
    """Largest speed [m/s] and yaw rate [rad/s] that a vehicle reaches in calm water in a trial of 60 s.

    None where they tell no bound: where a rollout diverges, or under a held command gains as much in the last 20 s as
    in the 20 s before, as a hull does that nothing brakes. A speed that settles gains ever less.
    """
    _, done, held = _tried(vehicle, pool, seed)
    speed = np.linalg.norm(done.states[..., 3:5], axis=-1)
    turning = np.abs(done.states[..., 5])
    if done.diverged.any() or not np.isfinite(speed).all() or not np.isfinite(turning).all():
        return None
    for size in (speed[:held], turning[:held]):
        third = (size.shape[1] - 1) // 3
        early, late, last = (size[:, k * third] for k in (1, 2, 3))
        growing = last - late > np.maximum(_SETTLING * (late - early), _LITTLE * size.max())
        if growing.any():
            return None
    return float(speed.max()), float(turning.max())


def _tried(vehicle: Vehicle, pool: Array, seed: int) -> tuple[Motion, Rollouts, int]:
    """The trial of a vehicle in calm water, 60 s, its rollouts, and how many of them hold a command."""
    motion, starts, held = trial(vehicle, pool, 0.1, _STEPS, seed)
    return motion, rollout(calm(vehicle), motion, starts, _STEPS), held


def _sides(count: int) -> list[Array]:
    """Directions among commands in which extremes are sought: all ahead, all astern, each against the rest."""
    found = [np.ones(count), -np.ones(count)]
    for k in range(count if count > 1 else 0):
        side = -np.ones(count)
        side[k] = 1.0
        found.append(side)
    return found
