"""The interface of a mission: commands over time in each thruster's own unit, the place to drive, and what stops it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import inf

import numpy as np

from ...physics.motion import Array
from ...physics.registry_members import objects_in
from ...physics.thrusters import Thruster, command_of, neutral_command
from ...physics.vehicle import Vehicle
from ...physics.worlds.manoeuvres import COMMAND_STEP, REST, Step, hold, thruster_commands

_DECIMALS = {"pwm": 0, "normalized": 3, "rad_s": 2, "newton": 2, "tau": 2}
"""To what commands are rounded: pulses are whole microseconds to every servo output."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a mission begins.

    Attributes
    ----------
    latitude, longitude : [deg]
    heading : on which it begins, clockwise from north [deg]
    """

    latitude: float
    longitude: float
    heading: float


@dataclass(frozen=True, slots=True, eq=False)
class Mission:
    """A manoeuvre as commands.

    Attributes
    ----------
    vehicle : whose thrusters are commanded
    steps : what is driven, see `Trial`
    fence : distance from where it begins at which it is broken off [m]
    speed : over ground, at which it is broken off [m/s]
    about : what it is for, in lines
    place : where it begins; None where nobody said
    """

    vehicle: Vehicle
    steps: tuple[Step, ...]
    fence: float
    speed: float = inf
    about: tuple[str, ...] = ()
    place: Place | None = None

    @property
    def thrusters(self) -> tuple[Thruster, ...]:
        """Those of the vehicle, one column of commands each."""
        return self.vehicle.thrusters

    @property
    def rest(self) -> tuple[float, ...]:
        """The command at which each thruster does not push, in its own unit."""
        return tuple(round(neutral_command(t), _DECIMALS[t.command]) + 0.0 for t in self.thrusters)

    @property
    def seconds(self) -> float:
        """Length, with the rest before and after [s]."""
        return 2.0 * REST + sum(step[0] for step in self.steps)

    @property
    def held(self) -> list[tuple[float, tuple[float, ...]]]:
        """Each set of commands with the time from which it is held [s]; the last one is at rest."""
        levels = np.array([step[1:] for step in self.steps])
        driven = self._rounded(thruster_commands(self.vehicle, levels[:, 0], levels[:, 1]))
        begins = REST + np.cumsum([0.0, *(step[0] for step in self.steps)])
        rows = [self.rest, *(tuple(row) for row in driven.tolist()), self.rest]
        return list(zip([0.0, *begins.tolist()], rows, strict=True))

    def series(self) -> tuple[Array, Array]:
        """Time (n,) [s] and commands (n, thrusters) on the grid of `COMMAND_STEP`, each held until the next."""
        level = hold(*self.steps)
        rest = np.tile(self.rest, (round(REST / COMMAND_STEP), 1))
        driven = self._rounded(thruster_commands(self.vehicle, level[:, 0], level[:, 1]))
        commands = np.concatenate([rest, driven, rest])
        return COMMAND_STEP * np.arange(len(commands), dtype=float), commands

    def shares(self, commands: Sequence[float]) -> list[float]:
        """Commands as shares of full command, -1 to 1."""
        pairs = zip(self.thrusters, commands, strict=True)
        return [round(float(t.curve.normalised(np.array(c), t.command)), 4) + 0.0 for t, c in pairs]

    def _rounded(self, commands: Array) -> Array:
        """Commands as they are sent, within the ends of each thruster's curve."""
        columns = []
        for thruster, column in zip(self.thrusters, commands.T, strict=True):
            low, high = np.sort(np.round(command_of(thruster, np.array([-1.0, 1.0])), 6))
            columns.append(np.clip(np.round(column, _DECIMALS[thruster.command]), low, high) + 0.0)
        return np.column_stack(columns)


@dataclass(frozen=True, slots=True)
class MissionFormat:
    """A file of a mission.

    Attributes
    ----------
    name : of the file
    about : who reads it, in a sentence
    content : of the file
    needs_place : it cannot be made without a place
    """

    name: str
    about: str
    content: Callable[[Mission], str]
    needs_place: bool = False


@cache
def mission_formats() -> tuple[MissionFormat, ...]:
    """Every format that a file of this folder offers, in the order of their files."""
    from .. import missions

    return objects_in(missions, MissionFormat)
