"""Motion on an even time base: a `Motion` in SI units, earth axes NED and body axes FRD, and the turns between frames.

Conventions of Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control* (2nd ed., 2021), chapter 2: heading
`psi` [rad] clockwise from north, positive yaw rate turns to starboard. ROS logs follow REP-103 (earth ENU, body FLU)
and are turned by the functions here.
"""

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from .errors import LogError
from .presentation import Card

Array = NDArray[np.float64]

AXES = ("surge", "sway", "yaw")
"""The fixed axis order of every array with a last axis of three."""

FORCE_UNITS = ("N", "N", "N m")
SPEED_UNITS = ("m/s", "m/s", "rad/s")
ACCELERATION_UNITS = ("m/s^2", "m/s^2", "rad/s^2")

GRAVITY = 9.80665
"""Standard gravity [m/s^2] (3rd General Conference on Weights and Measures, 1901)."""


def wrap_angle(angle: Array) -> Array:
    """Wrap angles [rad] to the half-open interval from -pi to pi.

    >>> float(wrap_angle(np.array(3.5 * np.pi)).round(6))
    -1.570796
    """
    return (np.asarray(angle, dtype=float) + np.pi) % (2.0 * np.pi) - np.pi


def earth_to_body(heading: Array, north: Array | float, east: Array | float) -> tuple[Array, Array]:
    """Turn a horizontal earth-fixed vector into the body axes: R(psi)^T applied (Fossen 2021, eq. 2.34, planar).

    Parameters
    ----------
    heading : array (or tensor), any shape [rad]
    north, east : arrays that broadcast with `heading`, any unit

    Returns
    -------
    (ahead, starboard) : two arrays in the unit of the input
    """
    cosine, sine = _cosine_sine(heading)
    return cosine * north + sine * east, -sine * north + cosine * east


def body_to_earth(heading: Array, ahead: Array | float, starboard: Array | float) -> tuple[Array, Array]:
    """Turn a horizontal body-fixed vector into the earth axes (north, east); the inverse of `earth_to_body`.

    Parameters
    ----------
    heading : psi (n,) [rad]
    ahead, starboard : components in the body axes
    """
    cosine, sine = np.cos(heading), np.sin(heading)
    return cosine * ahead - sine * starboard, sine * ahead + cosine * starboard


def _cosine_sine(angle: Any) -> tuple[Any, Any]:
    """Of an array, or of a tensor by its own methods, which keep the gradient."""
    return (angle.cos(), angle.sin()) if hasattr(angle, "cos") else (np.cos(angle), np.sin(angle))


def heading_from_quaternion(x: Array, y: Array, z: Array, w: Array) -> Array:
    """Yaw [rad] about the z axis of the quaternion's own frame (Fossen 2021, eq. 2.77), wrapped to -pi..pi.

    The quaternion may be unnormalised; its scale cancels.

    Parameters
    ----------
    x, y, z, w : components, the vector part first
    """
    return np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def heading_from_enu(yaw: Array) -> Array:
    """Compass heading [rad] from an ENU yaw (counter-clockwise from east): psi = pi/2 - yaw."""
    return np.pi / 2.0 - np.asarray(yaw, dtype=float)


RUN_UP = 20.0
"""Longest history of commands that a motion keeps [s]: a delay of 2 s and six time constants of a lag of 3 s."""


_COLUMNS = ("time", "position", "heading", "velocity", "commands", "minutes")
"""What every motion has of each row."""
_OF_TIME = cast("Array", None)
"""Minutes that are those of the time base; no motion has it once it is made."""


@dataclass(frozen=True, slots=True, repr=False)
class Motion(Card):
    """One gap-free stretch of measured or simulated motion on an even time base.

    Attributes
    ----------
    time : (n,) [s], even steps
    position : (n, 2) north, east [m]
    heading : (n,) psi [rad], unwrapped (continuous)
    velocity : (n, 3) nu = surge speed u, sway speed v [m/s], yaw rate r [rad/s], over ground, body axes
    commands : (n, thrusters) in the unit of the vehicle's thrusters (newton, pwm [us], normalized, rad_s).
        A row is the command's mean over the step centred on its time stamp, so that steps keep their
        area and their instant whatever the log's rate.
    thrusters : the names of the command columns
    source : where it came from (file name, or the world that made it)
    run_up : (m, thrusters) commands on the steps before the first row, so that lag and delay know their past; none
        when the stretch begins with the log
    past : (m, 4) heading [rad] and velocity on the steps before the first row, so that a wake's memory knows its past;
        none where the record begins, or begins anew
    air : (n, 2) velocity of the air over ground, towards north and east [m/s], from an anemometer; None where there is
        none, and the air is then taken to be still
    derived : which velocities are derivatives of positions or of the heading, so that their noise is no white one
    understated : by how much third differences understate the square of white noise on each velocity, for readings that
        were averaged onto the time base; see `understated_noise`
    command_step : time between two records of the commands [s]; 0 where it is not known
    record_step : time between two records of each velocity [s], between which rows are interpolated; 0 for one a row
    out_of_step : by how much its columns may be out of step with each other, as far as the log's reader can tell [s]
    minutes : (n,) since the first row of the log [min], by which what changes in a log is told; of `time` where it is
        not given

    Raises
    ------
    LogError
        when shapes disagree, a number is not finite, or the time base is not even.
    """

    time: Array
    position: Array
    heading: Array
    velocity: Array
    commands: Array
    thrusters: tuple[str, ...]
    source: str = ""
    run_up: Array | None = None
    past: Array | None = None
    air: Array | None = None
    derived: tuple[bool, bool, bool] = (False, False, False)
    understated: tuple[float, float, float] = (1.0, 1.0, 1.0)
    command_step: float = 0.0
    record_step: tuple[float, float, float] = (0.0, 0.0, 0.0)
    out_of_step: float = 0.0
    minutes: Array = _OF_TIME

    def __post_init__(self) -> None:
        n = self.time.shape[0]
        if self.minutes is _OF_TIME:
            object.__setattr__(self, "minutes", self.time / 60.0)
        wanted = {
            "time": (n,),
            "position": (n, 2),
            "heading": (n,),
            "velocity": (n, 3),
            "commands": (n, len(self.thrusters)),
            "minutes": (n,),
        } | ({} if self.air is None else {"air": (n, 2)})
        for name, shape in wanted.items():
            array = getattr(self, name)
            if array.shape != shape:
                raise LogError(f"motion: expected {name} of shape {shape}, got {array.shape}")
            if not np.isfinite(array).all():
                raise LogError(f"motion: {name} holds values that are not finite; drop those rows first")
        if n < 2:
            raise LogError(f"motion: expected at least 2 rows, got {n}")
        for name, earlier, columns in (("run_up", self.run_up, len(self.thrusters)), ("past", self.past, 4)):
            if earlier is not None and (earlier.ndim != 2 or earlier.shape[1] != columns):
                raise LogError(f"motion: expected {name} of shape (m, {columns}), got {earlier.shape}")
        steps = np.diff(self.time)
        if steps.min() <= 0 or np.ptp(steps) > 1e-6 * max(1.0, abs(self.time[-1])):
            raise LogError("motion: the time base is not even; resample the log first (undertow.prepare)")

    @classmethod
    def at_rest(
        cls, time_step: float, commands: Array, thrusters: tuple[str, ...], source: str = "", heading: float = 0.0
    ) -> "Motion":
        """A boat that lies at the origin under some commands: where simulations start.

        Parameters
        ----------
        time_step : [s]
        commands : (n, thrusters), each in its unit
        thrusters : their names
        source : see the attributes
        heading : psi [rad]
        """
        n = commands.shape[0]
        time = time_step * np.arange(n, dtype=float)
        still = np.zeros((n, 2)), np.full(n, heading), np.zeros((n, 3))
        return cls(time, *still, commands, thrusters, source)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        top = np.abs(self.velocity).max(axis=0)
        return [
            ("source", self.source),
            ("time", f"{self.time.size} rows, {self.duration:.1f} s at {1.0 / self.time_step:.3g} Hz"),
            ("thrusters", ", ".join(self.thrusters)),
            ("fastest", f"surge {top[0]:.3g} m/s, sway {top[1]:.3g} m/s, yaw {top[2]:.3g} rad/s"),
        ]

    @property
    def time_step(self) -> float:
        """The even step of the time base [s]."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    @property
    def duration(self) -> float:
        """Length of the stretch [s]."""
        return float(self.time[-1] - self.time[0])

    def followed_by(self, later: "Motion") -> "Motion":
        """Join the next rows of the same record to these.

        Raises
        ------
        LogError
            when the rows do not follow on its time base, or have other columns.
        """
        if (self.air is None) != (later.air is None):
            raise LogError("motion: expected an anemometer in all rows or in none")
        rows = {name: np.concatenate([getattr(self, name), getattr(later, name)]) for name in _COLUMNS}
        air = None if self.air is None or later.air is None else np.concatenate([self.air, later.air])
        return replace(self, **rows, air=air)

    def slice(self, start: int, stop: int) -> "Motion":
        """Rows `start` to `stop` (exclusive) as a motion of its own; earlier rows become its run-up and its past."""
        rows, most = slice(start, stop), round(RUN_UP / self.time_step)
        before = slice(max(0, start - most), start)

        def earlier(known: Array | None, own: Array) -> Array | None:
            if known is not None and len(own) < most:
                own = np.concatenate([known[len(own) - most :], own])
            return own if own.size else None

        return replace(
            self,
            **{name: getattr(self, name)[rows] for name in _COLUMNS},
            run_up=earlier(self.run_up, self.commands[before]),
            past=earlier(self.past, np.column_stack([self.heading[before], self.velocity[before]])),
            air=None if self.air is None else self.air[rows],
        )
