"""The true boat: undertow's own simulation of a vehicle with its hidden effects, pushed about, seen through sensors."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from ..exports.formats.to_casadi import casadi_function
from ..exports.program.model_program import program_of
from ..physics.frames import Array
from ..physics.thrusters import neutral_command
from ..physics.vehicle import Vehicle
from ..physics.worlds.world import FINE_STEP, NOISE, Sensors
from .known_model import PERIOD, numbers

_STREAMS = {"sensors": 1, "push": 2, "current": 3}
"""Numbers that keep the random series of a world apart."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What no model knows of a world.

    Attributes
    ----------
    push : deviation of the acceleration by gusts and waves [m/s^2, m/s^2, rad/s^2]
    push_time : time in which they change [s]
    current : speed of a steady current from anywhere [m/s], beside what the vehicle has
    sensors : what the controller measures with
    """

    push: tuple[float, float, float] = (0.02, 0.02, 0.01)
    push_time: float = 2.0
    current: float = 0.05
    sensors: Sensors = NOISE["field"]

    @property
    def calm(self) -> "Surroundings":
        """The same without anything that disturbs: sensors are exact and the water stands."""
        return replace(self, push=(0.0, 0.0, 0.0), current=0.0, sensors=NOISE["clean"])


@final
class TrueBoat:
    """A boat at sea, at rest over ground at the origin, heading north.

    Commands go in a straight line from one period's end to the next. The same seed gives the same gusts, current and
    sensor noise whoever steers.

    Parameters
    ----------
    vehicle : the true one
    seconds : for which there are gusts
    """

    def __init__(self, vehicle: Vehicle, surroundings: Surroundings, seconds: float, seed: int) -> None:
        drift = np.random.default_rng([seed, _STREAMS["current"]]).uniform(-np.pi, np.pi)
        current = surroundings.current * np.array([np.cos(drift), np.sin(drift)])
        names = ("current_north", "current_east")
        self.vehicle = vehicle.with_values(
            {name: vehicle.value(name) + float(part) for name, part in zip(names, current, strict=True)}
        )
        program = program_of(self.vehicle, FINE_STEP, corrected="beside")
        self._groups = [group.name for group in program.step.inputs]
        self._step = casadi_function(program.step)
        self._fine = round(PERIOD / FINE_STEP)
        self._command = np.array([neutral_command(t) for t in vehicle.thrusters])
        begins = casadi_function(program.start)
        given = {"motion": np.zeros(6), "command": self._command, "minutes": 0.0, "air": np.zeros(2)}
        self._state = numbers(begins(*(given[group.name] for group in program.start.inputs)))
        rows = round(seconds / PERIOD) + 1
        self._pushes = _gusts(surroundings, rows, seed)
        own = surroundings.sensors
        deviation = np.array([own.position, own.position, own.heading, own.speed, own.speed, own.yaw_rate])
        self._noise = deviation * np.random.default_rng([seed, _STREAMS["sensors"]]).standard_normal((rows, 6))
        self._row = 0

    @property
    def motion(self) -> Array:
        """The truth (6,): north, east [m], psi [rad], u, v [m/s], r [rad/s]."""
        return self._state[:6]

    def measured(self) -> Array:
        """The motion (6,) as sensors have it."""
        return self.motion + self._noise[self._row]

    def advance(self, command: Array) -> None:
        """Go on for a `PERIOD`, in which the commands (thrusters,) go to these."""
        for k in range(1, self._fine + 1):
            given = {
                "state": self._state,
                "command": self._command + k / self._fine * (command - self._command),
                "added": self._pushes[self._row],
                "minutes": (self._row * PERIOD + (k - 1) * FINE_STEP) / 60.0,
                "air": np.zeros(2),
            }
            self._state = numbers(self._step(*(given[name] for name in self._groups)))
        self._command = command
        self._row += 1


def _gusts(surroundings: Surroundings, rows: int, seed: int) -> Array:
    """Accelerations (rows, 3): first-order processes of the given deviations."""
    rng = np.random.default_rng([seed, _STREAMS["push"]])
    keep = np.exp(-PERIOD / surroundings.push_time)
    found = rng.standard_normal((rows, 3))
    for k in range(1, rows):
        found[k] = keep * found[k - 1] + np.sqrt(1.0 - keep**2) * found[k]
    return found * np.array(surroundings.push)
