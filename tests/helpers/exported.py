"""Boats that together have every effect, and how whatever runs an export is compared with undertow's own simulation."""

import os
import subprocess
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from undertow.exports.formats.base import Choices, Given
from undertow.exports.formats.registry import format_named
from undertow.exports.known_facts import KnownFacts
from undertow.exports.program.functions import Function
from undertow.exports.program.model_program import Program, program_of
from undertow.exports.program.vectors import drawn, driven, error
from undertow.physics.laws.audit.trial import possible_commands, reachable
from undertow.physics.laws.damping_power import Envelope
from undertow.physics.vehicle import Vehicle, load_vehicle

EVERYTHING = {
    "fouling_rate": 0.02,
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
BOATS: dict[str, Callable[[], Vehicle]] = {
    "as it is": lambda: load_vehicle("blueboat"),
    "table, everything": lambda: load_vehicle("otter").with_values(EVERYTHING),
    "propeller, everything": lambda: load_vehicle("blueboat_paper").with_values(EVERYTHING),
    "delay of whole steps": lambda: load_vehicle("cybership2").with_values({"delay": 0.1, "current_north": 0.1}),
    "lag alone": lambda: load_vehicle("otter").with_values({"lag": 0.4, "memory_yaw": 3.0}),
}
FEW, MANY = 1, 100
"""Rollouts: one of 10 s in every run of the tests, and of 30 s with --all."""
EXACT, SINGLE = 1e-9, 1e-4


@cache
def boat(name: str) -> Vehicle:
    return BOATS[name]()


@cache
def envelope(name: str) -> Envelope:
    return reachable(boat(name), possible_commands(boat(name)))[0]


def facts(name: str) -> KnownFacts:
    return KnownFacts(boat(name).name, name, "0", envelope(name), "made up", ("pass",), ("mass = 1 kg",))


def written(name: str, to: str, path: Path, choices: Choices | None = None) -> Path:
    """Write a boat in a format."""
    for each, content in format_named(to).files(Given(boat(name), facts(name), choices or Choices()), path).items():
        each.write_bytes(content)
    return path


@cache
def program(name: str) -> Program:
    return program_of(boat(name), Choices().time_step)


Row = Callable[[Function, np.ndarray], np.ndarray]
"""What a function of the export gives for one row of all its inputs, side by side."""


def compare_states(name: str, answer: Callable[[Function, np.ndarray], np.ndarray], most: float = EXACT) -> None:
    """1,000 states and commands; `answer` gives the derivatives of inputs (rows, numbers)."""
    states = drawn(program(name), envelope(name), 1000)
    assert error(answer(program(name).derivatives, states.inputs), states.expected) < most


def compare_rollouts(name: str, one: Row, count: int, most: float = EXACT) -> None:
    """Rollouts, one after the other."""
    for seed in range(count):
        rolled = driven(program(name), envelope(name), seconds(count), seed)
        state = one(program(name).start, rolled.start)
        found = [state[:6]]
        for row in rolled.steps:
            state = one(program(name).step, np.concatenate([state, row]))
            found.append(state[:6])
        assert error(np.array(found), rolled.expected) < most


def seconds(count: int) -> float:
    """Length of each of so many rollouts [s]."""
    return 30.0 if count == MANY else 10.0


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
