"""The laws of a vehicle over an envelope: a proof of dissipation, and both laws as functions affine in parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...physics.frames import Array
from ...physics.laws.certificate import (
    Exponents,
    basis,
    control_matrices,
    corner_state,
    power_of,
    vehicle_degree,
    vehicle_power,
)
from ...physics.laws.damping_power import Envelope, State, damping_power, mass_margin
from ...physics.matrices import mass_matrix
from ...physics.terms import parse_form
from ...physics.vehicle import Vehicle

MARGIN = 1e-6
"""Share of the power scale by which every control matrix is kept positive, so that rounding breaks no law."""
_ROUNDING = 1e-9
"""Share of the power scale below which a negative eigenvalue is rounding."""
_LEAST_MASS = 1e-3
"""Smallest eigenvalue of M, scaled to a unit rigid body, that a fit may reach."""
_MASSES = {"X_udot", "Y_vdot", "N_rdot", "Y_rdot", "mass", "x_g", "y_g"}


@dataclass(frozen=True, slots=True)
class Certificate:
    """A proof of dissipation, or how far one is away.

    Attributes
    ----------
    holds : dissipation is proved at every state of the envelope
    short : power [W] at the far corner's scale that is missing for a proof; 0 when it holds
    state : the control point that is worst (u, v, r) [m/s, m/s, rad/s]
    """

    holds: bool
    short: float
    state: State


def certify(vehicle: Vehicle, envelope: Envelope) -> Certificate:
    """Prove that the damping force of a vehicle takes energy out at every state of an envelope.

    Eigenvalues are computed from the exchanges that the solver returns, so that the proof does not rest on it.
    Cross-flow drag of a positive coefficient dissipates by itself, and is left out. No proof is no disproof, see
    `physics.laws.damping_power.worst_dissipation`.

    Raises
    ------
    RequestError
        when the solver does not report an optimum.
    """
    if vehicle.value("cross_flow") < 0.0:  # a vehicle that is to be judged may have that, and it drives
        far = max(envelope.orthants, key=lambda state: damping_power(vehicle, np.array(state)))
        return Certificate(False, max(0.0, float(damping_power(vehicle, np.array(far)))), far)
    degree = vehicle_degree(vehicle)
    power = vehicle_power(vehicle, envelope, degree)
    scale = _power_scale(power)
    eigenvalues = _least_eigenvalues(power / scale, None, degree)
    short = eigenvalues.min(axis=1) < -1e-13
    if short.any():
        from .conic import exchanges

        slack = exchanges(power[short] / scale[short], degree)
        eigenvalues[short] = _least_eigenvalues(power[short] / scale[short], slack, degree)
    watts = eigenvalues * scale
    orthant, point = np.unravel_index(int(np.argmin(watts)), watts.shape)
    state = corner_state(envelope, int(orthant), int(point), degree)
    return Certificate(bool((eigenvalues >= -_ROUNDING).all()), max(0.0, -float(watts.min())), state)


def _power_scale(*powers: Array) -> Array:
    """Largest coefficient of some powers (orthants, m) [W] in each orthant, (orthants, 1); never zero."""
    return np.maximum(np.max([np.abs(p).max(axis=1) for p in powers], axis=0), 1e-12)[:, None]


def _least_eigenvalues(power: Array, slack: Array | None, degree: Exponents) -> Array:
    """Smallest eigenvalue of S at each control point, (orthants, K), in the unit of the power."""
    return np.asarray(np.linalg.eigvalsh(control_matrices(power, slack, degree))[..., 0], dtype=float)


@dataclass(frozen=True, slots=True)
class Solution:
    """What a programme returned.

    Attributes
    ----------
    values : (n,) parameters
    slack : (orthants, s) exchanges of the certificate
    pull : (orthants, K, 3, 3) multipliers of the matrix inequalities: loss saved for each unit of relief
    """

    values: Array
    slack: Array
    pull: Array


@dataclass(frozen=True, slots=True, eq=False)
class Laws:
    """Dissipation over an envelope and positive mass for n parameters, in units of order one.

    Attributes
    ----------
    power : (orthants, m) coefficients of the power with all parameters at zero
    slope : (orthants, m, n) their change with each parameter
    allowance : (orthants, K, 3, 3) S + allowance must be positive semidefinite at each control point
    mass : (3, 3) mass matrix with all parameters at zero, less its margin
    mass_slope : (n, 3, 3) its change with each parameter
    degree : of S in each velocity
    scale : (orthants, 1) of the power [W]
    before : (orthants, m) coefficients of the power of the nominal vehicle, over the scale
    heavy : the mass matrix depends on a parameter
    """

    power: Array
    slope: Array
    allowance: Array
    mass: Array
    mass_slope: Array
    degree: Exponents
    scale: Array
    before: Array
    heavy: bool

    @property
    def hopeless(self) -> bool:
        """True when linear damping creates energy and no parameter can mend that, or there is no parameter."""
        linear = [sum(e) == 2 for e in basis(self.degree).monomials]
        at_rest = _least_eigenvalues(self.power, None, self.degree)[:, 0]
        return not self.slope[:, linear].any() and bool((at_rest < -MARGIN).any())

    def eased(self, ease: float) -> "Laws":
        """The same laws with a share of the power scale allowed at every control point."""
        return replace(self, allowance=self.allowance + ease * np.eye(3))

    def allowing_nominal(self) -> "Laws":
        """Ask at each control point for no more than the nominal model has: the negative part of its S is allowed."""
        from .conic import exchanges

        size, vectors = np.linalg.eigh(control_matrices(self.before, exchanges(self.before, self.degree), self.degree))
        missing = np.einsum("...ik,...k,...jk->...ij", vectors, np.maximum(-size, 0.0), vectors)
        return replace(self, allowance=missing + MARGIN * np.eye(3))

    def matrices(self, values: Array, slack: Array) -> tuple[Array, Array]:
        """S + allowance (orthants, K, 3, 3) and M (3, 3) of parameters (n,) and exchanges (orthants, s)."""
        damping = control_matrices(self.power + self.slope @ values, slack, self.degree) + self.allowance
        return damping, self.mass + np.tensordot(values, self.mass_slope, 1)

    def minimise(
        self, normal: Array, pull: Array, limits: tuple[Array, Array], orthants: Sequence[int] | None = None
    ) -> Solution | None:
        """Minimise x^T normal x - 2 pull^T x under limits and the laws in some orthants; None when no x keeps them.

        Raises
        ------
        RequestError
            see `conic.minimise`.
        """
        from .conic import minimise

        b, n = basis(self.degree), pull.size
        used = range(len(self.power)) if orthants is None else orthants
        points, slacks = len(b.points), b.slack.shape[-1]
        size = n + len(used) * slacks
        damping = np.zeros((len(used), points, 3, 3, size))
        for k, orthant in enumerate(used):
            damping[k, ..., :n] = np.einsum("kijm,mn->kijn", b.lift, self.slope[orthant])
            damping[k, ..., n + k * slacks : n + (k + 1) * slacks] = b.slack
        mass = np.zeros((int(self.heavy), 3, 3, size))
        mass[..., :n] = np.moveaxis(self.mass_slope, 0, -1)
        at_zero = (control_matrices(self.power, None, self.degree) + self.allowance)[list(used)].reshape(-1, 3, 3)
        constant = np.concatenate([at_zero, np.broadcast_to(self.mass, (len(mass), 3, 3))])
        slope = np.concatenate([damping.reshape(-1, 3, 3, size), mass])
        free = np.full(size - n, np.inf)
        found = minimise(
            np.pad(2.0 * normal, (0, size - n)),
            np.pad(-2.0 * pull, (0, size - n)),
            (np.append(limits[0], -free), np.append(limits[1], free)),
            constant,
            slope,
        )
        if found is None:
            return None
        multipliers = found[1][: len(used) * points].reshape(-1, points, 3, 3)
        return Solution(found[0][:n], found[0][n:].reshape(-1, slacks), multipliers)


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
    scale = _power_scale(before, later)
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
    return Laws(
        vehicle_power(at_zero, envelope, degree) / scale,
        slope,
        np.zeros((scale.size, len(basis(degree).points), 3, 3)),
        at_none / size - least_mass * np.eye(3),
        mass_slope,
        degree,
        scale,
        before / scale,
        bool(_MASSES.intersection(units)),
    )


def least_margin(nominal: Vehicle) -> float:
    """Smallest eigenvalue of M, scaled to a unit rigid body, that is asked of a vehicle beside the nominal one."""
    return min(_LEAST_MASS, 0.5 * mass_margin(nominal))
