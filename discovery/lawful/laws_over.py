"""Laws of a vehicle over an envelope: in numbers that are affine in some parameters, a proof, and the price of them.

The numbers serve the refit and online adaptation, `certify` proves dissipation by matrix inequalities, and `Passivity`
is what findings say of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import AliasChoices, BeforeValidator, Field, PlainSerializer

from ...physics.effects import parse_form
from ...physics.file_records import Number, Record
from ...physics.laws.damping_power import (
    Envelope,
    Exponents,
    State,
    basis,
    control_matrices,
    corner_state,
    damping_power,
    mass_margin,
    power_of,
    state_in_words,
    vehicle_degree,
    vehicle_power,
)
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from .convex_program import LawNumbers, solve_excess

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


NOTHING = 1e-6
"""A relative price below this is none."""


def _by_name(state: State) -> dict[str, float]:
    return dict(zip("uvr", state, strict=True))


def _state(content: object) -> object:
    """(u, v, r) from a file, which has them by name."""
    if not isinstance(content, Mapping):
        return content
    if set(content) != set("uvr"):
        raise ValueError("numbers named u, v and r")
    return tuple(content[name] for name in "uvr")


def _envelope(content: object) -> object:
    """An envelope from a file, which has [lower, upper] by velocity."""
    if not isinstance(content, Mapping):
        return content
    try:
        (u0, u1), (v0, v1), (r0, r1) = (map(float, content[name]) for name in "uvr")
        return Envelope((u0, v0, r0), (u1, v1, r1))
    except (KeyError, TypeError, ValueError):
        raise ValueError("[lower, upper] about rest for each of u, v and r") from None


Velocities = Annotated[State, BeforeValidator(_state), PlainSerializer(_by_name)]
"""A state (u, v, r) [m/s, m/s, rad/s], which files have by name."""
Box = Annotated[Envelope, BeforeValidator(_envelope), PlainSerializer(Envelope.to_dict)]
"""An envelope, which files have as [lower, upper] by velocity."""


class Binding(Record):
    """The state in which the law of dissipation holds the fit most.

    Attributes
    ----------
    state : corner of the envelope (u, v, r) [m/s, m/s, rad/s]; `at` in the file
    multiplier : share of the misfit that 1 W more at this corner would save [1/W]
    symbol : the parameter that the law moves most, weighed by what that costs
    wanted, allowed : its value without and with the law
    unit : of the parameter
    """

    state: Velocities = Field(validation_alias=AliasChoices("state", "at"), serialization_alias="at")
    multiplier: Number
    multiplier_unit: str = "share of the misfit for 1 W"
    symbol: str
    wanted: Number
    allowed: Number
    unit: str


class MostPower(Record):
    """The largest power that damping puts into the hull [`unit`], as a random search found it, and in which state."""

    value: Number
    unit: str = "W"
    at: Velocities


class Passivity(Record):
    """Passivity of a model's damping over an envelope, and what that cost the fit.

    Attributes
    ----------
    proof : "vertex LMI" where matrix inequalities prove it; "search" where the verdict rests on 1e5 random states
    envelope : velocities relative to the water for which it holds
    price : relative rise of the misfit against the fit without the law
    binding : where the law binds; None where it costs nothing
    worst : the largest power that a random search found
    sentence : the same in words
    """

    verdict: Literal["pass", "fail"]
    proof: Literal["vertex LMI", "search"]
    envelope: Box
    price: Number
    binding: Binding | None = None
    worst: MostPower
    sentence: str


def price_in_words(price: float, binding: Binding | None, kept: bool, nominal: str) -> str:
    """The price of passivity as a sentence.

    >>> price_in_words(0.0, None, True, 'Otter')
    'Passivity costs nothing: the best fit takes energy out of the hull everywhere in the envelope.'
    """
    where = "everywhere in the envelope"
    if kept and (binding is None or price <= NOTHING):
        return f"Passivity costs nothing: the best fit takes energy out of the hull {where}."
    short = (
        ""
        if kept
        else (
            f"The damping of {nominal} creates energy in a part of the envelope, and the added effects cannot mend "
            "that; the corrected model is held to be no worse. "
        )
    )
    if binding is None or price <= NOTHING:
        return short + "That costs nothing."
    law = "Passivity" if kept else "That"
    cost = f"costs {percent(price)} of fit" if price < 10.0 else f"makes the misfit {1.0 + price:.0f} times as large"
    watts = next((w for w in (1.0, 0.1, 0.01, 1e-3) if binding.multiplier * w <= 0.5), 1e-4)
    at = "at rest" if not any(binding.state) else f"at {state_in_words(binding.state)}"
    return (
        f"{short}{law} {cost}. It binds {at}: {binding.symbol} wants {binding.wanted:.4g} "
        f"{binding.unit} and is held at {binding.allowed:.4g}; {watts:g} W more there would save "
        f"{percent(binding.multiplier * watts)} of the misfit."
    )


def percent(share: float) -> str:
    """A share in per cent with two digits that matter; a multiple from ten on.

    >>> percent(0.00312), percent(0.25), percent(41.0)
    ('0.31 %', '25 %', '41 times')
    """
    return (
        f"{share:.0f} times" if share >= 10.0 else f"{100.0 * share:.2g} %" if share < 1.0 else f"{100 * share:.0f} %"
    )
