"""Line-of-sight guidance: where to steer and how fast to go, to meet a point that moves along a track.

Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control* (2nd ed., 2021), chapter 12: the boat steers for a
point on the path a lookahead distance before its own projection. The along-track error sets the speed.
"""

from typing import NamedTuple

import numpy as np

from ..physics.frames import Array, earth_to_body, wrap_angle
from .tracks import Pace

LOOKAHEAD = 4.0
"""Lookahead distance, in seconds at the pace's speed: some lengths of the hull, as the book advises."""
_CATCH_UP = 3.0
"""Time in which an along-track error is made good [s]."""
_FASTEST = 1.6
"""Share of the pace's speed that catching up may ask for: under a half of full thrust where drag is quadratic."""
_SLOW = 0.2
"""Share of the pace's speed below which steering fades: it turns round where the boat changes to astern, without a jump
of the course, and at such a speed no course would bring the boat to its line."""
_AT_PLACE = 0.3
"""Distance within which a boat is at its place, in seconds at the pace's speed: what positions are measured to."""


class Steering(NamedTuple):
    """Speed along the hull [m/s], course over ground [rad], and what both are expected to change by.

    Attributes
    ----------
    rise : of the speed [m/s^2]
    turn, turn_rise : of the course [rad/s, rad/s^2]
    way : 1 ahead, -1 where the boat goes backwards along the course's line, between them where hardly any way is wanted
    """

    speed: float
    course: float
    rise: float = 0.0
    turn: float = 0.0
    turn_rise: float = 0.0
    way: float = 1.0


def line_of_sight(point: Array, place: Array, heading: float, pace: Pace) -> Steering:
    """Steering towards a point of a track.

    Parameters
    ----------
    point : (7,) of `Track.at`
    place : (2,) north, east of the boat [m]
    heading : of the boat [rad]
    """
    north, east, course, speed, turn, rise, turn_rise = point.tolist()
    if speed == 0.0 and rise == 0.0:
        return _kept_place(np.array([north, east]) - place, heading, pace)
    along, across = earth_to_body(np.array(course), place[0] - north, place[1] - east)
    towards = np.arctan2(float(across), LOOKAHEAD * pace.speed)
    most = _FASTEST * pace.speed
    wanted = float(np.clip(speed - float(along) / _CATCH_UP, -most, most))
    way = float(np.clip(wanted / (_SLOW * pace.speed), -1.0, 1.0))
    return Steering(wanted, course - way * towards, rise, turn, turn_rise, way)


def _kept_place(away: Array, heading: float, pace: Pace) -> Steering:
    """Towards a place, bow or stern first, whichever is nearer; at the place, with the bow where it is."""
    distance = float(np.hypot(*away))
    if distance < _AT_PLACE * pace.speed:
        return Steering(0.0, heading, way=0.0)
    course = float(np.arctan2(away[1], away[0]))
    off = float(wrap_angle(np.array(course - heading)))
    back = abs(off) > 0.5 * np.pi
    bow = course + np.pi if back else course
    facing = max(0.0, abs(np.cos(off)))
    speed = min(distance / _CATCH_UP, pace.speed) * facing
    return Steering(-speed if back else speed, bow, way=-1.0 if back else 1.0)
