"""Test vectors: states and commands drawn at random, with what undertow's own simulation says of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...physics.batch_rates import Flattened, Terms
from ...physics.forces import current_at, held_thrust, remaining_thrust
from ...physics.integration import Legs, rollouts
from ...physics.laws.damping_power import Envelope
from ...physics.motion import Array, Motion, earth_to_body
from ...physics.thrusters import command_of
from ...physics.vehicle import Vehicle
from .model_program import Program
from .symbols import Function

_HOLD = 1.0
"""Time from one random command to the next [s]; between them they are linear, as a record of a moving stick is."""
_WIND, _MINUTES, _PLACE = 8.0, 10.0, 100.0
"""Most wind [m/s], time since the beginning of a log [min], and distance from the origin [m]: of a day on a lake."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """Inputs of a function in rows, all groups side by side, and what it should give."""

    inputs: Array
    expected: Array


@dataclass(frozen=True, slots=True)
class Driven:
    """A rollout: what `start` takes, what `step` takes beside the state (a row a step), and motions (steps + 1, 6)."""

    start: Array
    steps: Array
    expected: Array


def commands_of(vehicle: Vehicle, fraction: Array) -> Array:
    """Commands (n, thrusters) in the units of the thrusters from fractions of full command."""
    return np.column_stack([command_of(t, fraction[:, k]) for k, t in enumerate(vehicle.thrusters)])


def drawn(program: Program, envelope: Envelope, rows: int) -> Drawn:
    """States and commands within an envelope, and their derivatives as rollouts of undertow work them out."""
    rng = np.random.default_rng([0, 1])
    vehicle, function = program.vehicle, program.derivatives
    low, high = np.array(envelope.lower), np.array(envelope.upper)
    relative = rng.uniform(low, high, (rows, 3))
    heading, minutes = rng.uniform(-np.pi, np.pi, rows), rng.uniform(0.0, _MINUTES, rows)
    ground = relative + np.column_stack([*_water(vehicle, heading, minutes), np.zeros(rows)])
    wake = rng.uniform(low[1:], high[1:], (rows, 2))
    place = rng.uniform(-_PLACE, _PLACE, (rows, 2))
    count = len(vehicle.thrusters)
    commands, lagged = (commands_of(vehicle, rng.uniform(-1.0, 1.0, (rows, count))) for _ in range(2))
    air = rng.uniform(-_WIND, _WIND, (rows, 2))
    slow = [k for k, t in enumerate(vehicle.thrusters) if t.lag > 0.0]
    motion = np.column_stack([place, heading, ground, wake])
    acting = commands.copy()
    acting[:, slow] = lagged[:, slow]
    left = np.array([remaining_thrust(t, minutes) for t in vehicle.thrusters])
    terms = Terms(vehicle)
    force, load = (terms.accelerations((left * part)[:, None])[:, 0] for part in held_thrust(vehicle, acting))
    found = Flattened([(terms, rows)])(motion.T.copy(), (force, load, air.T, minutes)).T
    members = len(program.rates.inputs[0].members)
    following = [(commands[:, k] - lagged[:, k]) / vehicle.thrusters[k].lag for k in slow]
    groups = {
        "state": np.column_stack([motion[:, :members], lagged[:, slow]]),
        "command": commands,
        "air": air,
        "minutes": minutes[:, None],
    }
    inputs = np.concatenate([groups[group.name] for group in function.inputs], axis=1)
    return Drawn(inputs, np.column_stack([found[:, :members], *following]))


def driven(program: Program, envelope: Envelope, seconds: float, seeds: Sequence[int] = (0,)) -> list[Driven]:
    """Rollouts from states within an envelope, under commands and wind that change all the time; one a seed."""
    asked = [_asked(program, envelope, seconds, seed) for seed in seeds]
    legs = [(program.vehicle, Legs(one, np.array([0]), one.time.size - 1)) for one in asked]
    result = []
    for motion, rolled in zip(asked, rollouts(legs), strict=True):
        expected, air, clock = rolled.states[0], motion.air, motion.minutes[:, None]
        assert air is not None
        groups = {"motion": expected[:1], "command": motion.commands, "air": air, "minutes": clock}
        steps = groups | {"command": motion.commands[1:], "air": air[1:], "minutes": clock[:-1]}
        result.append(Driven(_beside(program.start, groups, 0)[0], _beside(program.step, steps, 1), expected))
    return result


def _asked(program: Program, envelope: Envelope, seconds: float, seed: int) -> Motion:
    """A motion whose first row and whose commands and wind a rollout takes."""
    rng = np.random.default_rng([seed, 2])
    vehicle, step = program.vehicle, program.time_step
    time = step * np.arange(round(seconds / step) + 1, dtype=float)
    knots = np.arange(0.0, seconds + 2.0 * _HOLD, _HOLD)

    def wandering(size: float, columns: int) -> Array:
        levels = rng.uniform(-size, size, (knots.size, columns))
        return np.column_stack([np.interp(time, knots, levels[:, k]) for k in range(columns)])

    commands = commands_of(vehicle, wandering(1.0, len(vehicle.thrusters)))
    air = wandering(_WIND, 2)
    heading, begun = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, _MINUTES)
    first = rng.uniform(envelope.lower, envelope.upper)
    first[:2] += np.array(_water(vehicle, heading, begun))
    lying = Motion.at_rest(step, commands, tuple(t.name for t in vehicle.thrusters), heading=heading)
    return replace(lying, velocity=np.tile(first, (time.size, 1)), air=air, minutes=begun + time / 60.0)


def _beside(function: Function, groups: dict[str, Array], skipped: int) -> Array:
    """Groups that a function takes side by side, without the first few."""
    taken = [groups[group.name] for group in function.inputs[skipped:]]
    rows = min(map(len, taken))
    return np.concatenate([part[:rows] for part in taken], axis=1)


def _water(vehicle: Vehicle, heading: Array | float, minutes: Array | float) -> tuple[Array, Array]:
    """Velocity of the water ahead and to starboard [m/s]."""
    north, east = current_at(vehicle, minutes) or (0.0, 0.0)
    return earth_to_body(np.asarray(heading), north, east)
