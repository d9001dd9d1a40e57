"""Axes and units: earth NED and body FRD inside, everything else converted at the door.

Conventions of Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control* (2nd ed., 2021), chapter 2:
heading `psi` [rad] clockwise from north, positive yaw rate turns to starboard. ROS logs follow REP-103
(earth ENU, body FLU) and are turned by the functions here.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    """Turn a horizontal body-fixed vector into the earth axes (north, east); the inverse of `earth_to_body`."""
    cosine, sine = np.cos(heading), np.sin(heading)
    return cosine * ahead - sine * starboard, sine * ahead + cosine * starboard


def _cosine_sine(angle: Any) -> tuple[Any, Any]:
    """Of an array, or of a tensor by its own methods, which keep the gradient."""
    return (angle.cos(), angle.sin()) if hasattr(angle, "cos") else (np.cos(angle), np.sin(angle))


def heading_from_quaternion(x: Array, y: Array, z: Array, w: Array) -> Array:
    """Yaw [rad] about the z axis of the quaternion's own frame (Fossen 2021, eq. 2.77), wrapped to -pi..pi.

    The quaternion may be unnormalised; its scale cancels.
    """
    return np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def heading_from_enu(yaw: Array) -> Array:
    """Compass heading [rad] from an ENU yaw (counter-clockwise from east): psi = pi/2 - yaw."""
    return np.pi / 2.0 - np.asarray(yaw, dtype=float)
