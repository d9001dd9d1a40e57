"""Boats that together have every effect, and how whatever runs an export is compared with undertow's own simulation."""

import os
import subprocess
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from undertow.exports.formats.base import Choices, Given, format_named
from undertow.exports.known_facts import KnownFacts, KnownNumber
from undertow.exports.program.model_program import Program, program_of
from undertow.exports.program.symbols import Function
from undertow.exports.program.vectors import drawn, driven
from undertow.physics.laws.audit.bounded import possible_commands, reachable
from undertow.physics.laws.damping_power import Envelope
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle, load_vehicle, shipped_vehicles
from undertow.physics.worlds.hidden_effects import with_hull

EVERYTHING = {
    "fouling_rate": 0.02,
    "cross_flow": 0.9,
    "current_north": 0.1,
    "current_rate_east": 0.05,
    "y_g": 0.01,
    "yaw_trim": 0.2,
    "lag": 0.3,
    "delay": 0.17,
    "dead_zone": 0.05,
    "thrust_exponent": 1.3,
    "thrust_rate": -0.05,
    "gain_ahead_67": 0.7,
    "gain_astern_33": 1.4,
    "reverse_scale": 0.6,
    "advance_loss": 0.4,
    "memory_sway": 3.0,
    "memory_yaw": 0.4,
    "memory_time": 1.7,
    "yaw:u|v|": -0.3,
    "surge:vr": -0.4,
    "wind_x": 0.1,
    "wind_y": 0.2,
    "wind_n": 0.05,
    "wind_force_north": 1.0,
    "wind_force_east": -0.5,
}
"""Of every kind of effect one, and what stands in no catalogue."""
_WATER = {"delay": 0.1, "current_north": 0.1, "memory_sway": 0.5, "memory_yaw": 0.2}
_AT_ONCE = {"dead_zone": 0.08, "thrust_exponent": 1.4, "wind_x": 0.2, "wind_force_east": 2.0, "surge:vr": -0.4}
BOATS: dict[str, Callable[[], Vehicle]] = {
    "as it is": lambda: load_vehicle("blueboat"),
    **{name: partial(load_vehicle, name) for name in shipped_vehicles() if name != "blueboat"},
    "table, everything": lambda: load_vehicle("otter").with_values(EVERYTHING),
    "propeller, everything": lambda: _stated(load_vehicle("blueboat_paper")).with_values(EVERYTHING),
    "delay of whole steps": lambda: load_vehicle("cybership2").with_values(_WATER),
    "lag alone": lambda: load_vehicle("otter").with_values({"lag": 0.4}),
    "nothing late": lambda: load_vehicle("blueboat_paper").with_values(_AT_ONCE),
    "one thruster alone": lambda: _uneven(load_vehicle("blueboat")),
}
"""Every shipped vehicle, two with effects of every kind, and some that have a few kinds without the others."""
EXACT, SINGLE = 1e-9, 1e-4
STATES, _ROLLOUTS, _SECONDS = 1000, 100, 30.0
"""Random states and commands, rollouts, and length of each [s], in which a boat is compared."""


def _stated(vehicle: Vehicle) -> Vehicle:
    """A boat whose file states the size of its hull."""
    return with_hull(vehicle, np.random.default_rng(1))


def _uneven(vehicle: Vehicle) -> Vehicle:
    """A boat whose first thruster alone answers late, wears, and loses thrust ahead."""
    first, *others = vehicle.thrusters
    late = first.model_copy(update={"lag": 0.3, "delay": 0.12, "thrust_rate": -0.02, "advance_loss": 0.4})
    return vehicle.model_copy(update={"thrusters": (late, *others)}).checked()


@cache
def boat(name: str) -> Vehicle:
    return BOATS[name]()


@cache
def envelope(name: str) -> Envelope:
    return reachable(boat(name), possible_commands(boat(name)))[0]


def facts(name: str) -> KnownFacts:
    return KnownFacts(boat(name).name, name, "0", envelope(name), "made up", ("pass",), (KnownNumber("mass", "1 kg"),))


def written(name: str, to: str, path: Path, choices: Choices | None = None) -> Path:
    """Write a boat in a format."""
    for each, content in format_named(to).files(Given(boat(name), facts(name), choices or Choices()), path).items():
        each.write_bytes(content)
    return path


@cache
def program(name: str) -> Program:
    return program_of(boat(name), Choices().time_step)


Answer = Callable[[Function, np.ndarray], np.ndarray]
"""What a function of the export gives for rows of all its inputs, side by side."""


class Trips(NamedTuple):
    """Rollouts of a boat.

    Attributes
    ----------
    start : what `start` takes, (rollouts, numbers)
    steps : what `step` takes beside the state, (steps, rollouts, numbers)
    expected : undertow's own motions, (rollouts, steps + 1, 6)
    """

    start: np.ndarray
    steps: np.ndarray
    expected: np.ndarray


@cache
def trips(name: str) -> Trips:
    """100 rollouts of 30 s."""
    rolled = driven(program(name), envelope(name), _SECONDS, range(_ROLLOUTS))
    parts = [np.array([getattr(one, part) for one in rolled]) for part in ("start", "steps", "expected")]
    return Trips(parts[0], np.ascontiguousarray(parts[1].swapaxes(0, 1)), parts[2])


def error(found: Array, expected: Array) -> float:
    """Largest difference, as a share of the largest size in its column; not finite where something is not."""
    sizes = np.abs(expected).max(axis=0, initial=0.0)
    return float((np.abs(found - expected) / np.where(sizes > 0.0, sizes, 1.0)).max())


def compare_states(name: str, answer: Answer, most: float = EXACT) -> None:
    """1,000 states and commands; `answer` gives the derivatives."""
    states = drawn(program(name), envelope(name), STATES)
    assert error(answer(program(name).derivatives, states.inputs), states.expected) < most


def compare_rollouts(name: str, found: np.ndarray, most: float = EXACT) -> None:
    """100 rollouts of 30 s: motions (rollouts, steps + 1, 6)."""
    expected = trips(name).expected
    assert found.shape == expected.shape == (_ROLLOUTS, round(_SECONDS / program(name).time_step) + 1, 6)
    assert max(map(error, found, expected)) < most


def stepped(name: str, answer: Answer) -> np.ndarray:
    """Motions of all rollouts of a boat side by side, a step at a time."""
    state = answer(program(name).start, trips(name).start)
    found = [state[:, :6]]
    for rows in trips(name).steps:
        state = answer(program(name).step, np.concatenate([state, rows], axis=1))
        found.append(state[:, :6])
    return np.array(found).swapaxes(0, 1)


def run(words: Sequence[str | Path], folder: Path) -> str:
    """What a program prints that must succeed."""
    environment = {**os.environ, "LC_ALL": "C"}
    done = subprocess.run(
        [str(word) for word in words], cwd=folder, capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def needed(program_name: str, found: str | None, why: str) -> str:
    """The path of a program, or a test that is skipped and says so."""
    if found is None:
        pytest.skip(f"{program_name} is not here ({why}): tests/exports/install_programs.sh installs it")
    return found
