"""The momentum balance of a vehicle, term by term: M, C and D in Fossen's parametrisation, and cross-flow drag.

`forces.py` evaluates these terms, and a reader is shown them. A parameter has one value for all thrusters, or each
thruster its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .effects import PARAMETERS, Form, parse_form
from .motion import AXES, Array
from .thrusters import Thruster
from .vehicle import SHARED_THRUSTER_KEYS, Vehicle, hull_of


def values_of(vehicle: Vehicle, symbol: str) -> tuple[float, ...]:
    """The value of a parameter, or those of all thrusters where each has its own and they differ.

    Raises
    ------
    VehicleError
        for a symbol that no parameter or term of this vehicle bears.
    """
    if symbol not in SHARED_THRUSTER_KEYS:
        return (vehicle.value(symbol),)
    own = tuple(getattr(thruster, symbol) for thruster in vehicle.thrusters)
    return own if len(set(own)) > 1 else own[:1]


def amount(vehicle: Vehicle, symbol: str, digits: int, unit: str = "") -> str:
    """The value of a parameter in words, with the names of thrusters where they differ in it.

    Parameters
    ----------
    vehicle : whose parameter it is
    symbol : of the parameter
    digits : significant digits
    unit : in words
    """
    behind = "" if unit in ("1", "-") else unit
    own = [f"{value:.{digits}g} {behind}".rstrip() for value in values_of(vehicle, symbol)]
    if len(own) == 1:
        return own[0]
    return ", ".join(f"{x} ({t.name})" for x, t in zip(own, vehicle.thrusters, strict=True))


def stated(vehicle: Vehicle, symbol: str, digits: int, unit: str = "") -> str:
    """A parameter and its value in words, see `amount`."""
    return f"{symbol} = {amount(vehicle, symbol, digits, unit)}"


STRIPS = 20
"""Strips of the hull; an even number, so that they come in pairs about the origin."""
DENSITY = 1025.0
"""Of the water [kg/m^3]: sea water at 15 degrees (Fossen 2021). In fresh water C_d comes out 2.4 % too small."""
SHARES: tuple[float, ...] = tuple((k + 0.5) / STRIPS for k in range(STRIPS // 2))
"""Places of the strips ahead of the origin, as shares of the length; those abaft lie as far behind it."""
FORCES: tuple[tuple[int, str], ...] = ((1, "F_Y"), (2, "F_N"))
"""Axis and name of the forces that a hull of C_d = 1 resists with, as the momentum balance has them [N, N m]."""


def pressure_width(length: Any, draught: Any) -> Any:
    """1/2 rho T dx [kg/m]: what a strip of C_d = 1 makes of |w| w."""
    return 0.5 * DENSITY * draught * length / STRIPS


def pair_forces(place: Any, sway_speed: Any, yaw_rate: Any) -> tuple[Any, Any]:
    """|w| w of the strips at plus and minus a place [m], summed, and its moment; all of them broadcast.

    In pairs what cancels on paper cancels to the bit: pure sway turns no hull, pure yaw pushes none aside.

    Parameters
    ----------
    place : of the strips ahead of and behind the middle [m]
    sway_speed, yaw_rate : relative to the water [m/s, rad/s]
    """
    turning = place * yaw_rate
    ahead, abaft = sway_speed + turning, sway_speed - turning
    ahead, abaft = abs(ahead) * ahead, abs(abaft) * abaft
    return ahead + abaft, place * (ahead - abaft)


def cross_flow_forces(length: float, draught: float, sway_speed: Any, yaw_rate: Any) -> tuple[Any, Any]:
    """F_Y [N] and F_N [N m]: what a hull of C_d = 1 resists with.

    Strip theory (Fossen 2021, eq. 6.91 ff.; Faltinsen, *Sea Loads on Ships and Offshore Structures*, 1990, chapter 6):
    each section of the hull is dragged like a cylinder across the flow by its own sway speed w(x) = v_r + x r,

        Y = -1/2 rho C_d T integral |w| w dx,    N = -1/2 rho C_d T integral x |w| w dx,    |x| <= L / 2.

    The integral is a sum over twenty strips, each at its middle, everywhere: in simulation, columns and exports. In
    pure sway it is exact, Y = -1/2 rho C_d T L v |v|; in pure yaw N = -1/2 rho C_d T r |r| L^4 / 32 comes out half a
    per cent too small. The power v Y + r N = -1/2 rho C_d T sum |w|^3 dx is never positive for C_d >= 0, as D is a sum
    of |w| dx [0, 1, x]^T [0, 1, x], positive semidefinite.

    Parameters
    ----------
    length, draught : of the hull [m]
    sway_speed, yaw_rate : relative to the water [m/s, rad/s], of one shape; arrays, tensors or symbols
    """
    force, moment = 0.0 * sway_speed, 0.0 * yaw_rate
    for share in SHARES:
        both, turned = pair_forces(share * length, sway_speed, yaw_rate)
        force, moment = force + both, moment + turned
    width = pressure_width(length, draught)
    return width * force, width * moment


def cross_flow_matrix(length: float, draught: float, sway_speed: Array, yaw_rate: Array) -> Array:
    """D (..., 3, 3) of C_d = 1, with D nu_r = (0, F_Y, F_N); positive semidefinite at every state.

    Parameters
    ----------
    length, draught : of the hull [m]
    sway_speed, yaw_rate : relative to the water (...) [m/s, rad/s]
    """
    shares = np.array(SHARES)
    place = length * np.concatenate([-shares[::-1], shares])
    crossing = np.abs(np.asarray(sway_speed)[..., None] + place * np.asarray(yaw_rate)[..., None])
    arms = np.stack([0.0 * place, 1.0 + 0.0 * place, place])
    return pressure_width(length, draught) * np.einsum("...s,is,js->...ij", crossing, arms, arms)


def power_bounds(length: float, draught: float, middle: Array, half: Array) -> tuple[Array, Array]:
    """Least and most power [W] that C_d = 1 takes out of a hull in boxes of velocities, (k,) each.

    Parameters
    ----------
    middle, half : (k, 3) middles and half sides of the boxes [m/s, m/s, rad/s]
    """
    shares = np.array(SHARES)
    place = length * np.concatenate([-shares, shares])
    speed = np.abs(middle[:, 1:2] + place * middle[:, 2:])
    spread = half[:, 1:2] + np.abs(place) * half[:, 2:]
    width = pressure_width(length, draught)
    least = width * (np.maximum(speed - spread, 0.0) ** 3).sum(axis=1)
    return least, width * ((speed + spread) ** 3).sum(axis=1)


HYDRODYNAMIC: tuple[tuple[str, int, Form], ...] = tuple(
    (p.symbol, p.axis, parse_form(p.form)) for p in PARAMETERS.values() if p.axis is not None and p.form
)
"""(symbol, axis, monomial) of every damping and coupling parameter of the catalogue."""


def active_terms(vehicle: Vehicle) -> list[tuple[float, int, Form]]:
    """(value, axis, monomial) of every hydrodynamic monomial that is not zero, unnamed ones included.

    Cross-flow drag is none of them.
    """
    return [(value, axis, form) for value, axis, form in terms_by_symbol(vehicle).values() if value != 0.0]


def terms_by_symbol(vehicle: Vehicle) -> dict[str, tuple[float, int, Form]]:
    """Value, axis and monomial of every hydrodynamic parameter and unnamed term, those that are zero among them."""
    values = vehicle.values
    named = {symbol: (values[symbol], axis, form) for symbol, axis, form in HYDRODYNAMIC}
    return named | {t.symbol: (t.value, AXES.index(t.axis), parse_form(t.form)) for t in vehicle.terms}


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
    """Column of B of a thruster: force ahead, to starboard and moment in yaw of a newton [N, N, N m]."""
    ahead, aside, arm = thruster.push
    return ahead, aside, thruster.arm_scale * arm


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


def balances(vehicle: Vehicle) -> tuple[Balance, ...]:
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
    return tuple(Balance(axis, _present(i), _present(f)) for axis, i, f in zip(AXES, inertia, force, strict=True))


def coefficients_by_product(vehicle: Vehicle) -> dict[tuple[str, ...], list[float]]:
    """Coefficient on each axis [N, N, N m] of each product of factors, which are sorted, in the order of the terms."""
    result: dict[tuple[str, ...], list[float]] = {}
    for axis, line in enumerate(balances(vehicle)):
        for term in line.force:
            result.setdefault(tuple(sorted(term.factors)), [0.0, 0.0, 0.0])[axis] += term.coefficient
    return result


def _added(vehicle: Vehicle) -> list[list[BalanceTerm]]:
    """Damping, coupling, terms without a name, wind, wake and trim, by axis."""
    p = vehicle.values
    force: list[list[BalanceTerm]] = [[], [], []]

    def add(axis: int, value: float, factors: tuple[str, ...], symbol: str, *, damping: bool) -> None:
        force[axis].append(BalanceTerm(value, factors, (symbol,)))
        if damping and p["fouling_rate"]:
            grown = (symbol, "fouling_rate")
            force[axis].append(BalanceTerm(value * p["fouling_rate"], (*factors, "t"), grown))

    for symbol, axis, form in HYDRODYNAMIC:
        if p[symbol]:
            add(axis, p[symbol], form.factors, symbol, damping=PARAMETERS[symbol].section == "damping")
    for axis, name in FORCES if p["cross_flow"] else ():
        add(axis, -p["cross_flow"], (name,), "cross_flow", damping=True)
    for term in vehicle.terms:
        force[AXES.index(term.axis)].append(BalanceTerm(term.value, parse_form(term.form).factors, (term.symbol,)))
    for axis, sign, factors, symbol in AROUND:
        if p[symbol]:
            force[axis].append(BalanceTerm(sign * p[symbol], factors, (symbol,)))
    return force


def factor_symbols(vehicle: Vehicle) -> tuple[str, ...]:
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
