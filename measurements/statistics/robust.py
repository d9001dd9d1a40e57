"""Linear fits that false rows do not sway, with errors counted by stretches of a log."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...physics.frames import Array
from .blocks import block_scores, sandwich

CI = 1.96
"""Standard errors in half a 95 % interval."""
_ROUNDS = 6
_LEAST_SPREAD = 1e-12
"""Spread that stands for none, so that what is left can be divided by it."""


def spread(values: Array, axis: int | None = None) -> Array:
    """Standard deviation of errors about zero, told by their median modulus: false rows do not sway it.

    Half of all normal numbers lie within 1/1.4826 of a standard deviation.
    """
    return 1.4826 * np.median(np.abs(values), axis=axis)


def robust_squares(
    columns: Array, target: Array, held: Array | None = None, weight: Array | None = None
) -> tuple[Array, Array, Array]:
    """Least squares with weights that grow small for outliers (soft-L1), or with given weights.

    Parameters
    ----------
    columns, target : the problem, (n, p) and (n,)
    held : (p,) one over the usual size of each coefficient, 0 for one that may have any size; default: all zero
    weight : (n,) given weights

    Returns
    -------
    coefficients (p,), weights (n,), inverse normal matrix (p, p)
    """
    w = np.ones(target.size) if weight is None else weight
    found, inverse = np.zeros(columns.shape[1]), np.zeros((columns.shape[1],) * 2)
    size = float(np.std(target))
    for _ in range(_ROUNDS if weight is None else 1):
        normal = (columns * w[:, None]).T @ columns
        if held is not None:
            normal = normal + size**2 * np.diag(held**2)
        inverse = np.asarray(np.linalg.pinv(normal, rcond=1e-10, hermitian=True), dtype=float)
        found = inverse @ (columns.T @ (w * target))
        if weight is None:
            left = target - columns @ found
            size = max(float(spread(left)), _LEAST_SPREAD)
            w = 1.0 / np.sqrt(1.0 + (left / (2.0 * size)) ** 2)
    return found, w, inverse


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
    stretch : (n,) number of the stretch of a log that each row belongs to; rows of one stretch err together
    """
    _, stretch = np.unique(stretch, return_inverse=True)
    count, size = int(stretch.max()) + 1 if stretch.size else 0, columns.shape[1]
    if target.size <= size or count < 3:
        return Fit(np.zeros(size), np.full(size, np.inf), 0.0)
    scale = np.sqrt((columns**2).mean(axis=0))
    alive = scale > 0.0
    unit = np.where(alive, scale, 1.0)
    scaled = columns / unit
    found, weight, inverse = robust_squares(scaled, target)
    left = target - scaled @ found
    covariance = sandwich(inverse, block_scores(scaled, weight * left, stretch))
    # A direction that the pseudo-inverse dropped is not known at all, whatever the sandwich says.
    values, vectors = np.linalg.eigh((scaled * weight[:, None]).T @ scaled)
    lost = values < 1e-8 * max(float(values[-1]), 1e-300)
    unknown = (vectors[:, lost] ** 2).sum(axis=1) > 1e-6
    errors = np.where(alive & ~unknown, np.sqrt(np.diag(covariance).clip(0.0)), np.inf)
    total = float((weight * (target - np.average(target, weights=weight)) ** 2).sum())
    explained = 1.0 - float((weight * left**2).sum()) / total if total > 0.0 else 0.0
    return Fit(found / unit, errors / unit, explained)
