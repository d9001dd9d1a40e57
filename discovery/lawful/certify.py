"""Is a given vehicle dissipative over an envelope? A proof by matrix inequalities, or how far one is away."""

from dataclasses import dataclass

import numpy as np

from ...physics.laws.damping_power import (
    Envelope,
    Exponents,
    State,
    control_matrices,
    corner_state,
    damping_power,
    vehicle_degree,
    vehicle_power,
)
from ...physics.motion import Array
from ...physics.vehicle import Vehicle

_ROUNDING = 1e-9
"""Share of the power scale below which a negative eigenvalue is rounding."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """A proof of dissipation, or how far one is away.

    Attributes
    ----------
    holds : True when dissipation is proved at every state of the envelope
    short : power [W] at the far corner's scale that is missing for a proof; 0 when it holds
    state : the control point that is worst (u, v, r) [m/s, m/s, rad/s]
    """

    holds: bool
    short: float
    state: State


def certify(vehicle: Vehicle, envelope: Envelope) -> Certificate:
    """Prove that the damping force of a vehicle takes energy out at every state of an envelope.

    First without exchanges (as D + D^T stands), then with the best ones for each orthant, found by a small
    semidefinite programme. The eigenvalues are worked out again from the exchanges returned, so that the proof does
    not rest on the solver. Cross-flow drag of a positive coefficient takes energy out by itself, and is left out. No
    proof is no disproof: `physics.laws.damping_power.worst_dissipation` looks for a violation.

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
    scale = power_scale(power)
    eigenvalues = least_eigenvalues(power / scale, None, degree)
    short = eigenvalues.min(axis=1) < -1e-13
    if short.any():
        from .convex_program import solve_excess  # here, because it takes half a second, and most vehicles need none

        slack = solve_excess(power[short] / scale[short], degree)
        eigenvalues[short] = least_eigenvalues(power[short] / scale[short], slack, degree)
    watts = eigenvalues * scale
    orthant, point = np.unravel_index(int(np.argmin(watts)), watts.shape)
    return Certificate(
        bool((eigenvalues >= -_ROUNDING).all()),
        max(0.0, -float(watts.min())),
        corner_state(envelope, int(orthant), int(point), degree),
    )


def power_scale(*powers: Array) -> Array:
    """Largest coefficient of some powers (orthants, m) [W] in each orthant, (orthants, 1); never zero."""
    return np.maximum(np.max([np.abs(p).max(axis=1) for p in powers], axis=0), 1e-12)[:, None]


def least_eigenvalues(power: Array, slack: Array | None, degree: Exponents) -> Array:
    """Smallest eigenvalue of S at each control point, (orthants, K), in the unit of the power.

    Parameters
    ----------
    power : coefficients (orthants, m) [W] of the power of the damping
    slack : exchanges (orthants, s), none for None
    degree : of S in each velocity
    """
    return np.asarray(np.linalg.eigvalsh(control_matrices(power, slack, degree))[..., 0], dtype=float)
