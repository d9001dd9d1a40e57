"""The momentum balance of a vehicle term by term: what `forces.py` evaluates, and what a reader is shown."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from .cross_flow import FORCES
from .effects import PARAMETERS
from .frames import AXES, Array
from .matrices import HYDRODYNAMIC, mass_rows, push_of
from .stated_values import values_of
from .terms import parse_form
from .vehicle import Vehicle, hull_of

NEGLIGIBLE = 1e-12
"""Coefficient that is what rounding leaves of nothing, in SI units: its term is not written."""

_AHEAD, _ACROSS, _MIDDLE, _BESIDE = ("mass", "X_udot"), ("mass", "Y_vdot"), ("mass", "x_g", "Y_rdot"), ("mass", "y_g")
"""What the entries of the mass matrix are made of."""
AROUND: tuple[tuple[int, float, tuple[str, ...], str], ...] = (
    (0, 1.0, ("cos psi",), "wind_force_north"),
    (0, 1.0, ("sin psi",), "wind_force_east"),
    (1, -1.0, ("sin psi",), "wind_force_north"),
    (1, 1.0, ("cos psi",), "wind_force_east"),
    (0, 1.0, ("u_a", "|V_a|"), "wind_x"),
    (1, 1.0, ("v_a", "|V_a|"), "wind_y"),
    (2, 1.0, ("u_a", "v_a"), "wind_n"),
    (1, -1.0, ("q_v",), "memory_sway"),
    (2, -1.0, ("q_r",), "memory_yaw"),
    (0, 1.0, (), "surge_trim"),
    (1, 1.0, (), "sway_trim"),
    (2, 1.0, (), "yaw_trim"),
)
"""Axis, sign, factors and symbol of what the air, the wake and a trim do."""


class BalanceTerm(NamedTuple):
    """One summand: `coefficient` times the product of `factors`, made of the parameters `symbols`.

    A factor is `u v r` (relative to the water) or a modulus such as `|u|`, a derivative `u_dot`, the force of a
    thruster `T:port`, `cos psi` or `sin psi`, the time `t` since the beginning of the log [min], the apparent
    wind `u_a v_a |V_a|`, a filtered velocity `q_v q_r` of the wake memory, or the force `F_Y F_N` across a hull whose
    drag coefficient is one (see `cross_flow`).
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

    Raises
    ------
    VehicleError
        for cross-flow drag of a hull whose size the vehicle file does not state.
    """
    if vehicle.values["cross_flow"]:
        hull_of(vehicle)
    m = mass_rows(vehicle)
    inertia = [
        [BalanceTerm(m[0][0], ("u_dot",), _AHEAD), BalanceTerm(m[0][2], ("r_dot",), _BESIDE)],
        [BalanceTerm(m[1][1], ("v_dot",), _ACROSS), BalanceTerm(m[1][2], ("r_dot",), _MIDDLE)],
        [
            BalanceTerm(m[2][2], ("r_dot",), ("inertia_z", "N_rdot")),
            BalanceTerm(m[1][2], ("v_dot",), _MIDDLE),
            BalanceTerm(m[0][2], ("u_dot",), _BESIDE),
        ],
    ]
    pushes = [(f"T:{thruster.name}", push_of(thruster)) for thruster in vehicle.thrusters]
    force = [[BalanceTerm(push[axis], (name,), ()) for name, push in pushes] for axis in range(3)]
    # Minus C(nu) nu, multiplied out.
    force[0] += [BalanceTerm(m[1][1], ("v", "r"), _ACROSS), BalanceTerm(m[1][2], ("r", "r"), _MIDDLE)]
    force[1] += [BalanceTerm(-m[0][0], ("u", "r"), _AHEAD), BalanceTerm(-m[0][2], ("r", "r"), _BESIDE)]
    force[2] += [
        BalanceTerm(m[0][0] - m[1][1], ("u", "v"), ("X_udot", "Y_vdot")),
        BalanceTerm(-m[1][2], ("u", "r"), _MIDDLE),
        BalanceTerm(m[0][2], ("v", "r"), _BESIDE),
    ]
    for line, added in zip(force, _added(vehicle), strict=True):
        line += added
    found = [
        Balance(axis, _present(left), _present(right)) for axis, left, right in zip(AXES, inertia, force, strict=True)
    ]
    return found[0], found[1], found[2]


def _added(vehicle: Vehicle) -> list[list[BalanceTerm]]:
    """Damping, coupling, terms without a name, wind, wake and trim, by axis."""
    p = vehicle.values
    force: list[list[BalanceTerm]] = [[], [], []]
    fouling = p["fouling_rate"]
    for symbol, axis, form in HYDRODYNAMIC:
        value = p[symbol]
        if not value:
            continue
        force[axis].append(BalanceTerm(value, form.factors, (symbol,)))
        if fouling and PARAMETERS[symbol].section == "damping":
            grown = BalanceTerm(value * fouling, (*form.factors, "t"), (symbol, "fouling_rate"))
            force[axis].append(grown)
    for axis, name in FORCES if p["cross_flow"] else ():
        force[axis].append(BalanceTerm(-p["cross_flow"], (name,), ("cross_flow",)))
        if fouling:
            grown = BalanceTerm(-p["cross_flow"] * fouling, (name, "t"), ("cross_flow", "fouling_rate"))
            force[axis].append(grown)
    for term in vehicle.terms:
        force[AXES.index(term.axis)].append(BalanceTerm(term.value, parse_form(term.form).factors, (term.symbol,)))
    for axis, sign, factors, symbol in AROUND:
        value = p[symbol]
        if value:
            force[axis].append(BalanceTerm(sign * value, factors, (symbol,)))
    return force


def beside_the_balance(vehicle: Vehicle) -> tuple[str, ...]:
    """Symbols that have another value than null and act within a factor: on the thrust, the water, or the memory.

    Of what every thruster has, it is enough that one of them has another value.
    """
    shown = {symbol for line in balances(vehicle) for term in (*line.inertia, *line.force) for symbol in term.symbols}
    of_thrusters = {f"{thruster.name}_scale": 1.0 for thruster in vehicle.thrusters}
    nulls = {s: p.null for s, p in PARAMETERS.items() if p.section in ("thrusters", "environment", "memory")}
    nulls = {symbol: null for symbol, null in (nulls | of_thrusters).items() if "{" not in symbol}
    if not vehicle.value("memory_sway") and not vehicle.value("memory_yaw"):
        nulls.pop("memory_time")
    return tuple(s for s, null in nulls.items() if s not in shown and values_of(vehicle, s) != (null,))


def _present(terms: list[BalanceTerm]) -> tuple[BalanceTerm, ...]:
    return tuple([term for term in terms if abs(term.coefficient) > NEGLIGIBLE])
