"""What boats share and how they differ: partial pooling of each parameter over the boats of a fleet.

Each boat's own value is normal about the fleet's mean with a spread that is not known (random effects, DerSimonian and
Laird 1986, equation 1). What is believed of the spread is integrated over, and not set to its best value, so that the
intervals of a fleet of three boats say how little three boats tell of it (Rubin 1981; Gelman 2006, section 3).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtr
from scipy.stats import norm
from scipy.stats import t as student

from ..physics.frames import Array
from .boat_days import BoatDays
from .day_scatter import DayScatter

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
_HALVINGS = 50
"""Of the bracket in which an end of an interval lies: to the last digit."""


@dataclass(frozen=True, slots=True, eq=False)
class Pooled:
    """A parameter over the boats; values in shares of the nominal one, intervals at 95 %.

    Attributes
    ----------
    mean, mean_interval : of the fleet
    spread, spread_interval : deviation of boats about it
    alone, alone_deviation : (b,) what each boat's own logs say; infinite deviation for a boat that says nothing
    own, own_interval : (b,), (b, 2) each boat's value, by its own logs and by the fleet
    chance : (b,) of a boat as far from the others, were it one of them; 1 where nothing is known
    """

    mean: float
    mean_interval: tuple[float, float]
    spread: float
    spread_interval: tuple[float, float]
    alone: Array
    alone_deviation: Array
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
    alone, noise = np.where(known, values, np.nan), np.where(known, deviations, np.inf)
    y, s = values[known], deviations[known]
    if not y.size:
        empty = np.full(values.size, np.nan)
        ends = np.full((values.size, 2), np.nan)
        nothing = (np.nan, np.nan)
        return Pooled(np.nan, nothing, np.nan, nothing, alone, noise, empty, ends, np.ones(values.size))
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
        alone,
        noise,
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
    reach = float(norm.isf(0.5 * (1.0 - LEVEL))) + 1.0
    ends = []
    for target in (0.5 * (1.0 - LEVEL), 0.5 * (1.0 + LEVEL)):
        low, high = float((mean - reach * deviation).min()), float((mean + reach * deviation).max())
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if weight @ ndtr((middle - mean) / deviation) < target:
                low = middle
            else:
                high = middle
        ends.append(0.5 * (low + high))
    return ends[0], ends[1]


def _quantile(values: Array, weight: Array, target: float) -> float:
    return float(np.interp(target, np.cumsum(weight) - 0.5 * weight, values))


def _placed(values: Array, known: np.ndarray, other: float) -> Array:
    """Values of the boats that are known, in the places of all."""
    every = np.full((known.size, *values.shape[1:]), other)
    every[known] = values
    return every
