"""Statistics of measurements: robust fits with errors counted by stretches, and white noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from ..physics.frames import Array
from ..physics.motion import Motion

ROUNDS = 6
"""Times that a robust fit is weighed anew: with a fifth of false rows its values then still move by less than a
twentieth of their standard error."""
CI = 1.96
"""Standard errors in half a 95 % interval."""
_BY_CHANCE, _ODDS = 0.01, 1000.0
"""Chance, and odds against it, from which an explanation is ruled out: few stretches may give great odds by chance, and
many may agree on little."""
_FLOOR = 1e-3
"""Share of what a usual stretch leaves that is nothing: a stretch without noise weighs no more than its signal."""


@dataclass(frozen=True, slots=True)
class Fit:
    """Coefficients of a fit (p,), their standard errors (p,), and the share of the target's variance that it explains.

    The errors are infinite where there are too few stretches to count.
    """

    values: Array
    errors: Array
    explained: float

    def interval(self, place: int) -> tuple[float, float] | None:
        """The 95 % interval of one coefficient, None where it is unknown."""
        half = CI * float(self.errors[place])
        return (float(self.values[place]) - half, float(self.values[place]) + half) if np.isfinite(half) else None

    def certain(self, place: int, times: float) -> bool:
        """Whether a coefficient is at least `times` its standard error."""
        return bool(abs(self.values[place]) > times * self.errors[place])


def robust_fit(columns: Array, target: Array, stretch: NDArray[np.int64]) -> Fit:
    """Fit `target` (n,) by `columns` (n, p) with soft-L1 weights.

    Parameters
    ----------
    columns, target : the problem
    stretch : (n,) number of the stretch of a log that each row belongs to; rows of one stretch err together (Liang and
        Zeger 1986, the sandwich estimate for clusters)
    """
    _, stretch = np.unique(stretch, return_inverse=True)
    count, size = int(stretch.max()) + 1 if stretch.size else 0, columns.shape[1]
    if target.size <= size or count < 3:
        return Fit(np.zeros(size), np.full(size, np.inf), 0.0)
    scale = np.sqrt((columns**2).mean(axis=0))
    alive = scale > 0.0
    scaled = columns / np.where(alive, scale, 1.0)
    weight, found, inverse = np.ones(target.size), np.zeros(size), np.zeros((size, size))
    for _ in range(ROUNDS):
        normal = (scaled * weight[:, None]).T @ scaled
        inverse = np.asarray(np.linalg.pinv(normal, rcond=1e-10, hermitian=True), dtype=float)
        found = inverse @ (scaled.T @ (weight * target))
        left = target - scaled @ found
        spread = max(1.4826 * float(np.median(np.abs(left))), 1e-12)
        weight = 1.0 / np.sqrt(1.0 + (left / (2.0 * spread)) ** 2)
    gradient = np.array([np.bincount(stretch, weight * left * column, count) for column in scaled.T])
    covariance = inverse @ (gradient @ gradient.T) @ inverse * count / (count - 1)
    # A direction that the pseudo-inverse dropped is not known at all, whatever the sandwich says.
    values, vectors = np.linalg.eigh((scaled * weight[:, None]).T @ scaled)
    lost = values < 1e-8 * max(float(values[-1]), 1e-300)
    unknown = (vectors[:, lost] ** 2).sum(axis=1) > 1e-6
    errors = np.where(alive & ~unknown, np.sqrt(np.diag(covariance).clip(0.0)), np.inf)
    total = float((weight * (target - np.average(target, weights=weight)) ** 2).sum())
    explained = 1.0 - float((weight * left**2).sum()) / total if total > 0.0 else 0.0
    unit = np.where(alive, scale, 1.0)
    return Fit(found / unit, errors / unit, explained)


def surely_more(left: Array, other: Array) -> bool:
    """Whether one explanation of a record leaves more than another, by great odds and not by chance.

    The difference in log likelihood, each stretch with its own variance and no more than two independent values, gives
    the odds. Its mean over stretches by its standard error is the statistic of Vuong (1989) for two models of which
    neither need be true.

    Parameters
    ----------
    left, other : (stretches,) power that the two leave, in the same stretches
    """
    if left.size < 2:
        return False
    floor = max(_FLOOR * float(other.mean()), 1e-300)
    more = np.log((left + floor) / (other + floor))
    error = float(more.std(ddof=1)) / np.sqrt(more.size)
    sure = float(student.ppf(1.0 - _BY_CHANCE, more.size - 1))
    return bool(more.sum() > np.log(_ODDS) and more.mean() > sure * error)


def noise_level(values: Array) -> float | None:
    """Estimate the white noise on an evenly sampled record (n,), in its unit; None for fewer than ten values.

    The standard deviation from third differences, in which smooth motion cancels and white noise grows by the square
    root of 20; the median makes single jumps harmless. Motion faster than a few samples counts as noise, so this is an
    upper limit.
    """
    if values.size < 10:
        return None
    return float(1.4826 * np.median(np.abs(np.diff(values, 3))) / np.sqrt(20.0))


def sensor_noise(motions: Sequence[Motion]) -> Array:
    """White noise on u, v [m/s] and r [rad/s], (3,): root mean square over the motions, weighted by their rows."""
    levels = np.array([[noise_level(m.velocity[:, axis]) or 0.0 for axis in range(3)] for m in motions])
    rows = np.array([m.time.size for m in motions], dtype=float)
    return np.sqrt((levels**2 * rows[:, None]).sum(axis=0) / rows.sum())
