"""The logs of a fleet by boat and day, in shares of nominal values: what pooling and the hull diary work on."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..physics.frames import Array
from .hull_estimates import Fleet, HullEstimate

DAY = 86400.0  # [s]
UNKNOWN = 1e4
"""Variance of what a day does not say, in squared shares of the nominal value: a deviation of a hundred times it."""

_RIDGE = 1e-9  # added to each variance, as a share of it, so that a covariance of lower rank has an inverse, too


class Part(Enum):
    """What of a boat a parameter describes."""

    DRAG_AHEAD = "drag ahead"
    DRAG_ASIDE = "drag in sway and yaw"
    THRUST = "thrust"
    MASS = "mass"
    OTHER = "another number of the hull"


@dataclass(frozen=True, slots=True, eq=False)
class BoatDays:
    """The days of one boat on which it logged.

    Attributes
    ----------
    boat : its name
    time : (n,) middle of each day's logs [s since 1970, UTC], increasing
    hours : (n,) read of each day [h]
    values : (n, p) in shares of the scale of each parameter; 1 is the nominal value, and more drag is more than 1
    covariance : (n, p, p) of these, from the noise within the logs alone; `UNKNOWN` where a day says nothing
    known : (n, p) False where a day says nothing
    """

    boat: str
    time: Array
    hours: Array
    values: Array
    covariance: Array
    known: np.ndarray

    @property
    def days(self) -> Array:
        """Times in days since the first, (n,)."""
        return (self.time - self.time[0]) / DAY

    def of(self, rows: Sequence[int]) -> "BoatDays":
        """The same of some days."""
        some = (column[rows] for column in (self.time, self.hours, self.values, self.covariance, self.known))
        return BoatDays(self.boat, *some)


def part_of(parameter: str) -> Part:
    """What a parameter describes, by its name.

    Examples
    --------
    >>> [part_of(name).value for name in ("X_uu", "N_r", "thrusters.port.scale", "mass")]
    ['drag ahead', 'drag in sway and yaw', 'thrust', 'mass']
    """
    if parameter in ("X_u", "X_uu"):
        return Part.DRAG_AHEAD
    if parameter in ("Y_v", "Y_vv", "N_r", "N_rr"):
        return Part.DRAG_ASIDE
    if parameter.endswith("scale"):
        return Part.THRUST
    return Part.MASS if parameter == "mass" else Part.OTHER


def scales(fleet: Fleet) -> Array:
    """What one share of each parameter is, (p,), in its unit: the nominal value, or the usual one where that is zero.

    A drag has the sign of damping, so that more drag is a larger share.
    """
    values = np.array([estimate.values for estimate in fleet.estimates]).reshape(-1, len(fleet.parameters))
    found = np.array(fleet.nominal, dtype=float)
    for k in np.flatnonzero(found == 0.0):
        seen = values[np.isfinite(values[:, k]), k]
        usual = float(np.median(np.abs(seen))) if seen.size else 0.0
        drag = part_of(fleet.parameters[k]) in (Part.DRAG_AHEAD, Part.DRAG_ASIDE)
        found[k] = (usual or 1.0) * (-1.0 if drag else 1.0)
    return found


def boat_days(fleet: Fleet) -> tuple[BoatDays, ...]:
    """The days of each boat, boats by name; logs of one day (UTC) are one, weighed by their covariance."""
    scale = scales(fleet)
    boats: dict[str, dict[int, list[HullEstimate]]] = {}
    for estimate in fleet.estimates:
        if np.isfinite(estimate.values).any():
            boats.setdefault(estimate.boat, {}).setdefault(int(estimate.time // DAY), []).append(estimate)
    return tuple(_days(boat, [logs[day] for day in sorted(logs)], scale) for boat, logs in sorted(boats.items()))


def _days(boat: str, days: Sequence[Sequence[HullEstimate]], scale: Array) -> BoatDays:
    rows = [_day(logs, scale) for logs in days]
    hours = np.array([sum(log.hours for log in logs) for logs in days])
    weights = [np.array([max(log.hours, 1e-9) for log in logs]) for logs in days]
    time = np.array([np.average([log.time for log in logs], weights=w) for logs, w in zip(days, weights, strict=True)])
    values, covariance, known = (np.array(column) for column in zip(*rows, strict=True))
    usual = np.array([np.median(values[k, j]) if k.any() else 1.0 for j, k in enumerate(known.T)])
    return BoatDays(boat, time, hours, np.where(known, values, usual), covariance, known)


def _day(logs: Sequence[HullEstimate], scale: Array) -> tuple[Array, Array, np.ndarray]:
    """Values, covariance and what is known of a day: the mean of its logs by their information."""
    information, weighed = np.eye(scale.size) / UNKNOWN, np.zeros(scale.size)
    known = np.zeros(scale.size, dtype=bool)
    for log in logs:
        there = np.flatnonzero(np.isfinite(log.values) & np.isfinite(np.diag(log.covariance)))
        if there.size:
            within = np.ix_(there, there)
            shares = log.covariance[within] / np.outer(scale[there], scale[there])
            inverse = np.linalg.inv(shares + _RIDGE * np.diag(np.diag(shares)))
            information[within] += inverse
            weighed[there] += inverse @ (log.values[there] / scale[there])
            known[there] = True
    covariance = np.linalg.inv(information)
    return covariance @ weighed, 0.5 * (covariance + covariance.T), known
