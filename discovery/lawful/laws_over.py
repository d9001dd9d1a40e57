"""Laws of a vehicle over an envelope, affine in some of its parameters, for the refit and for online adaptation."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...physics.effects import parse_form
from ...physics.laws.damping_power import (
    Envelope,
    Exponents,
    basis,
    control_matrices,
    mass_margin,
    power_of,
    vehicle_degree,
    vehicle_power,
)
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from .certify import least_eigenvalues, power_scale
from .program_data import LawNumbers

MARGIN = 1e-6
"""Share of the power scale by which every control matrix is kept positive, so that rounding breaks no law."""
_LEAST_MASS = 1e-3
"""Smallest eigenvalue of M, scaled to a unit rigid body, that a fit may reach."""
_MASSES = {"X_udot", "Y_vdot", "N_rdot", "Y_rdot", "mass", "x_g", "y_g"}


@dataclass(frozen=True, slots=True, eq=False)
class Laws:
    """Dissipation over an envelope and positive mass, in units of order one.

    Attributes
    ----------
    numbers : of the laws
    degree : of the certificate's matrices in each velocity
    scale : (orthants, 1) of the power [W]
    before : (orthants, m) coefficients of the power of the nominal vehicle [W]
    mass : the mass matrix depends on a parameter
    """

    numbers: LawNumbers
    degree: Exponents
    scale: Array
    before: Array
    mass: bool

    @property
    def hopeless(self) -> bool:
        """True when linear damping creates energy and no parameter can mend that, or there is no parameter."""
        linear = [sum(e) == 2 for e in basis(self.degree).monomials]
        at_rest = least_eigenvalues(self.numbers.power, None, self.degree)[:, 0]
        return not self.numbers.slope[:, linear].any() and bool((at_rest < -MARGIN).any())

    def allowing_nominal(self) -> "Laws":
        """Ask at each control point for no more than the nominal model has: the negative part of its S is allowed."""
        from .convex_program import solve_excess  # here, because cvxpy takes half a second to load

        slack = solve_excess(self.before / self.scale, self.degree)
        size, vectors = np.linalg.eigh(control_matrices(self.before / self.scale, slack, self.degree))
        missing = np.einsum("...ik,...k,...jk->...ij", vectors, np.maximum(-size, 0.0), vectors)
        return replace(self, numbers=replace(self.numbers, allowance=missing + MARGIN * np.eye(3)))


def laws_over(
    envelope: Envelope, nominal: Vehicle, after: Vehicle, units: Mapping[str, float], least_mass: float
) -> Laws:
    """The laws of a vehicle whose parameters x are total values over their units.

    Parameters
    ----------
    envelope : velocities relative to the water
    nominal : the vehicle whose other parameters stay
    after : one with plausible values, for the scale of the power
    units : by symbol of the parameters, in their order
    least_mass : see `least_margin`
    """
    damping = {s: p for s in units if (p := nominal.parameter(s)).form}
    at_zero = nominal.with_values(dict.fromkeys(units, 0.0))
    at_one = nominal.with_values(dict.fromkeys(damping, 1.0))
    degree = vehicle_degree(nominal, after, at_one)
    before, later = (vehicle_power(v, envelope, degree) for v in (nominal, after))
    scale = power_scale(before, later)
    rigid = np.sqrt([nominal.mass, nominal.mass, nominal.inertia_z])
    size = np.outer(rigid, rigid)
    mass = mass_matrix(nominal)
    at_none = mass.copy()  # in proportion to each of them, and so it is taken to be to all: x_g is times the mass
    slope = np.zeros((*before.shape, len(units)))
    mass_slope = np.zeros((len(units), 3, 3))
    for k, (symbol, unit) in enumerate(units.items()):
        parameter = damping.get(symbol)
        if parameter is not None and parameter.axis is not None:
            power = power_of(parameter.axis, parse_form(parameter.form), envelope, degree)
            slope[:, :, k] = power * unit / scale
        if symbol in _MASSES:
            value = nominal.value(symbol)
            heavier = mass_matrix(nominal.with_values({symbol: value + 1.0})) - mass
            mass_slope[k] = heavier * unit / size
            at_none -= value * heavier
    numbers = LawNumbers(
        vehicle_power(at_zero, envelope, degree) / scale,
        slope,
        np.zeros((scale.size, len(basis(degree).points), 3, 3)),
        at_none / size - least_mass * np.eye(3),
        mass_slope,
    )
    return Laws(numbers, degree, scale, before, bool(_MASSES.intersection(units)))


def least_margin(nominal: Vehicle) -> float:
    """Smallest eigenvalue of M, scaled to a unit rigid body, that is asked of a vehicle beside the nominal one."""
    return min(_LEAST_MASS, 0.5 * mass_margin(nominal))
