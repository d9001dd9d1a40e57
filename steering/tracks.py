"""Standard tracks: a point that a boat is to keep up with, at speeds and turns that suit its hull and thrusters."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..physics.errors import RequestError, nearest
from ..physics.forces import ForceEquation, at_beginning, calm
from ..physics.momentum_balance import thruster_matrix
from ..physics.motion import Array
from ..physics.thrusters import command_of
from ..physics.vehicle import Vehicle

SHARE = 0.3
"""Share of full thrust, and of the full turning moment, that a track asks of the boat in steady motion: what is left
is for gathering way, for wind and current, and for a boat that is weaker than its model says."""
_EASE = 1.5
"""Time in which a track's rate of turn comes and goes [s]: no hull turns at once."""
LEAD_OUT = 8.0
"""Time that a track goes on after its judged end [s], for controllers that look ahead."""
_STEP = 0.01
"""Step in which a track is drawn [s]: at 1 m/s a point each centimetre."""


class Pace(NamedTuple):
    """Surge speed [m/s] and yaw rate [rad/s] that a boat keeps with a `SHARE` of what its thrusters have."""

    speed: float
    turn_rate: float


class Leg(NamedTuple):
    """A part of a track.

    Attributes
    ----------
    seconds : its time [s]; 0 for what its turn takes
    speed : share of the pace's speed that it ends with
    turn : by how much it turns, to starboard [deg]
    """

    seconds: float
    speed: float = 1.0
    turn: float = 0.0


@dataclass(frozen=True, slots=True)
class Course:
    """A track before it is fitted to a boat: what it is for, and its legs after a start from rest, due north."""

    about: str
    legs: tuple[Leg, ...]


_START = Leg(4.0)
"""The way from rest to the pace with which every track begins."""
_CORNER = (Leg(8.0), Leg(0.0, turn=90.0))
_TRANSIENTS = (
    *((6.0, 1.0), (2.0, 0.4), (6.0, 0.4), (3.0, 1.3), (6.0, 1.3)),
    *((4.0, 0.0), (3.0, -0.4), (5.0, -0.4), (3.0, 0.0)),
)
"""Time of each leg [s], and the share of the pace's speed that it ends with."""
TRACKS = {
    "square": Course("four sides and four corners", _CORNER * 4),
    "lawn-mower": Course(
        "parallel lines, as a survey has them",
        ((Leg(10.0), Leg(0.0, turn=180.0), Leg(10.0), Leg(0.0, turn=-180.0)) * 2 + (Leg(10.0),)),
    ),
    "eight": Course("a circle to starboard and one to port", (Leg(2.0), Leg(0.0, turn=360.0), Leg(0.0, turn=-360.0))),
    "station": Course(
        "a run, a stop, and half a minute at one place", (Leg(6.0), Leg(5.0, speed=0.0), Leg(30.0, speed=0.0))
    ),
    "transients": Course(
        "straight on, slower, faster, to rest and astern",
        tuple(Leg(seconds, speed) for seconds, speed in _TRANSIENTS),
    ),
}
"""The tracks by name. Speeds end at a share of the pace; turns are made at its yaw rate."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A track for a boat: where the point is at each instant, drawn in fine steps.

    Attributes
    ----------
    name : one of `TRACKS`
    time : (n,) [s]; the last `LEAD_OUT` is not judged
    points : (n, 7) north, east [m], course [rad], continuous, speed along it [m/s], negative astern, rate of turn
        [rad/s], and the rates of change of the last two [m/s^2, rad/s^2]
    pace : of the boat
    """

    name: str
    time: Array
    points: Array
    pace: Pace

    @property
    def seconds(self) -> float:
        """Time that is judged [s]."""
        return float(self.time[-1] - LEAD_OUT)

    def at(self, time: Array | float) -> Array:
        """The points at instants [s], (m, 7); see `points`."""
        where = np.clip(np.atleast_1d(np.asarray(time, dtype=float)) / _STEP, 0.0, self.time.size - 1.0)
        low = np.minimum(where.astype(int), self.time.size - 2)
        share = (where - low)[:, None]
        return (1.0 - share) * self.points[low] + share * self.points[low + 1]


def pace_of(vehicle: Vehicle) -> Pace:
    """The pace of a boat in calm water.

    Raises
    ------
    RequestError
        when its thrusters can neither push it ahead nor turn it.
    """
    still = calm(at_beginning(vehicle))
    equation, rest = ForceEquation(still), np.zeros(2001)
    most = np.array([np.abs(t.lasting(command_of(t, np.array([-1.0, 1.0]))))[0].max() for t in still.thrusters])
    reach = np.abs(thruster_matrix(still)) @ most
    if reach[0] <= 0.0 or reach[2] <= 0.0:
        raise RequestError(f"control: the thrusters of {vehicle.name} cannot both push it ahead and turn it")

    def kept(axis: int, rising: Array, surge: Array, yaw: Array) -> float:
        drag = -equation.force((surge, rest, yaw), rest, np.zeros((len(still.thrusters), rest.size)))[axis]
        return float(np.interp(SHARE * reach[axis], np.maximum.accumulate(drag), rising))

    ahead, turning = np.linspace(0.0, 10.0, rest.size), np.linspace(0.0, 3.0, rest.size)
    speed = kept(0, ahead, ahead, rest)
    return Pace(speed, kept(2, turning, np.full(rest.size, speed), turning))


def track_named(name: str, pace: Pace) -> Track:
    """A track for a boat of some pace.

    Raises
    ------
    RequestError
        for an unknown track, naming the nearest.
    """
    if name not in TRACKS:
        raise RequestError(
            f"unknown track {name!r}: did you mean {nearest(name, TRACKS)!r}? There are: {', '.join(TRACKS)}"
        )
    legs = TRACKS[name].legs
    return drawn(name, [_START, *legs, Leg(LEAD_OUT, legs[-1].speed)], pace)


def drawn(name: str, legs: Sequence[Leg], pace: Pace) -> Track:
    """A track of legs: speeds change along half a cosine, turns begin and end within `_EASE`."""
    speeds, rates, last = [np.zeros(1)], [np.zeros(1)], 0.0
    for leg in legs:
        turn = np.radians(leg.turn)
        seconds = leg.seconds or abs(turn) / pace.turn_rate + _EASE
        rows = max(1, round(seconds / _STEP))
        share = np.arange(1, rows + 1) / rows
        speeds.append(pace.speed * (last + (leg.speed - last) * 0.5 * (1.0 - np.cos(np.pi * share))))
        ease = min(_EASE / seconds, 0.5)
        shape = np.clip(np.minimum(share, 1.0 - share) / ease, 0.0, 1.0)
        rates.append(shape * (turn / (shape.sum() * _STEP) if turn else 0.0))
        last = leg.speed
    speed, rate = np.concatenate(speeds), np.concatenate(rates)
    course = np.cumsum(rate) * _STEP
    ahead = np.stack([np.cos(course), np.sin(course)], axis=1) * speed[:, None]
    place = np.cumsum(0.5 * (ahead + np.vstack([ahead[:1], ahead[:-1]])), axis=0) * _STEP
    rising = [np.gradient(series, _STEP) for series in (speed, rate)]
    points = np.column_stack([place, course, speed, rate, *rising])
    return Track(name, _STEP * np.arange(speed.size, dtype=float), points, pace)
