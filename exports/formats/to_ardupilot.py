"""Parameters of ArduPilot Rover for a boat that steers by its thrust, from the model's own steady runs.

What each means is that of ArduPilot's `AP_MotorsUGV` and `AR_AttitudeControl` (Rover 4.x): a motor is asked for a share
t of thrust, and gets (e - 1 + sqrt((1 - e)^2 + 4 e |t|)) / 2e of full output, where e is MOT_THST_EXPO. So the boat is
linear in t where its thrust grows with output o as (1 - e) o + e o^2.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...physics.errors import RequestError
from ...physics.momentum_balance import stated, values_of
from ...physics.motion import Array
from ...physics.thrusters import Thruster, command_of, neutral_command
from ...physics.vehicle import Vehicle
from ..approximation import Sides, missing_surroundings, sides_of
from ..known_facts import remarks
from .base import Export, Given

_SHARES = np.linspace(0.0, 1.0, 101)
"""Outputs at which the thrust curve is looked at."""
_CRUISE, _STEERING = 0.5, 0.1
"""Throttle of the cruise, and steering whose turn rate tells the feed-forward: in the middle of what there is."""
_MOST_FF = 3.0
"""Largest ATC_STR_RAT_FF that ArduPilot takes."""
_MOST_MIN, _MOST_ASYM = 20, 10.0
"""Largest MOT_THR_MIN [%] and MOT_THST_ASYM that ArduPilot takes."""
_CHANNELS = ((1, 73), (3, 74))
"""Output and function of the left and right throttle of a boat with skid steering, ArduPilot's default places."""


class Fitted(NamedTuple):
    """MOT_THST_EXPO, MOT_THST_ASYM, MOT_THR_MIN [%], and how far the thrust is then from linear [N]."""

    expo: float
    asymmetry: float
    least: int
    off: float


def output(throttle: Array, expo: float, least: float) -> Array:
    """Share of full output (-1 to 1) that ArduPilot's `get_scaled_throttle` gives for a throttle of -1 to 1."""
    size = np.where(throttle == 0.0, 0.0, least / 100.0 + np.abs(throttle) * (1.0 - least / 100.0))
    if expo:
        size = (expo - 1.0 + np.sqrt((1.0 - expo) ** 2 + 4.0 * expo * size)) / (2.0 * expo)
    return np.sign(throttle) * size


class Servo(NamedTuple):
    """SERVO_MIN, SERVO_TRIM and SERVO_MAX [us], and SERVO_REVERSED, of a thruster that is commanded in microseconds."""

    least: float
    trim: float
    most: float
    turned: bool


def servo(thruster: Thruster) -> Servo:
    """The output of a thruster that is commanded in microseconds, in whole ones as ArduPilot has them."""
    astern, rest, ahead = command_of(thruster, np.array([-1.0, 0.0, 1.0])).tolist()
    ends = min(astern, ahead), neutral_command(thruster), max(astern, ahead)
    least, trim, most = (float(round(x)) for x in ends)
    return Servo(least, trim, most, ahead < rest)


def commanded(thruster: Thruster, share: Array) -> Array:
    """Commands that ArduPilot sends for shares of full output: of a pulse, from its trim to each end in proportion."""
    if thruster.command != "pwm":
        return command_of(thruster, share)
    least, trim, most, turned = servo(thruster)
    asked = -share if turned else share
    return trim + asked * np.where(asked > 0.0, most - trim, trim - least)


def thrust(thruster: Thruster, share: Array) -> Array:
    """Force [N] of a lasting share of full output."""
    return thruster.lasting(commanded(thruster, share))[0]


def _dead(thruster: Thruster) -> float:
    """Share of full output ahead up to which a thruster's dead zone reaches."""
    rest, full = commanded(thruster, np.array([0.0, 1.0]))
    end = command_of(thruster, np.array(thruster.dead_zone))
    return float((end - rest) / (full - rest)) if thruster.dead_zone else 0.0


def fitted(sides: Sides) -> Fitted:
    """The parameters of the motors, from the mean of both thrust curves."""
    ahead, astern = (np.mean([thrust(t, s * _SHARES) for t in sides.thrusters()], axis=0) for s in (1.0, -1.0))
    full, back = float(ahead[-1]), float(-astern[-1])
    if full <= 0.0:
        raise RequestError("export --to ardupilot: full command does not push ahead; see the thrusters' curves")
    dead = max(map(_dead, sides.thrusters()))
    alive = dead < _SHARES
    # (1 - e) o + e o^2 is linear in e.
    bend, rest = (_SHARES**2 - _SHARES)[alive], (ahead / full - _SHARES)[alive]
    expo = round(float(np.clip(bend @ rest / (bend @ bend), -1.0, 1.0)), 2) + 0.0
    least = min(_MOST_MIN, round(100.0 * ((1.0 - expo) * dead + expo * dead**2)))
    asymmetry = round(float(np.clip(full / back, 1.0, _MOST_ASYM)), 2) if back > 0.0 else _MOST_ASYM
    asked = np.linspace(-1.0, 1.0, 201)  # shares of thrust from astern to ahead
    asked = asked[np.abs(asked) * asymmetry <= 1.0]
    share = output(np.where(asked < 0.0, asymmetry * asked, asked), expo, least)
    given = np.mean([thrust(t, share) for t in sides.thrusters()], axis=0)
    return Fitted(expo, asymmetry, least, float(np.abs(given - asked * full).max()))


def _cruise(sides: Sides, motors: Fitted) -> tuple[float, float]:
    """Speed at half throttle [m/s], and steering a turn rate there [s]: the feed-forward that the model asks for."""
    left = output(np.array([_CRUISE, _CRUISE + _STEERING]), motors.expo, motors.least)
    right = output(np.array([_CRUISE, _CRUISE - _STEERING]), motors.expo, motors.least)
    straight, turning = sides.steady(left, right, commanded)
    rate = float(turning[2] - straight[2])
    if straight[0] <= 0.0 or rate <= 0.0:
        raise RequestError(
            f"export --to ardupilot: at half throttle the model goes {straight[0]:.3g} m/s ahead, and steering to "
            f"starboard turns it by {rate:.3g} rad/s; both must be positive for an autopilot to steer it"
        )
    return float(straight[0]), _STEERING / rate


def parameters(vehicle: Vehicle) -> dict[str, float]:
    """The parameters by name."""
    sides = sides_of(vehicle, "ardupilot")
    motors = fitted(sides)
    speed, wanted = _cruise(sides, motors)
    result = {
        "CRUISE_SPEED": round(speed, 3),
        "CRUISE_THROTTLE": 100.0 * _CRUISE,
        "ATC_STR_RAT_FF": round(min(wanted, _MOST_FF), 3),
        "MOT_THST_EXPO": motors.expo,
        "MOT_THST_ASYM": motors.asymmetry,
        "MOT_THR_MIN": float(motors.least),
    }
    for thruster, (number, function) in zip(sides.thrusters(), _CHANNELS, strict=True):
        result[f"SERVO{number}_FUNCTION"] = float(function)
        if thruster.command == "pwm":
            named = zip(("MIN", "TRIM", "MAX", "REVERSED"), servo(thruster), strict=True)
            result |= {f"SERVO{number}_{name}": float(value) for name, value in named}
    return result


def _left_out(given: Given) -> list[str]:
    vehicle = given.vehicle
    sides = sides_of(vehicle, "ardupilot")
    motors = fitted(sides)
    port, starboard = sides.thrusters()
    _, wanted = _cruise(sides, motors)
    apart = float(np.abs(thrust(port, _SHARES) - thrust(starboard, _SHARES)).max())
    told = [
        f"With these MOT_ parameters thrust is within {motors.off:.3g} N of linear in what the autopilot asks for.",
        "Damping, added mass and couplings have no parameters: the controllers' P, I and D are not touched.",
    ]
    if wanted > _MOST_FF:
        told.append(
            f"ATC_STR_RAT_FF is {_MOST_FF:g}, the largest that ArduPilot takes, where the model asks for {wanted:.3g}: "
            "the boat turns less than the autopilot asks for until its I has grown."
        )
    if apart > 1e-9 * max(1.0, motors.off):
        told.append(f"Both thrusters share the parameters: one pushes up to {apart:.3g} N more than the other.")
    late = [stated(vehicle, s, 4, "s") for s in ("lag", "delay") if any(values_of(vehicle, s))]
    if late:
        full = max(float(np.abs(thrust(t, np.ones(1))).max()) for t in (port, starboard) if t.lag or t.delay)
        told.append(f"{' and '.join(late)}: up to {full:.3g} N a thruster come late after a step of the throttle.")
    if port.command != "pwm" or starboard.command != "pwm":
        told.append(f"The model is commanded in {port.command}: trims, ends and reversal of the outputs are not known.")
    return told + missing_surroundings(vehicle, given.facts.envelope)


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    rows = (f"{name},{value:.6g}\n" for name, value in parameters(given.vehicle).items())
    return {path: (remarks(given.facts.lines()) + "".join(rows)).encode()}


EXPORT = Export("ArduPilot Rover parameters of a boat that steers by thrust", ".param", _files, ("# ", ""), _left_out)
