"""A Lua script for ArduPilot Rover: the commands straight to the thrusters' outputs, and all that stops them.

It runs in the step NAV_SCRIPT_TIME of a mission, so in the mode Auto, and overrides outputs a fifth of a second at a
time (`SRV_Channels:set_output_pwm_chan_timeout`): whoever changes the mode, or a script that dies, gives the boat back
to the autopilot. Functions are those of ArduPilot's scripting documentation (libraries/AP_Scripting/docs/docs.lua).
"""

from collections.abc import Sequence
from math import cos, isfinite
from pathlib import Path

from ...physics.thrusters import Thruster
from ...physics.worlds.manoeuvres import side
from ..known_facts import filled, remarks
from .base import Mission, MissionFormat
from .waypoint_file import SCRIPT_COMMAND

_FUNCTIONS = {-1: 73, 1: 74, 0: 70}
"""SERVOn_FUNCTION of the thrusters at port (ThrottleLeft), at starboard, and on the centre line (Throttle)."""
_PULSES = {
    True: "the pulse itself [us]",
    False: "share of full command, made a pulse by SERVOn_MIN, _TRIM, _MAX and _REVERSED",
}


def _driven(mission: Mission) -> list[int]:
    """The thrusters that push ahead, resting or not; those that push sideways the autopilot keeps."""
    ahead = [k for k, t in enumerate(mission.thrusters) if abs(cos(t.angle)) >= 0.5]
    return ahead or list(range(len(mission.thrusters)))


def _thruster(thruster: Thruster) -> str:
    pulse = thruster.command == "pwm"
    func = _FUNCTIONS[side(thruster)]
    return f"  {{ func = {func}, pulse = {str(pulse).lower()} }}, -- {thruster.name}: {_PULSES[pulse]}"


def _script(mission: Mission) -> str:
    driven = _driven(mission)

    def commands(row: Sequence[float]) -> str:
        shares = mission.shares(row)
        own = [row[k] if mission.thrusters[k].command == "pwm" else shares[k] for k in driven]
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


LUA = MissionFormat("mission.lua", "a script for ArduPilot Rover 4.3 or later, started by mission.waypoints", _script)
