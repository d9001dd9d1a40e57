"""A trial of bounded thrust: extremes held and random commands, met from rest; and how fast a vehicle goes in it."""

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from ...batch_rates import Flattened, Terms
from ...forces import calm, held_thrust
from ...integration import Answer, Rollouts, integrate_stiff
from ...momentum_balance import mass_matrix
from ...motion import Array, Motion
from ...thrusters import command_of
from ...vehicle import Vehicle
from ..damping_power import Envelope, envelope_of, mass_margin
from ..energy import full_force

SECONDS = 60.0
"""Shortest trial [s]; four times as long, and again, where a vehicle's speeds take longer to settle."""
STEPS = 600
"""Steps of a trial, whatever its length: 0.1 s in the shortest, as logs are prepared."""
_LONGER, _LONGEST = 4.0, 5
"""Factor between the lengths that are tried, and their number: the last is 4 hours, enough for any ship."""
FASTEST = 1e5
"""Speed [m/s] and yaw rate [rad/s] beyond which a trial has diverged; a toy spins at some thousands."""
_HOLDS = (20, 80)
"""Random commands last between these steps: 2 to 8 s in 60."""
_RANDOM = 24
"""Trials with random commands: of 5 s each on average, they meet some 290 in the shortest trial."""
_LEVELS = 5
"""Levels of each thruster: none, half and full, ahead and astern."""
_MOST = 2000
"""Commands of all thrusters together: all levels of up to four, and as many drawn where there are more."""
_SETTLED, _SLOWING = 0.02, 0.9
"""Held speeds settle where the last third of a trial tops the rest by less than this share of the largest, or of what
the middle third added: what nothing brakes adds as much in each third, and what settles ever less."""
_NOTHING = 1e-6
"""Speed [m/s] and yaw rate [rad/s] that are rounding, which a hull that does not hold its course lets grow."""
_BEGINNING = 3.0
"""Time [s] of full thrust on a hull that nothing stops which gives its envelope: it has no speed of its own."""


def possible_commands(vehicle: Vehicle, seed: int = 0) -> Array:
    """Commands of all thrusters together (m, thrusters), from full astern to full ahead."""
    count = len(vehicle.thrusters)
    levels = np.linspace(-1.0, 1.0, _LEVELS)
    if _LEVELS**count <= _MOST:
        fractions = np.array(list(product(levels, repeat=count)))
    else:
        fractions = np.random.default_rng([seed, 9]).choice(levels, size=(_MOST, count))
    return np.column_stack([command_of(t, fractions[:, k]) for k, t in enumerate(vehicle.thrusters)])


def trial_commands(pool: Array, seed: int) -> tuple[Array, int]:
    """Commands (starts, STEPS + 1, thrusters) that are met from rest: extremes of a pool held, then random ones.

    Returns
    -------
    (commands, held)
        the first `held` of them are one command that lasts
    """
    rng = np.random.default_rng([seed, 3])
    extremes = np.stack([pool[int(np.argmax(pool @ side))] for side in _sides(pool.shape[1])])
    held = np.repeat(extremes[:, None], STEPS + 1, axis=1)
    lengths = rng.integers(*_HOLDS, (_RANDOM, STEPS // _HOLDS[0] + 2)).cumsum(axis=1)
    chosen = rng.integers(0, pool.shape[0], lengths.shape)
    rows = [chosen[k, np.searchsorted(lengths[k], np.arange(STEPS + 1), side="right")] for k in range(_RANDOM)]
    return np.concatenate([held, pool[np.stack(rows)]]), held.shape[0]


def trial_motion(vehicle: Vehicle, commands: Array, time_step: float) -> tuple[Motion, np.ndarray]:
    """The same as one motion at rest, for models that are rolled out along a motion, and the rows to start from.

    Parameters
    ----------
    vehicle : whose commands they are
    commands : (trials, rows, thrusters), each in its unit
    time_step : [s]
    """
    count, rows, _ = commands.shape
    n = count * rows
    motion = Motion(
        time=np.arange(n) * time_step,
        position=np.zeros((n, 2)),
        heading=np.zeros(n),
        velocity=np.zeros((n, 3)),
        commands=commands.reshape(n, -1),
        thrusters=tuple(t.name for t in vehicle.thrusters),
        source="trial",
        minutes=np.zeros(n),
    )
    return motion, np.arange(count) * rows


def rolled(answer: Answer, commands: Array, seconds: float) -> Rollouts:
    """Rollouts from rest, heading north, under every other command of a trial that lasts so long [s].

    Parameters
    ----------
    answer : acceleration of a model from velocity, heading and a row of the commands
    commands : (trials, rows, k), whatever `answer` takes
    seconds : of a rollout [s]
    """
    chosen = commands[:, ::2]
    h = seconds / (chosen.shape[1] - 1)
    with np.errstate(over="ignore", invalid="ignore"):
        return integrate_stiff(answer, np.zeros((chosen.shape[0], 6)), chosen, h, FASTEST)


@dataclass(frozen=True, slots=True, eq=False)
class Settling:
    """Speeds of a vehicle in a trial in calm water.

    Attributes
    ----------
    seconds : length of the trial in which held speeds settle; of the longest one, where they do not [s]
    settles : whether they do
    speed, turning : largest speed [m/s] and yaw rate [rad/s]
    velocity : of all rollouts (starts, rows, 3); held commands for `seconds`, random ones for 60 s
    """

    seconds: float
    settles: bool
    speed: float
    turning: float
    velocity: Array


def settling(vehicle: Vehicle, pool: Array, seed: int = 0) -> Settling:
    """Roll a vehicle out under extreme and random commands, the former until its speeds settle, if they do.

    Parameters
    ----------
    vehicle : that is rolled out
    pool : commands (n, thrusters)
    seed : of the random ones
    """
    commands, held = trial_commands(pool, seed)
    terms = Terms(calm(vehicle))
    rates = cache(lambda batch: Flattened([(terms, batch)], placed=False))  # a batch of each size has its own
    both = (each.reshape(-1, *commands.shape[:2]) for each in held_thrust(vehicle, commands.reshape(-1, pool.shape[1])))
    thrust = np.concatenate([terms.accelerations(each) for each in both]).transpose(1, 2, 0)

    def answer(nu: Array, psi: Array, pushed: Array) -> Array:
        state = np.vstack([np.zeros((2, psi.size)), psi, nu.T, nu.T[1:]])  # a wake that has settled
        return rates(psi.size)(state, (pushed[:, :3].T, pushed[:, 3:].T, None, 0.0))[3:6].T

    done, seconds = rolled(answer, thrust, SECONDS), SECONDS
    random, done = (Rollouts(done.states[rows], done.diverged[rows]) for rows in (slice(held, None), slice(held)))
    for _ in range(_LONGEST):
        settles = not done.diverged.any() and _settles(done.states[..., 3:])
        if settles or done.diverged.any():
            break
        seconds *= _LONGER
        done = rolled(answer, thrust[:held], seconds)
    velocity = np.concatenate([done.states[..., 3:], random.states[..., 3:]])
    # Random commands may drive a hull of faint damping beyond all speeds; whether it is braked, the held ones tell.
    speed = float(np.linalg.norm(velocity[..., :2], axis=-1).max())
    return Settling(seconds, settles, speed, float(np.abs(velocity[..., 2]).max()), velocity)


def reachable(vehicle: Vehicle, pool: Array, seed: int = 0) -> tuple[Envelope, str]:
    """The envelope of velocities that a vehicle reaches in calm water under a pool of commands, and how it was found.

    A hull that nothing stops has no speeds of its own: then full thrust acts for a moment. One without a positive mass
    does not move as anything does: then the box is one unit wide.

    Parameters
    ----------
    vehicle : that is rolled out
    pool : commands (n, thrusters)
    seed : of the random ones
    """
    if mass_margin(vehicle) <= 0.0:
        return Envelope((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)), "a box of one unit, as its mass is that of no vehicle"
    found = settling(vehicle, pool, seed)
    velocity, source = found.velocity.reshape(-1, 3), "the speeds that the vehicle reaches with its thrusters"
    if not found.settles:
        most = _BEGINNING * full_force(vehicle) / np.diag(mass_matrix(vehicle))
        velocity = np.stack([most, -most])
        source = f"{_BEGINNING:g} s of full thrust, as the vehicle's speeds grow without bound"
    n = velocity.shape[0]
    names = tuple(t.name for t in vehicle.thrusters)
    idle = np.zeros((n, len(names)))
    run = Motion(np.arange(n, dtype=float), np.zeros((n, 2)), np.zeros(n), velocity, idle, names)
    return envelope_of([run], calm(vehicle)), source


def _settles(velocity: Array) -> bool:
    """True when the speeds and yaw rates of held commands (n, rows, 3) have settled in the last third."""
    for size in (np.linalg.norm(velocity[..., :2], axis=-1), np.abs(velocity[..., 2])):
        third = size.shape[1] // 3
        early, late, last = (size[:, : k * third + 1].max(axis=1) for k in (1, 2, 3))
        few = _SETTLED * size.max(axis=1) + _NOTHING
        if (last - late > np.maximum(few, _SLOWING * (late - early))).any():
            return False
    return True


def _sides(count: int) -> list[Array]:
    """Directions among commands in which extremes are sought: all ahead, all astern, each against the rest."""
    result = [np.ones(count), -np.ones(count)]
    for k in range(count if count > 1 else 0):
        side = -np.ones(count)
        side[k] = 1.0
        result.append(side)
    return result
