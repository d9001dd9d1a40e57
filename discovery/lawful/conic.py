"""Quadratic programmes with matrix inequalities, by Clarabel (Goulart and Chen 2024, arXiv:2405.12762).

It takes half a second to load, so that whoever asks for it imports it where it is needed.
"""

from importlib import import_module

import numpy as np
from scipy.sparse import csc_matrix

from ...physics.errors import RequestError
from ...physics.frames import Array
from ...physics.laws.certificate import Exponents, basis, control_matrices

_SOLVER = import_module("clarabel")
"""Compiled, and without types."""
_TOLERANCES = ((1e-12, 1e-10, 1e-9), (1e-6, 1e-6, 1e-7))
"""Gap, relative gap and feasibility of the first attempt, and of a second one where these are beyond rounding."""
_INSIDE = 1e-6
"""Margin that a certificate takes where it can, so that rounding of the solver does not break it."""
_COLUMN, _ROW = np.tril_indices(3)
"""The upper triangle of a 3 x 3 matrix, column by column, as the solver takes it."""
_WEIGHT = np.where(_ROW == _COLUMN, 1.0, np.sqrt(2.0))
"""Of its elements, so that lengths stay."""


def minimise(
    quadratic: Array, linear: Array, limits: tuple[Array, Array], constant: Array, slope: Array
) -> tuple[Array, Array] | None:
    """Minimise x^T quadratic x / 2 + linear^T x within limits, with constant + slope x positive semidefinite.

    Parameters
    ----------
    quadratic, linear : (n, n) and (n,)
    limits : lower and upper (n,), infinite where there is none
    constant, slope : (m, 3, 3) and (m, 3, 3, n), of m symmetric matrices

    Returns
    -------
    tuple or None
        x (n,), and the multipliers of the matrices (m, 3, 3); None when no x keeps the constraints.

    Raises
    ------
    RequestError
        when the solver reports neither an optimum nor that there is none.
    """
    rows, ends, cones = [np.zeros((0, linear.size))], [np.zeros(0)], []
    for sign, limit in ((-1.0, limits[0]), (1.0, limits[1])):
        known = np.flatnonzero(np.isfinite(limit))
        rows.append(sign * np.eye(linear.size)[known])
        ends.append(sign * limit[known])
        cones += [_SOLVER.NonnegativeConeT(known.size)] if known.size else []
    bounds = sum(map(len, rows))
    rows.append(-(slope[:, _ROW, _COLUMN] * _WEIGHT[:, None]).reshape(-1, linear.size))
    ends.append((constant[:, _ROW, _COLUMN] * _WEIGHT).ravel())
    cones += [_SOLVER.PSDTriangleConeT(3)] * len(constant)
    problem = csc_matrix(np.triu(quadratic)), linear, csc_matrix(np.concatenate(rows)), np.concatenate(ends), cones
    settings, status = _SOLVER.DefaultSettings(), _SOLVER.SolverStatus
    settings.verbose, settings.max_threads = False, 1
    for tolerances in _TOLERANCES:
        settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = tolerances
        answer = _SOLVER.DefaultSolver(*problem, settings).solve()
        if answer.status in (status.PrimalInfeasible, status.AlmostPrimalInfeasible):
            return None
        if answer.status == status.Solved:
            pull = np.empty_like(constant)
            pull[:, _ROW, _COLUMN] = pull[:, _COLUMN, _ROW] = np.array(answer.z)[bounds:].reshape(-1, 6) / _WEIGHT
            return np.array(answer.x), pull
    raise RequestError(f"lawful refit: expected an optimum, the solver says {answer.status}; try fewer effects")


def exchanges(power: Array, degree: Exponents) -> Array:
    """Slacks (orthants, s) with which S is positive semidefinite at its control points, or least far from it.

    Parameters
    ----------
    power : (orthants, m) coefficients of the power, of order one in every orthant

    Raises
    ------
    RequestError
        see `minimise`.
    """
    b = basis(degree)
    count, slacks = len(b.points), b.slack.shape[-1]
    excess = np.eye(count)[:, None, None, :] * np.eye(3)[None, :, :, None]  # one number for each control point
    slope, cost = np.concatenate([excess, b.slack], axis=-1), np.repeat([1.0, 0.0], [count, slacks])
    limits = np.repeat([-_INSIDE, -np.inf], [count, slacks]), np.full(count + slacks, np.inf)
    found = []
    for row in control_matrices(power, None, degree):
        optimum = minimise(np.zeros((cost.size, cost.size)), cost, limits, row, slope)
        assert optimum is not None, "a large enough excess is always feasible"
        found.append(optimum[0][count:])
    return np.array(found)
