"""The matrices of the model: mass M, Coriolis C and damping D, in Fossen's parametrisation."""

import numpy as np

from .cross_flow import cross_flow_matrix
from .effects import PARAMETERS
from .frames import AXES, Array
from .terms import Form, parse_form
from .thrusters import Thruster
from .vehicle import Vehicle, hull_of

HYDRODYNAMIC: tuple[tuple[str, int, Form], ...] = tuple(
    (p.symbol, p.axis, parse_form(p.form)) for p in PARAMETERS.values() if p.axis is not None and p.form
)
"""(symbol, axis, monomial) of every damping and coupling parameter of the catalogue."""


def active_terms(vehicle: Vehicle) -> list[tuple[float, int, Form]]:
    """(value, axis, monomial) of every hydrodynamic monomial that is not zero, unnamed ones included.

    Cross-flow drag is none of them.
    """
    values = vehicle.values
    named = [(values[symbol], axis, form) for symbol, axis, form in HYDRODYNAMIC if values[symbol] != 0.0]
    return named + [(t.value, AXES.index(t.axis), parse_form(t.form)) for t in vehicle.terms if t.value != 0.0]


def mass_matrix(vehicle: Vehicle) -> Array:
    """M = M_RB + M_A (3, 3) [kg, kg m, kg m^2], Fossen (2021) eqs. 3.63 and 6.105 in the plane.

    N_vdot = Y_rdot, so M is symmetric.
    """
    return np.array(mass_rows(vehicle))


def mass_rows(vehicle: Vehicle) -> list[list[float]]:
    """The rows of the mass matrix as plain numbers."""
    p = vehicle.values
    m13, m23 = -p["mass"] * p["y_g"], p["mass"] * p["x_g"] - p["Y_rdot"]
    return [
        [p["mass"] - p["X_udot"], 0.0, m13],
        [0.0, p["mass"] - p["Y_vdot"], m23],
        [m13, m23, p["inertia_z"] - p["N_rdot"]],
    ]


def coriolis_matrix(vehicle: Vehicle, velocity: Array) -> Array:
    """C(nu_r) (..., 3, 3), skew-symmetric, from M (Fossen 2021, theorem 3.2): nu^T C(nu) nu = 0 exactly.

    Parameters
    ----------
    velocity : (..., 3) relative to the water [m/s, m/s, rad/s]
    """
    m = mass_matrix(vehicle)
    u, v, r = np.moveaxis(np.asarray(velocity, dtype=float), -1, 0)
    c13, c23 = -(m[1, 1] * v + m[1, 2] * r), m[0, 0] * u + m[0, 2] * r
    matrix = np.zeros((*u.shape, 3, 3))
    matrix[..., 0, 2], matrix[..., 1, 2] = c13, c23
    matrix[..., 2, 0], matrix[..., 2, 1] = -c13, -c23
    return matrix


def damping_matrix(vehicle: Vehicle, velocity: Array) -> Array:
    """D(nu_r) (..., 3, 3) with D nu_r = minus the hydrodynamic force of every damping, coupling and unnamed term.

    Each monomial stands in the column of its last factor without modulus (u|u| in the first, u r in the third); a
    monomial of moduli only is not a damping term and is left out. Cross-flow drag adds its own symmetric matrix. Fossen
    (2021), section 6.4.
    """
    state = np.moveaxis(np.asarray(velocity, dtype=float), -1, 0)
    u, v, r = state
    matrix = np.zeros((*u.shape, 3, 3))
    for value, axis, form in active_terms(vehicle):
        column = form.column
        if column is None:
            continue
        factors = list(form.factors)
        factors.reverse()
        factors.remove("uvr"[column])
        rest = parse_form("".join(factors))(u, v, r) if factors else np.ones_like(u)
        matrix[..., axis, column] -= value * rest
    coefficient = vehicle.values["cross_flow"]
    if coefficient:
        hull = hull_of(vehicle)
        matrix += coefficient * cross_flow_matrix(hull.length, hull.draught, v, r)
    return matrix


def thruster_matrix(vehicle: Vehicle) -> Array:
    """B (3, thrusters): tau = B T for thruster forces T [N] (Fossen 2021, section 9.8)."""
    return np.array([push_of(thruster) for thruster in vehicle.thrusters]).T


def push_of(thruster: Thruster) -> tuple[float, float, float]:
    """What a newton of a thruster does ahead, to starboard and in yaw [N, N, N m]: its column of B."""
    ahead, aside, arm = thruster.push
    return ahead, aside, thruster.arm_scale * arm
