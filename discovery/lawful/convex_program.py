"""Convex programmes of the law and their data, compiled once for each shape and solved again with other numbers.

Compiling a small problem costs far more than solving it, so all numbers are parameters where cvxpy's rules for
parametrised programmes (DPP; Agrawal et al. 2019) let the compiled form be reused. The shape (number of parameters,
which have limits, degree of the damping) is the key of the cache.
"""

import warnings
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from ...physics.errors import RequestError
from ...physics.laws.damping_power import Basis, Exponents, basis
from ...physics.motion import Array

if TYPE_CHECKING:
    import cvxpy

NO_OPTIMUM = "lawful refit: expected an optimal solution, the solver says {!r}; try fewer effects"


@dataclass(frozen=True, slots=True)
class Shape:
    """Shape of a refit: what its compiled programme depends on.

    Attributes
    ----------
    below, above : for each parameter, True where it has a lower or upper limit
    orthants : number of orthants of the envelope, 0 for no law of dissipation
    degree : of the certificate's matrices in each velocity
    mass : True when the mass matrix depends on a parameter
    """

    below: tuple[bool, ...]
    above: tuple[bool, ...]
    orthants: int = 0
    degree: Exponents = (1, 1, 1)
    mass: bool = False


@dataclass(frozen=True, slots=True)
class LawNumbers:
    """The numbers of the laws, in units of order one.

    Attributes
    ----------
    power : (orthants, m) coefficients of the power with all n parameters at zero
    slope : (orthants, m, n) their change with each parameter
    allowance : (orthants, K, 3, 3) S + allowance must be positive semidefinite at each control point
    mass : (3, 3) mass matrix with all parameters at zero, less its margin
    mass_slope : (n, 3, 3) its change with each parameter
    """

    power: Array
    slope: Array
    allowance: Array
    mass: Array
    mass_slope: Array


@dataclass(frozen=True, slots=True)
class Solution:
    """Result of a convex programme.

    Attributes
    ----------
    values : (n,) parameters
    slack : (orthants, s) exchanges of the certificate
    pull : (orthants, K, 3, 3) multipliers of the matrix inequalities: loss saved for each unit of relief
    """

    values: Array
    slack: Array
    pull: Array


_LOCK = Lock()
"""A compiled problem holds its numbers, so that one caller at a time may use it."""
_INSIDE = 1e-6
"""Margin that a certificate takes where it can, so that the solver's tolerance does not break it."""
_COARSER = {"tol_gap_abs": 1e-6, "tol_gap_rel": 1e-6, "tol_feas": 1e-7}
"""Tolerances of a second attempt where the finer ones are beyond rounding; every constraint is checked again."""


class _Refit:
    """min |R x - d|^2 with limits on x, S(x, slack) + allowance >= 0 and M(x) >= 0."""

    def __init__(self, shape: Shape) -> None:
        import cvxpy  # here and below, because it takes half a second to load, and most logs need none of it

        n, count = len(shape.below), shape.orthants
        self.x = cvxpy.Variable(n)
        self.factor, self.target = cvxpy.Parameter((n, n)), cvxpy.Parameter(n)
        self.low, self.high = cvxpy.Parameter(n), cvxpy.Parameter(n)
        below, above = np.flatnonzero(shape.below), np.flatnonzero(shape.above)
        rules: list[cvxpy.Constraint] = []
        if below.size:
            rules.append(self.x[below] >= self.low[below])
        if above.size:
            rules.append(self.x[above] <= self.high[above])
        self.matrices: list[cvxpy.Constraint] = []
        if count:
            b = basis(shape.degree)
            size, slacks = len(b.monomials), b.slack.shape[-1]
            self.power, self.slope = cvxpy.Parameter(count * size), cvxpy.Parameter((count * size, n))
            self.allowance = cvxpy.Parameter((count * len(b.points), 9))
            self.slack = cvxpy.Variable((count, slacks))
            c = cvxpy.Variable((count, size))
            rules.append(cvxpy.vec(c, order="C") == self.power + self.slope @ self.x)
            for o, k in product(range(count), range(len(b.points))):
                ease = self.allowance[o * len(b.points) + k]
                self.matrices.append(_control(b, k, c[o], self.slack[o], ease) >> 0)
        if shape.mass:
            self.mass, self.mass_slope = cvxpy.Parameter(9), cvxpy.Parameter((9, n))
            rules.append(cvxpy.reshape(self.mass + self.mass_slope @ self.x, (3, 3), order="C") >> 0)
        loss = cvxpy.sum_squares(self.factor @ self.x - self.target)
        self.problem = cvxpy.Problem(cvxpy.Minimize(loss), rules + self.matrices)


class _Excess:
    """min sum_k t_k with S(slack) + t_k >= 0 at each control point k of one orthant, t_k >= -_INSIDE."""

    def __init__(self, degree: Exponents) -> None:
        import cvxpy

        b = basis(degree)
        self.power = cvxpy.Parameter(len(b.monomials))
        self.slack = cvxpy.Variable(b.slack.shape[-1])
        excess = cvxpy.Variable(len(b.points))
        c = cvxpy.Variable(len(b.monomials))
        rules = [c == self.power, excess >= -_INSIDE]
        eye = np.eye(3).ravel()
        rules += [_control(b, k, c, self.slack, excess[k] * eye) >> 0 for k in range(len(b.points))]
        self.problem = cvxpy.Problem(cvxpy.Minimize(cvxpy.sum(excess)), rules)


def _control(
    b: Basis, k: int, power: "cvxpy.Expression", slack: "cvxpy.Expression", ease: "cvxpy.Expression"
) -> "cvxpy.Expression":
    """S at control point k plus an addition, (3, 3)."""
    import cvxpy

    found = b.lift[k].reshape(9, -1) @ power + b.slack[k].reshape(9, -1) @ slack + ease
    return cvxpy.reshape(found, (3, 3), order="C")


_refit = lru_cache(maxsize=32)(_Refit)
_excess = lru_cache(maxsize=8)(_Excess)


def solve_refit(
    shape: Shape, factor: Array, target: Array, limits: tuple[Array, Array], law: LawNumbers | None = None
) -> Solution | None:
    """Least squares |factor x - target|^2 under limits and laws; None when no x satisfies them.

    Parameters
    ----------
    factor, target : (n, n) and (n,)
    limits : lower and upper (n,); read where the shape says that there is one

    Raises
    ------
    RequestError
        when the solver fails, or reports neither an optimum nor that there is none.
    """
    with _LOCK:
        p = _refit(shape)
        p.factor.value, p.target.value = factor, target
        p.low.value, p.high.value = (np.where(np.isfinite(x), x, 0.0) for x in limits)
        if law is not None:
            n = len(shape.below)
            if shape.orthants:
                p.power.value, p.slope.value = law.power.ravel(), law.slope.reshape(-1, n)
                p.allowance.value = law.allowance.reshape(-1, 9)
            if shape.mass:
                p.mass.value, p.mass_slope.value = law.mass.ravel(), law.mass_slope.reshape(n, 9).T
        if not _solve(p.problem):
            return None
        slack, pull = np.zeros((0, 0)), np.zeros((0, 0, 3, 3))
        if shape.orthants:
            slack = np.asarray(p.slack.value, dtype=float)
            pull = np.array([np.asarray(rule.dual_value, dtype=float) for rule in p.matrices])
            pull = pull.reshape(shape.orthants, -1, 3, 3)
        return Solution(np.asarray(p.x.value, dtype=float), slack, pull)


def solve_excess(power: Array, degree: Exponents) -> Array:
    """Slacks (orthants, s) with which S is positive semidefinite at the control points, or least far from it.

    Parameters
    ----------
    power : (orthants, m) coefficients of the power, of order one in every orthant

    Raises
    ------
    RequestError
        when the solver fails, or does not report an optimum.
    """
    with _LOCK:
        p = _excess(degree)
        slacks = []
        for row in power:
            p.power.value = row
            if not _solve(p.problem):
                raise RequestError(NO_OPTIMUM.format(p.problem.status))
            slacks.append(np.asarray(p.slack.value, dtype=float))
    return np.array(slacks)


def _solve(problem: "cvxpy.Problem") -> bool:
    """Solve with Clarabel: True for an optimum, False where there is none; anything else is an error."""
    import cvxpy

    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Solution may be inaccurate")  # its status is an error below
            problem.solve(solver=cvxpy.CLARABEL, enforce_dpp=True)
            if problem.status == cvxpy.OPTIMAL_INACCURATE:
                problem.solve(solver=cvxpy.CLARABEL, enforce_dpp=True, **_COARSER)
    except cvxpy.SolverError as error:
        raise RequestError(f"lawful refit: the solver failed ({error}); try fewer effects") from None
    if problem.status != cvxpy.OPTIMAL and problem.status not in (cvxpy.INFEASIBLE, cvxpy.INFEASIBLE_INACCURATE):
        raise RequestError(NO_OPTIMUM.format(problem.status))
    return problem.status == cvxpy.OPTIMAL
