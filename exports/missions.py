"""A manoeuvre for whoever drives it: commands over time for autopilot, ground station, robot and table."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, cos, inf, isfinite, pi, radians, sin
from pathlib import Path

import numpy as np

from ..physics.errors import RequestError
from ..physics.motion import Array
from ..physics.thrusters import Thruster, command_of, neutral_command
from ..physics.vehicle import Vehicle
from ..physics.worlds.manoeuvres import COMMAND_STEP, REST, Step, hold, side, thruster_commands
from .known_facts import filled, remarks

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
    read_as : by command channel of a thruster in pulses, scale and offset [us] that made the vehicle's of the boat's
    """

    vehicle: Vehicle
    steps: tuple[Step, ...]
    fence: float
    speed: float = inf
    about: tuple[str, ...] = ()
    place: Place | None = None
    read_as: Mapping[str, tuple[float, float]] = field(default_factory=dict)

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
        driven = self._commands(np.array([step[1:] for step in self.steps]))
        begins = REST + np.cumsum([0.0, *(step[0] for step in self.steps)])
        rows = [self.rest, *map(tuple, driven.tolist()), self.rest]
        return list(zip([0.0, *begins.tolist()], rows, strict=True))

    def series(self) -> tuple[Array, Array]:
        """Time (n,) [s] and commands (n, thrusters) on the grid of `COMMAND_STEP`, each held until the next."""
        rest = np.tile(self.rest, (round(REST / COMMAND_STEP), 1))
        commands = np.concatenate([rest, self._commands(hold(*self.steps)), rest])
        return COMMAND_STEP * np.arange(len(commands), dtype=float), commands

    def sent(self, commands: Sequence[float]) -> tuple[float, ...]:
        """Commands of the vehicle as the boat takes them: a pulse that was turned round when read, as it was."""
        found = list(commands)
        for k, thruster in enumerate(self.thrusters):
            if thruster.channel in self.read_as:
                scale, offset = self.read_as[thruster.channel]
                found[k] = round((commands[k] - offset) / scale, 3) + 0.0
        return tuple(found)

    def shares(self, commands: Sequence[float]) -> list[float]:
        """Commands as shares of full command, -1 to 1."""
        pairs = zip(self.thrusters, commands, strict=True)
        return [round(float(t.curve.normalised(np.array(c), t.command)), 4) + 0.0 for t, c in pairs]

    def _commands(self, levels: Array) -> Array:
        """Commands of levels ahead and of turn (n, 2) as they are sent, within the ends of each thruster's curve."""
        columns, commands = [], thruster_commands(self.vehicle, levels[:, 0], levels[:, 1])
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


def _table(mission: Mission) -> str:
    """A row each 0.1 s; a command is held until the next row."""
    time, commands = mission.series()
    lines = [",".join(["time", *(t.channel for t in mission.thrusters)])]
    rows = zip(time.tolist(), map(mission.sent, commands.tolist()), strict=True)
    lines += [",".join([f"{t:.1f}", *(f"{c:.10g}" for c in row)]) for t, row in rows]
    return "\n".join(lines) + "\n"


def _node(mission: Mission) -> str:
    """A ROS 2 node that publishes each thruster's command on a topic of its own, and stops all of them at its end."""
    rows = [f"    ({begin!r}, {mission.sent(row)!r})," for begin, row in mission.held]
    return remarks(mission.about) + filled(
        Path(__file__).with_name("mission_node.py.in"),
        topics=tuple(t.channel for t in mission.thrusters),
        rest=mission.sent(mission.rest),
        rows="\n".join(rows),
        seconds=mission.seconds,
    )


SCRIPT_COMMAND = 71
"""First parameter of NAV_SCRIPT_TIME, by which the script knows that it is meant: any number from 0 to 255."""
_NAV_WAYPOINT, _NAV_SCRIPT_TIME = 16, 42702
_ABSOLUTE, _RELATIVE = 0, 3
"""MAV_FRAME_GLOBAL of the home position, and MAV_FRAME_GLOBAL_RELATIVE_ALT."""
_LEAD_IN = 20.0
"""Metres before the start at which the boat turns onto its heading."""
_STILL = 5
"""Seconds that the boat holds still at the start, before the script's own rest."""
_MOST_TIMEOUT = 255
"""Seconds after which ArduPilot ends a script's step, at most: the parameter has one byte."""
_SPARE = 10
"""Seconds by which that is later than the script's own end."""
_METRES_A_DEGREE = 6378137.0 * pi / 180.0
"""Of latitude, on the sphere of WGS 84's equator: 0.6 % off at the poles, which is 0.1 m here."""


def _waypoints(mission: Mission) -> str:
    """A waypoint file (QGC WPL 110): go to the start, come to rest, hand over to the script, come back.

    A line has twelve columns apart by tabs: number, current, frame, command, four parameters, latitude, longitude
    [deg], altitude [m], autocontinue (https://mavlink.io/en/file_formats/#mission_plain_text_file). The script is
    called by MAV_CMD_NAV_SCRIPT_TIME, which ArduPilot Rover has from 4.3 on.
    """
    place = mission.place
    if place is None:
        raise RequestError("plan: a waypoint file needs a place; give --at LAT,LON")
    angle, start = radians(place.heading), (place.latitude, place.longitude)
    north, east = -_LEAD_IN * cos(angle), -_LEAD_IN * sin(angle)
    before = (
        start[0] + north / _METRES_A_DEGREE,
        start[1] + east / (_METRES_A_DEGREE * cos(radians(start[0]))),
    )
    timeout = min(_MOST_TIMEOUT, ceil(mission.seconds - 1e-9) + _SPARE)
    items = [
        (_ABSOLUTE, _NAV_WAYPOINT, (0, 0), start),
        (_RELATIVE, _NAV_WAYPOINT, (0, 0), before),
        (_RELATIVE, _NAV_WAYPOINT, (_STILL, 0), start),
        (_RELATIVE, _NAV_SCRIPT_TIME, (SCRIPT_COMMAND, timeout), (0.0, 0.0)),
        (_RELATIVE, _NAV_WAYPOINT, (0, 0), start),
    ]
    lines = ["QGC WPL 110"]
    for number, (frame, command, (one, two), (latitude, longitude)) in enumerate(items):
        cells = [number, int(number == 0), frame, command, one, two, 0, 0]
        lines.append("\t".join([*map(str, cells), f"{latitude:.8f}", f"{longitude:.8f}", "0", "1"]))
    return "\n".join(lines) + "\n"


_FUNCTIONS = {-1: 73, 1: 74, 0: 70}
"""SERVOn_FUNCTION of the thrusters at port (ThrottleLeft), at starboard, and on the centre line (Throttle)."""
_PULSES = {
    True: "the pulse itself [us]",
    False: "share of full command, made a pulse by SERVOn_MIN, _TRIM, _MAX and _REVERSED",
}


def _thruster(thruster: Thruster) -> str:
    pulse = thruster.command == "pwm"
    func = _FUNCTIONS[side(thruster)]
    return f"  {{ func = {func}, pulse = {str(pulse).lower()} }}, -- {thruster.name}: {_PULSES[pulse]}"


def _script(mission: Mission) -> str:
    """A Lua script for ArduPilot Rover: the commands straight to the thrusters' outputs, and all that stops them.

    It runs in the step NAV_SCRIPT_TIME of a mission, so in the mode Auto, and overrides outputs a fifth of a second at
    a time (`SRV_Channels:set_output_pwm_chan_timeout`): whoever changes the mode, or a script that dies, gives the boat
    back to the autopilot. Functions are those of ArduPilot's scripting documentation
    (libraries/AP_Scripting/docs/docs.lua).
    """
    # The thrusters that push ahead, resting or not; those that push sideways the autopilot keeps.
    ahead = [k for k, t in enumerate(mission.thrusters) if abs(cos(t.angle)) >= 0.5]
    driven = ahead or range(len(mission.thrusters))

    def commands(row: Sequence[float]) -> str:
        pulses, shares = mission.sent(row), mission.shares(row)
        own = [pulses[k] if mission.thrusters[k].command == "pwm" else shares[k] for k in driven]
        return ", ".join(f"{value:.10g}" for value in own)

    rows = [f"  {{ from = {begin:g}, commands = {{ {commands(row)} }} }}," for begin, row in mission.held]
    return remarks(mission.about, "-- ") + filled(
        Path(__file__).with_name("mission.lua.in"),
        command=SCRIPT_COMMAND,
        fence=f"{mission.fence:g}",
        speed=f"{mission.speed:g}" if isfinite(mission.speed) else "math.huge",
        seconds=f"{mission.seconds:g}",
        thrusters="\n".join(_thruster(mission.thrusters[k]) for k in driven),
        rows="\n".join(rows),
    )


MISSION_FORMATS = (
    MissionFormat("mission.csv", "a table of the commands, for whatever plays one back", _table),
    MissionFormat("mission.lua", "a script for ArduPilot Rover 4.3 or later, started by mission.waypoints", _script),
    MissionFormat("mission_node.py", "a node for ROS 2: python3 mission_node.py publishes the commands", _node),
    MissionFormat(
        "mission.waypoints", "waypoints for a ground station, with the step that starts mission.lua", _waypoints, True
    ),
)
"""Every file of a mission."""
