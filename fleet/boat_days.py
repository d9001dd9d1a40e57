"""Days of boats in shares of nominal values, their scatter from day to day, and partial pooling over a fleet.

The covariance of the scatter comes from differences between successive days, which a hull that changes hardly moves, by
expectation and maximisation (Dempster, Laird and Rubin 1977), with a factor for each boat drawn towards one (Smyth
2004, section 4). Pooling is a random-effects model (DerSimonian and Laird 1986, eq. 1) whose spread is integrated over,
so that a fleet of three boats has wide intervals (Rubin 1981; Gelman 2006, section 3).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import log_ndtr, ndtr
from scipy.stats import chi2, norm
from scipy.stats import t as student

from ..physics.motion import Array
from .parameter_estimates import Fleet, HullEstimate

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
    result = np.array(fleet.nominal, dtype=float)
    for k in np.flatnonzero(result == 0.0):
        seen = values[np.isfinite(values[:, k]), k]
        usual = float(np.median(np.abs(seen))) if seen.size else 0.0
        drag = part_of(fleet.parameters[k]) in (Part.DRAG_AHEAD, Part.DRAG_ASIDE)
        result[k] = (usual or 1.0) * (-1.0 if drag else 1.0)
    return result


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


ROUNDS = 40
"""Of expectation and maximisation at most."""
SETTLED = 2e-3
"""Share by which no variance moves any more in the last round."""
LEAST = 1e-3
"""Deviation of a day that is taken as the least, in shares: no load, battery and sea are the same to a thousandth."""
OWN = 12.0
"""Numbers that the common scatter counts for beside those of a boat's own differences: as boats scatter whose
deviations differ by a quarter."""
_MEDIAN = float(chi2.median(1))
"""Of a squared standard normal number."""
BEYOND = 1e-3
"""Chance of a difference beyond which it is a change of the boat, and not scatter."""


@dataclass(frozen=True, slots=True, eq=False)
class DayScatter:
    """Scatter from day to day, in shares of the nominal values.

    Attributes
    ----------
    covariance : (p, p), of a usual boat
    factor : by boat, of its covariance over that of a usual boat
    differences : how many it was found from
    """

    covariance: Array
    factor: Mapping[str, float]
    differences: int

    @property
    def freedom(self) -> float:
        """Degrees of freedom: differences that share a day tell two thirds of what as many apart would."""
        return max(2.0 / 3.0 * self.differences, 1.0)

    def of(self, boat: str) -> Array:
        """The covariance of a boat's days, (p, p)."""
        return self.covariance * self.factor[boat]


def day_scatter(boats: Sequence[BoatDays]) -> DayScatter:
    """Find the scatter that days have in common."""
    steps = [np.diff(boat.values, axis=0) for boat in boats]
    noise = [boat.covariance[1:] + boat.covariance[:-1] for boat in boats]
    known = np.concatenate([boat.known[1:] & boat.known[:-1] for boat in boats])
    step, within = np.concatenate(steps), np.concatenate(noise)
    size = step.shape[1]
    if not step.shape[0]:
        return DayScatter(LEAST**2 * np.eye(size), {boat.boat: 1.0 for boat in boats}, 0)
    whose = np.repeat(np.arange(len(boats)), [one.shape[0] for one in steps])
    limit = float(chi2.isf(BEYOND, size))
    start = [0.5 * np.median(step[rows, k] ** 2) / _MEDIAN if rows.any() else 0.0 for k, rows in enumerate(known.T)]
    found, factor = np.diag(np.maximum(start, LEAST**2)), np.ones(len(boats))
    for _ in range(ROUNDS):
        total = 2.0 * factor[whose, None, None] * found
        inverse = np.linalg.inv(within + total)
        squares = np.einsum("np,npq,nq->n", step, inverse, step)
        usual = squares <= limit
        if not usual.any():
            break
        gain = total[usual] @ inverse[usual]
        mean = np.einsum("npq,nq->np", gain, step[usual])
        spread = 0.5 * (mean[:, :, None] * mean[:, None, :] + total[usual] - gain @ total[usual])
        spread = (spread / factor[whose[usual], None, None]).sum(axis=0)
        before = np.diag(found)
        # As many differences as there are parameters say that parameters scatter apart: few do not tell how together.
        found = (spread + size * np.diag(np.diag(found))) / (usual.sum() + size)
        found[np.diag_indices(size)] = np.maximum(np.diag(found), LEAST**2)
        kept = np.minimum(squares, limit)
        sums, counts = (np.bincount(whose, weights=w, minlength=len(boats)) for w in (kept, np.ones(kept.size)))
        if (np.abs(np.diag(found) - before) <= SETTLED * before).all():
            break
        factor = factor * (OWN / factor + sums) / (OWN + size * counts)
    return DayScatter(found, {one.boat: float(c) for one, c in zip(boats, factor, strict=True)}, int(step.shape[0]))


GRID = 61
"""Values of the spread over which is summed: with twice as many no end of an interval moved by 1 % of its width."""
WIDEST = 30.0
"""Largest spread of the grid, in spreads that the boats' values show: the prior has fallen to a thousandth there."""
ODD = 0.05
"""Chance that any boat of a fleet of equals is said to differ in any parameter (Holm 1979)."""
LEVEL = 0.95
"""Of all intervals."""
_MOST_ALIKE = 0.8
"""Correlation of one day with the next beyond which it is a boat that changes, and not scatter."""


@dataclass(frozen=True, slots=True, eq=False)
class Pooled:
    """A parameter over the boats; values in shares of the nominal one, intervals at 95 %.

    Attributes
    ----------
    mean, mean_interval : of the fleet
    spread, spread_interval : deviation of boats about it
    own, own_interval : (b,), (b, 2) each boat's value, by its own logs and by the fleet
    chance : (b,) of a boat as far from the others, were it one of them; 1 where nothing is known
    """

    mean: float
    mean_interval: tuple[float, float]
    spread: float
    spread_interval: tuple[float, float]
    own: Array
    own_interval: Array
    chance: Array


def levels(boats: Sequence[BoatDays], scatter: DayScatter) -> tuple[Array, Array]:
    """The constant value of each boat's parameters (b, p), and its covariance (b, p, p), by its days with scatter.

    The covariance is that of all days together, and not of each alone: larger where scatter lasts from day to day, or
    has tails that the differences between days were cleared of; and as wide as few days make it.
    """
    found, covariances, apart = [], [], []
    for boat in boats:
        inverse = np.linalg.inv(boat.covariance + scatter.of(boat.boat))
        covariance = np.linalg.inv(inverse.sum(axis=0))
        level = covariance @ np.einsum("npq,nq->p", inverse, boat.values)
        found.append(level)
        covariances.append(covariance)
        apart.append(np.einsum("nqp,nq->np", np.linalg.cholesky(inverse), boat.values - level))
    tail = 0.5 * (1.0 - LEVEL)
    widening = float(student.isf(tail, scatter.freedom) / norm.isf(tail)) ** 2 * _lasting(apart)
    return np.array(found), widening * np.array(covariances)


def _lasting(apart: Sequence[Array]) -> float:
    """Variance of a mean of days over that of as many days with nothing in common; at least 1.

    Parameters
    ----------
    apart : of each boat, (n, p) its days less its level, in units of their scatter
    """
    many = [one for one in apart if one.shape[0] > 2]
    freedom = sum((one.shape[0] - 1) * one.shape[1] for one in many)
    if not freedom:
        return 1.0
    squares = sum(float((one**2).sum()) for one in many)
    # Days less their own mean seem to avoid each other by one over their number.
    alike = sum(float((one[1:] * one[:-1]).sum()) for one in many) / squares + len(many) / sum(map(len, many))
    alike = min(max(alike, 0.0), _MOST_ALIKE)
    return max(1.0, squares / freedom * (1.0 + alike) / (1.0 - alike))


def pool(values: Array, deviations: Array) -> Pooled:
    """Pool one parameter.

    Parameters
    ----------
    values, deviations : (b,) of the boats, in shares; a deviation that is not finite says nothing
    """
    known = np.isfinite(values) & np.isfinite(deviations)
    y, s = values[known], deviations[known]
    if not y.size:
        own, ends, chance = np.full(values.size, np.nan), np.full((values.size, 2), np.nan), np.ones(values.size)
        return Pooled(np.nan, (np.nan, np.nan), np.nan, (np.nan, np.nan), own, ends, chance)
    spread, weight, mean, deviation = _believed(y, s)
    share = spread[:, None] ** 2 / (spread[:, None] ** 2 + s**2)
    own = mean[:, None] + share * (y - mean[:, None])
    apart = np.sqrt(share * s**2 + ((1.0 - share) * deviation[:, None]) ** 2)
    ends = np.array([_interval(own[:, k], apart[:, k], weight) for k in range(y.size)])
    chance = np.array([_apart(np.delete(y, k), np.delete(s, k), y[k], s[k]) for k in range(y.size)])
    return Pooled(
        float(weight @ mean),
        _interval(mean, deviation, weight),
        float(spread[np.searchsorted(np.cumsum(weight), 0.5)]),
        (_quantile(spread, weight, 0.025), _quantile(spread, weight, 0.975)),
        _placed(weight @ own, known, np.nan),
        _placed(ends, known, np.nan),
        _placed(chance, known, 1.0),
    )


def odd(chances: Array) -> np.ndarray:
    """Which boats differ from the others, and in what, (b, p): Holm's procedure over all of them."""
    flat = chances.ravel()
    order = np.argsort(flat)
    passed = flat[order] <= ODD / np.arange(flat.size, 0, -1)
    first = flat.size if passed.all() else int(np.argmin(passed))
    told = np.zeros(flat.size, dtype=bool)
    told[order[:first]] = True
    return told.reshape(chances.shape)


def _believed(y: Array, s: Array) -> tuple[Array, Array, Array, Array]:
    """Spreads and what each is believed (g,), and the fleet's mean and its deviation at each (g,).

    The prior of the spread is one over it, beyond the noise: where boats differ far more than their noise the intervals
    are then those of Student's t, which cover what they say (the right Haar prior of a scale; Berger 1985, 6.6).
    """
    usual = float(np.sqrt(s.size / (s**-2.0).sum()))
    widest = WIDEST * max(usual, float(np.std(y)))
    place = np.linspace(0.0, 1.0, GRID)
    spread = widest * place**3
    width = 3.0 * widest * place**2 + (place == 0.0) * 1e-12
    precision = 1.0 / (spread[:, None] ** 2 + s**2)
    total = precision.sum(axis=1)
    mean = (precision * y).sum(axis=1) / total
    log = 0.5 * np.log(precision).sum(axis=1) - 0.5 * np.log(total)
    log -= 0.5 * (precision * (y - mean[:, None]) ** 2).sum(axis=1)
    log += np.log(width / (usual + spread))
    weight = np.exp(log - log.max())
    return spread, weight / weight.sum(), mean, 1.0 / np.sqrt(total)


def _apart(y: Array, s: Array, value: float, noise: float) -> float:
    """The chance, of either sign, of a boat so far from others, were it one of them."""
    if y.size < 2:
        return 1.0
    spread, weight, mean, deviation = _believed(y, s)
    place = (value - mean) / np.sqrt(spread**2 + deviation**2 + noise**2)
    below, above = weight @ np.exp(log_ndtr(place)), weight @ np.exp(log_ndtr(-place))
    return float(min(1.0, 2.0 * min(below, above)))


def _interval(mean: Array, deviation: Array, weight: Array) -> tuple[float, float]:
    """The central 95 % of a mixture of normal laws."""
    reach, tail = float(norm.isf(0.5 * (1.0 - LEVEL))) + 1.0, 0.5 * (1.0 - LEVEL)
    low, high = float((mean - reach * deviation).min()), float((mean + reach * deviation).max())

    def end(target: float) -> float:
        found = root_scalar(lambda x: weight @ ndtr((x - mean) / deviation) - target, bracket=(low, high), xtol=1e-14)
        return float(found.root)

    return end(tail), end(1.0 - tail)


def _quantile(values: Array, weight: Array, target: float) -> float:
    return float(np.interp(target, np.cumsum(weight) - 0.5 * weight, values))


def _placed(values: Array, known: np.ndarray, other: float) -> Array:
    """Values of the boats that are known, in the places of all."""
    every = np.full((known.size, *values.shape[1:]), other)
    every[known] = values
    return every
