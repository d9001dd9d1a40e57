"""A proof of dissipation over a whole envelope: finitely many 3x3 matrices that must be positive semidefinite.

In one orthant of the envelope velocities are nu = e p, with e its far corner and p in the unit cube, and moduli are
plain numbers, so that the power of the damping force is a polynomial P(p) [W] with coefficients linear in the
vehicle's parameters. Write P = -p^T S(p) p. An S(p) in Bernstein form that is positive semidefinite at its control
points is so on the whole cube, so P <= 0 there. For damping of the catalogue S is affine and the control points are the
corners, where S = (D + D^T) / 2 in these units: the vertex LMIs of Boyd et al. (1994, section 4.3). Unnamed terms of
degree three need degree two on some axes, with one more control point halfway (Farouki 2012, section 9).

S is not unique: u v r may stand as u in row v, column r, or as v in row u, column r, or as r in row u, column v. Each
such exchange is a free variable (a slack) of each orthant. Without them honest couplings are rejected: Y_ur + N_uv +
X_vr = 0 does no work whatever its size.

Cross-flow drag is no polynomial in an orthant, since v + x r changes its sign within it. It needs no matrices: its
power is -1/2 rho C_d T sum |v + x r|^3 dx (see `physics.cross_flow`), which C_d >= 0 keeps at or below zero at every
state. So P of everything else is what has to be proved, and a proof of it is one of the whole.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement, product
from math import comb

import numpy as np

from ..frames import Array
from ..matrices import active_terms
from ..terms import Form
from ..vehicle import Vehicle
from .damping_power import Envelope

Exponents = tuple[int, int, int]
_PAIRS = tuple(combinations_with_replacement(range(3), 2))


@dataclass(frozen=True, slots=True)
class Basis:
    """How polynomial coefficients and slacks make matrices at control points; the same for every orthant.

    Attributes
    ----------
    monomials : exponents of p in P, m of them
    points : (K, 3) control points in the unit cube
    lift : (K, 3, 3, m) S at the control points for each coefficient of P
    slack : (K, 3, 3, s) S at the control points for each exchange, with p^T S p = 0
    """

    monomials: tuple[Exponents, ...]
    points: Array
    lift: Array
    slack: Array


@lru_cache(maxsize=4)
def basis(degree: Exponents) -> Basis:
    """The basis for damping matrices of a degree, 1 or 2, in each of the three velocities."""
    points = np.array(list(product(*(range(d + 1) for d in degree))))
    total = 2 + max(degree)
    exponents, lift, slack = [], [], []
    cubes = ((i, j, k) for i, j, k in product(range(total + 1), repeat=3))
    for e in sorted(cubes, key=lambda e: (sum(e), e)):
        slots = [(i, j) for i, j in _PAIRS if 2 <= sum(e) <= total and _fits(e, i, j, degree)]
        if not slots:
            continue
        exponents.append(e)
        matrices = [_slot(i, j, e, points, degree) for i, j in slots]
        diagonal = [m for (i, j), m in zip(slots, matrices, strict=True) if i == j]
        natural = diagonal or matrices
        lift.append(-np.mean(natural, axis=0))
        slack += [m - matrices[0] for m in matrices[1:]]
    return Basis(tuple(exponents), points / np.array(degree), np.stack(lift, axis=-1), np.stack(slack, axis=-1))


def degree_of(terms: Sequence[tuple[int, Form]]) -> Exponents:
    """Degree of S in each velocity that given (axis, monomial) terms need; (1, 1, 1) for all of the catalogue."""
    degree, cubic = [1, 1, 1], [axis for axis, form in terms if form.degree > 2]
    for axis, form in terms:
        factors = [f.strip("|") for f in form.factors]
        if "uvr"[axis] in factors:
            factors.remove("uvr"[axis])
        elif form.column is not None:
            factors.remove("uvr"[form.column])
        else:
            factors.pop()
        for k, name in enumerate("uvr"):
            degree[k] = max(degree[k], factors.count(name))
    if cubic and max(degree) == 1:  # u r in every row is affine on each axis, yet P is of degree four
        degree[cubic[0]] = 2
    return degree[0], degree[1], degree[2]


def vehicle_degree(*vehicles: Vehicle) -> Exponents:
    """Degree of S in each velocity that serves all of some vehicles."""
    return degree_of([(axis, form) for vehicle in vehicles for _, axis, form in active_terms(vehicle)])


def power_of(axis: int, form: Form, envelope: Envelope, degree: Exponents) -> Array:
    """Coefficients (orthants, m) [W] of the power of a unit force `form` on an axis, in every orthant."""
    exponents = [0, 0, 0]
    exponents[axis] += 1
    for factor in form.factors:
        exponents["uvr".index(factor.strip("|"))] += 1
    monomials = basis(degree).monomials
    column = monomials.index((exponents[0], exponents[1], exponents[2]))
    found = np.zeros((len(envelope.orthants), len(monomials)))
    for k, far in enumerate(envelope.orthants):
        size = far[axis]
        for factor in form.factors:
            x = far["uvr".index(factor.strip("|"))]
            size *= abs(x) if factor.startswith("|") else x
        found[k, column] = size
    return found


def vehicle_power(vehicle: Vehicle, envelope: Envelope, degree: Exponents) -> Array:
    """Coefficients (orthants, m) [W] of the power of all damping, coupling and unnamed terms of a vehicle.

    But for cross-flow drag, whose power is never above zero.
    """
    total = np.zeros((len(envelope.orthants), len(basis(degree).monomials)))
    for value, axis, form in active_terms(vehicle):
        total += value * power_of(axis, form, envelope, degree)
    return total


def control_matrices(power: Array, slack: Array | None, degree: Exponents) -> Array:
    """S at every control point [W], (orthants, K, 3, 3), from coefficients of P (orthants, m), slacks (orthants, s)."""
    b = basis(degree)
    matrices = np.einsum("kijm,om->okij", b.lift, power)
    return matrices if slack is None else matrices + np.einsum("kijs,os->okij", b.slack, slack)


def corner_state(envelope: Envelope, orthant: int, point: int, degree: Exponents) -> tuple[float, float, float]:
    """Velocities (u, v, r) of a control point."""
    u, v, r = np.array(envelope.orthants[orthant]) * basis(degree).points[point] + 0.0
    return float(u), float(v), float(r)


def _pair(i: int, j: int) -> Exponents:
    e = [0, 0, 0]
    e[i] += 1
    e[j] += 1
    return e[0], e[1], e[2]


def _fits(exponents: Exponents, i: int, j: int, degree: Exponents) -> bool:
    """True when a monomial of P can stand in rows and columns i, j of an S of some degree."""
    return all(0 <= x - y <= d for x, y, d in zip(exponents, _pair(i, j), degree, strict=True))


def _slot(i: int, j: int, exponents: Exponents, points: np.ndarray, degree: Exponents) -> Array:
    """The control matrices (K, 3, 3) of the S in which one monomial of P stands in rows and columns i, j."""
    rest = [x - y for x, y in zip(exponents, _pair(i, j), strict=True)]
    matrix = np.zeros((3, 3))
    matrix[i, j] = matrix[j, i] = 1.0 if i == j else 0.5
    values = np.ones(len(points))
    for axis, power in enumerate(rest):
        values *= [comb(int(k), power) / comb(degree[axis], power) for k in points[:, axis]]
    return values[:, None, None] * matrix
