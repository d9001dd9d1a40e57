"""The lawful refit: the chosen parameters again, by a convex programme whose limits hold on the numbers returned."""

from collections.abc import Sequence

import cvxpy
import numpy as np

from ..physics.errors import RequestError
from ..physics.frames import Array
from .gram import GramScores
from .options import Option

_TOLERANCE = 1e-6


def lawful_refit(scores: GramScores, chosen: Sequence[Option]) -> dict[str, float]:
    """Least squares of the chosen parameters under their physical limits, by symbol (total values).

    Limits are those of the catalogue on nominal plus added value: damping never drives, thruster scales and lags
    are not negative, added mass adds. The quadratic programme is solved by Clarabel through cvxpy on the R factor of
    the compressed data, and each limit is checked again on the numbers that came back.

    Raises
    ------
    RequestError
        when the solver does not report an optimum, or a returned number breaks a limit.
    """
    columns, left, right = scores.block_normal(chosen)
    values: dict[str, float] = {s: v for option in chosen for s, v in zip(option.symbols, option.start, strict=True)}
    if columns.size == 0:
        return values
    normal, pull = left.sum(axis=0), right.sum(axis=0)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    factor, target = _factor(normal * (scale[:, None] * scale[None, :]), pull * scale)
    rows = [
        (symbol, start, low, high)
        for option in chosen
        for symbol, start, index, low, high in zip(
            option.symbols, option.start, option.free, option.lower, option.upper, strict=True
        )
        if index >= 0
    ]
    # Solve for total values, each in units of its own size, so that every number the solver sees is of order one.
    start = np.array([row[1] for row in rows]) / scale
    target = target + factor @ start
    size = float(np.linalg.norm(target)) or 1.0
    lower = (np.array([row[2] for row in rows]) / scale + start) / size
    upper = (np.array([row[3] for row in rows]) / scale + start) / size
    x = cvxpy.Variable(columns.size)
    limits = [x[k] >= b for k, b in enumerate(lower) if np.isfinite(b)]
    limits += [x[k] <= b for k, b in enumerate(upper) if np.isfinite(b)]
    problem = cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(factor @ x - target / size)), limits)
    try:
        problem.solve(solver=cvxpy.CLARABEL)
    except cvxpy.SolverError as error:
        raise RequestError(f"lawful refit: the solver failed ({error}); try fewer effects") from None
    if problem.status != cvxpy.OPTIMAL or x.value is None:
        raise RequestError(
            f"lawful refit: expected an optimal solution, the solver says {problem.status!r}; try fewer effects"
        )
    found = np.asarray(x.value, dtype=float)
    slack = _TOLERANCE * (1.0 + np.abs(found))
    broken = (found < lower - slack) | (found > upper + slack)
    if broken.any():
        names = ", ".join(row[0] for row, bad in zip(rows, broken, strict=True) if bad)
        raise RequestError(f"lawful refit: the solution breaks the limits of {names}; try fewer effects")
    total = np.clip(found, lower, upper) * size * scale
    return values | {row[0]: float(value) for row, value in zip(rows, total, strict=True)}


def _factor(normal: Array, pull: Array) -> tuple[Array, Array]:
    """R and d with R^T R = normal and R^T d = pull, so that |R x - d|^2 is the least-squares loss up to a constant."""
    size, vectors = np.linalg.eigh(normal)
    root = np.sqrt(np.maximum(size, 1e-12 * size.max()))
    return root[:, None] * vectors.T, (vectors.T @ pull) / root
