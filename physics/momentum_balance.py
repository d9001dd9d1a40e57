"""The momentum balance of a vehicle term by term: what `forces.py` evaluates, and what a reader is shown."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from .effects import PARAMETERS
from .frames import AXES, Array
from .matrices import HYDRODYNAMIC, mass_matrix, thruster_matrix
from .terms import parse_form
from .vehicle import Vehicle

NEGLIGIBLE = 1e-12
"""Coefficient that is what rounding leaves of nothing, in SI units: its term is not written."""


class BalanceTerm(NamedTuple):
    """One summand: `coefficient` times the product of `factors`, made of the parameters `symbols`.

    A factor is `u v r` (relative to the water) or a modulus such as `|u|`, a derivative `u_dot`, the force of a
    thruster `T:port`, `cos psi` or `sin psi`, the time `t` since the beginning of the log [min], the apparent
    wind `u_a v_a |V_a|`, or a filtered velocity `q_v q_r` of the wake memory.
    """

    coefficient: float
    factors: tuple[str, ...]
    symbols: tuple[str, ...]

    def value(self, state: Mapping[str, Array]) -> Array:
        """The summand, from the value of each factor by name."""
        result = self.coefficient + 0.0 * state["u"]
        for factor in self.factors:
            result = result * state[factor]
        return result


@dataclass(frozen=True, slots=True)
class Balance:
    """One axis: the sum of `inertia` equals the sum of `force` [N, N or N m]."""

    axis: str
    inertia: tuple[BalanceTerm, ...]
    force: tuple[BalanceTerm, ...]


def balances(vehicle: Vehicle) -> tuple[Balance, Balance, Balance]:
    """The momentum balance of surge, sway and yaw; terms that are zero are left out.

    M nu_r_dot = B T - C(nu_r) nu_r - D(nu_r) nu_r + other, Fossen (2021), eq. 6.1 in the plane, with C from M by his
    theorem 3.2.
    """
    p = vehicle.values
    m: list[list[float]] = mass_matrix(vehicle).tolist()
    ahead, across, middle, beside = ("mass", "X_udot"), ("mass", "Y_vdot"), ("mass", "x_g", "Y_rdot"), ("mass", "y_g")
    inertia = [
        [BalanceTerm(m[0][0], ("u_dot",), ahead), BalanceTerm(m[0][2], ("r_dot",), beside)],
        [BalanceTerm(m[1][1], ("v_dot",), across), BalanceTerm(m[1][2], ("r_dot",), middle)],
        [
            BalanceTerm(m[2][2], ("r_dot",), ("inertia_z", "N_rdot")),
            BalanceTerm(m[1][2], ("v_dot",), middle),
            BalanceTerm(m[0][2], ("u_dot",), beside),
        ],
    ]
    force = [
        [
            BalanceTerm(float(share), (f"T:{thruster.name}",), ())
            for share, thruster in zip(row, vehicle.thrusters, strict=True)
        ]
        for row in thruster_matrix(vehicle)
    ]
    # Minus C(nu) nu, multiplied out.
    force[0] += [BalanceTerm(m[1][1], ("v", "r"), across), BalanceTerm(m[1][2], ("r", "r"), middle)]
    force[1] += [BalanceTerm(-m[0][0], ("u", "r"), ahead), BalanceTerm(-m[0][2], ("r", "r"), beside)]
    force[2] += [
        BalanceTerm(m[0][0] - m[1][1], ("u", "v"), ("X_udot", "Y_vdot")),
        BalanceTerm(-m[1][2], ("u", "r"), middle),
        BalanceTerm(m[0][2], ("v", "r"), beside),
    ]
    for symbol, axis, form in HYDRODYNAMIC:
        if p[symbol]:
            force[axis].append(BalanceTerm(p[symbol], form.factors, (symbol,)))
        if p["fouling_rate"] and PARAMETERS[symbol].section == "damping":
            grown = BalanceTerm(p[symbol] * p["fouling_rate"], (*form.factors, "t"), (symbol, "fouling_rate"))
            force[axis].append(grown)
    for term in vehicle.terms:
        force[AXES.index(term.axis)].append(BalanceTerm(term.value, parse_form(term.form).factors, (term.symbol,)))
    for axis, coefficient, factors, symbol in (
        (0, p["wind_force_north"], ("cos psi",), "wind_force_north"),
        (0, p["wind_force_east"], ("sin psi",), "wind_force_east"),
        (1, -p["wind_force_north"], ("sin psi",), "wind_force_north"),
        (1, p["wind_force_east"], ("cos psi",), "wind_force_east"),
        (0, p["wind_x"], ("u_a", "|V_a|"), "wind_x"),
        (1, p["wind_y"], ("v_a", "|V_a|"), "wind_y"),
        (2, p["wind_n"], ("u_a", "v_a"), "wind_n"),
        (1, -p["memory_sway"], ("q_v",), "memory_sway"),
        (2, -p["memory_yaw"], ("q_r",), "memory_yaw"),
        (0, p["surge_trim"], (), "surge_trim"),
        (1, p["sway_trim"], (), "sway_trim"),
        (2, p["yaw_trim"], (), "yaw_trim"),
    ):
        if coefficient:
            force[axis].append(BalanceTerm(coefficient, factors, (symbol,)))
    found = [
        Balance(axis, _present(left), _present(right)) for axis, left, right in zip(AXES, inertia, force, strict=True)
    ]
    return found[0], found[1], found[2]


def beside_the_balance(vehicle: Vehicle) -> tuple[str, ...]:
    """Symbols that have another value than null and act within a factor: on the thrust, the water, or the memory."""
    shown = {symbol for line in balances(vehicle) for term in (*line.inertia, *line.force) for symbol in term.symbols}
    of_thrusters = {f"{thruster.name}_scale": 1.0 for thruster in vehicle.thrusters}
    nulls = {s: p.null for s, p in PARAMETERS.items() if p.section in ("thrusters", "environment", "memory")}
    nulls = {symbol: null for symbol, null in (nulls | of_thrusters).items() if "{" not in symbol}
    if not vehicle.value("memory_sway") and not vehicle.value("memory_yaw"):
        nulls.pop("memory_time")
    return tuple(s for s, null in nulls.items() if s not in shown and vehicle.value(s) != null)


def _present(terms: list[BalanceTerm]) -> tuple[BalanceTerm, ...]:
    return tuple(term for term in terms if abs(term.coefficient) > NEGLIGIBLE)
