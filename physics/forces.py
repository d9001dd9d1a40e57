"""The force equation along states, evaluated from its one list of terms (`momentum_balance`) for all who ask.

M nu_r_dot = B T + other - C(nu_r) nu_r - D(nu_r) nu_r, with nu_r = nu - R(psi)^T current for a steady irrotational
current (Fossen 2021, section 10.3), wind as a mean earth-fixed force, the force of the apparent wind (section 10.1), a
first-order wake memory and a constant trim.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .effects import PARAMETERS
from .momentum_balance import FORCES, coefficients_by_product, cross_flow_forces, mass_matrix
from .motion import Array, Motion, earth_to_body
from .sampled_series import first_order_lag
from .thrusters import Thruster
from .vehicle import Vehicle, hull_of

Triple = tuple[Array, Array, Array]
CURRENT = ("current_north", "current_east", "current_rate_north", "current_rate_east")
"""Symbols of the current: at the beginning of the log, and how much it changes in a minute."""
_EARTH_FIXED = ("cos psi", "sin psi", "u_a", "v_a", "|V_a|")
"""Factors that turn with the heading."""
_CROSS_FLOW = tuple(name for _, name in FORCES)
"""Forces across a hull of C_d = 1."""


@dataclass(frozen=True, slots=True)
class Actuation:
    """Actuation along a motion: force at rest and its loss per advance speed, (thrusters, n) each."""

    thrust: Array
    load: Array


def actuation(vehicle: Vehicle, motion: Motion) -> Actuation:
    """Thruster forces [N] and advance losses [N s/m] along a motion, with lag, delay, dead zone and scales applied."""
    pairs = [thruster_response(motion, k, thruster) for k, thruster in enumerate(vehicle.thrusters)]
    return Actuation(np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs]))


def thruster_response(motion: Motion, index: int, thruster: Thruster) -> tuple[Array, Array]:
    """Force [N] and advance loss [N s/m] (n,) of a thruster under one command column of a motion and its history.

    Parameters
    ----------
    motion : with commands, and those before it
    index : of the command column
    thruster : that follows it
    """
    commands, past = commands_known(motion, index)
    force, load = thruster.response(commands, motion.time_step)
    force, load = force[past:], load[past:]
    if thruster.thrust_rate == 0.0:
        return force, load
    left = remaining_thrust(thruster, motion.minutes)
    return left * force, left * load


def commands_known(motion: Motion, index: int) -> tuple[Array, int]:
    """One command column of a motion behind its history, and how many rows that has."""
    if motion.run_up is None:
        return motion.commands[:, index], 0
    return np.concatenate([motion.run_up[:, index], motion.commands[:, index]]), motion.run_up.shape[0]


def remaining_thrust(thruster: Thruster, minutes: Array) -> Array:
    """Share of its force that a thruster still has, minutes after a log begins: it wears, or its battery does."""
    return np.maximum(1.0 + thruster.thrust_rate * minutes, 0.0)


def current_at(vehicle: Vehicle, minutes: Array | float = 0.0) -> tuple[Array | float, Array | float] | None:
    """Velocity of the water towards north and east [m/s], minutes after the beginning of the log; None if it stands."""
    p = vehicle.values
    north, east, northwards, eastwards = (p[symbol] for symbol in CURRENT)
    if not (northwards or eastwards):
        return (north, east) if north or east else None
    return north + northwards * minutes, east + eastwards * minutes


def relative_velocity(vehicle: Vehicle, heading: Array, velocity: Triple, minutes: Array | float = 0.0) -> Triple:
    """Velocity relative to the water [m/s, m/s, rad/s], minutes after the beginning of the log.

    Parameters
    ----------
    vehicle : whose water moves
    heading : psi [rad]
    velocity : u, v, r over ground [m/s, m/s, rad/s]
    minutes : since the beginning of the log
    """
    current = current_at(vehicle, minutes)
    if current is None:
        return velocity
    ahead, starboard = earth_to_body(heading, *current)
    return velocity[0] - ahead, velocity[1] - starboard, velocity[2]


def through_water(vehicle: Vehicle, motion: Motion) -> Triple:
    """Velocity relative to the water along a motion [m/s, m/s, rad/s]."""
    u, v, r = motion.velocity.T
    return relative_velocity(vehicle, motion.heading, (u, v, r), motion.minutes)


def apparent_wind(heading: Array, velocity: tuple[Array, Array], air: tuple[Array, Array]) -> tuple[Array, Array]:
    """Velocity of the air relative to the boat, ahead and to starboard [m/s], as an anemometer on board measures it.

    Parameters
    ----------
    velocity : of the boat over ground, ahead and to starboard [m/s]
    air : velocity of the air over ground, towards north and east [m/s]
    """
    ahead, starboard = earth_to_body(heading, *air)
    return ahead - velocity[0], starboard - velocity[1]


def across_hull(vehicle: Vehicle, sway_speed: Any, yaw_rate: Any) -> tuple[Any, Any]:
    """F_Y [N] and F_N [N m] of a vehicle's hull of C_d = 1, see `momentum_balance.cross_flow_forces`.

    Parameters
    ----------
    vehicle : with length and draught [m]
    sway_speed, yaw_rate : relative to the water [m/s, rad/s]

    Raises
    ------
    VehicleError
        when the vehicle file does not state the hull's size.
    """
    hull = hull_of(vehicle)
    return cross_flow_forces(hull.length, hull.draught, sway_speed, yaw_rate)


def memory_states(vehicle: Vehicle, motion: Motion) -> tuple[Array, Array]:
    """The wake memory's filtered sway speed and yaw rate (n,) each along a motion, see `remembered_before`."""
    _, v_r, r = through_water(vehicle, motion)
    sway, yaw = remembered_before(vehicle, motion)
    constant, step = vehicle.values["memory_time"], motion.time_step
    return first_order_lag(v_r, constant, step, sway), first_order_lag(r, constant, step, yaw)


def remembered_before(vehicle: Vehicle, motion: Motion) -> tuple[float, float] | tuple[None, None]:
    """State of the wake memory of sway speed and yaw rate in the first row of a motion, from the rows before it.

    None where there are none: the first state is then taken to have lasted.
    """
    if motion.past is None:
        return None, None
    heading = np.append(motion.past[:, 0], motion.heading[0])
    u, v, r = np.vstack([motion.past[:, 1:], motion.velocity[:1]]).T
    minutes = motion.minutes[0] + motion.time_step / 60.0 * np.arange(-len(motion.past), 1)
    _, v_r, r = relative_velocity(vehicle, heading, (u, v, r), minutes)
    constant, step = vehicle.values["memory_time"], motion.time_step
    return float(first_order_lag(v_r, constant, step)[-1]), float(first_order_lag(r, constant, step)[-1])


class ForceEquation:
    """The force equation of one vehicle, ready to be evaluated many times.

    The summands of `momentum_balance` are brought into one matrix of coefficients and a list of products of signals, so
    that each product is worked out once for all axes. Arrays may be torch tensors: only operators and methods that both
    have act on them.

    Attributes
    ----------
    turns : forces depend on the heading, as current and wind are fixed to the earth
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        self.inverse_mass = np.linalg.inv(mass_matrix(vehicle))
        self._inverse: list[list[float]] = self.inverse_mass.tolist()
        self._beside = vehicle.y_g != 0.0  # else surge stands alone
        self.memory = (vehicle.values["memory_sway"], vehicle.values["memory_yaw"])
        self.has_memory = any(self.memory)
        growing = tuple(vehicle.values[symbol] / 60.0 for symbol in CURRENT[2:])
        self._growing = growing if any(growing) else None
        columns = coefficients_by_product(vehicle)
        self._constant = columns.pop((), [0.0, 0.0, 0.0])
        self._products = tuple(columns)
        self.turns = any(vehicle.values[symbol] for symbol in CURRENT) or any(
            factor in _EARTH_FIXED for factors in columns for factor in factors
        )
        self._lines = [
            [(k, weights[axis]) for k, weights in enumerate(columns.values()) if weights[axis]] for axis in range(3)
        ]

    def force(
        self,
        relative: Triple,
        heading: Array,
        thrust: Array,
        load: Array | None = None,
        memory: tuple[Array, Array] | None = None,
        air: tuple[Array, Array] | None = None,
        minutes: Array | float = 0.0,
    ) -> Triple:
        """Right-hand side tau + other - C nu_r - D nu_r, by axis [N, N, N m].

        Parameters
        ----------
        relative : nu_r, three arrays of one shape [m/s, m/s, rad/s]
        heading : psi, the same shape [rad]
        thrust : (thrusters, *shape) forces at zero advance [N]
        load : (thrusters, *shape) loss of thrust per advance speed [N s/m]
        memory : filtered sway speed and yaw rate of the wake memory; none when None
        air : velocity of the air over ground, towards north and east [m/s]; still when None
        minutes : since the beginning of the log
        """
        signals: dict[str, Any] = dict(zip("uvr", relative, strict=True))
        thrust = thrust if load is None else thrust - load * relative[0]
        signals["t"] = minutes
        signals |= {f"T:{t.name}": push for t, push in zip(self.vehicle.thrusters, thrust, strict=True)}
        if memory is not None:
            signals |= {"q_v": memory[0], "q_r": memory[1]}
        rows: list[Any] = []
        for factors in self._products:
            product = None
            for factor in factors:
                if factor not in signals:
                    signals |= self._signals(factor, relative, heading, air, minutes)
                product = signals[factor] if product is None else product * signals[factor]
            rows.append(product)
        return self._summed(rows, relative[0])

    def _signals(
        self,
        factor: str,
        relative: Triple,
        heading: Array,
        air: tuple[Array, Array] | None,
        minutes: Array | float,
    ) -> dict[str, Any]:
        """A signal that not every vehicle needs, and those that come with it; a wake that nobody tells is none."""
        if factor.startswith("q_"):
            return {"q_v": 0.0 * relative[1], "q_r": 0.0 * relative[2]}
        if factor in _CROSS_FLOW:
            return dict(zip(_CROSS_FLOW, across_hull(self.vehicle, *relative[1:]), strict=True))
        if factor in ("cos psi", "sin psi"):
            ahead, starboard = earth_to_body(heading, 1.0, 0.0)
            return {"cos psi": ahead, "sin psi": -starboard}
        if factor in ("u_a", "v_a", "|V_a|"):
            still = 0.0 * relative[0]
            moving, drifting = earth_to_body(heading, *(current_at(self.vehicle, minutes) or (0.0, 0.0)))
            over_ground = (relative[0] + moving, relative[1] + drifting)
            ahead, starboard = apparent_wind(heading, over_ground, (still, still) if air is None else air)
            return {"u_a": ahead, "v_a": starboard, "|V_a|": (ahead * ahead + starboard * starboard) ** 0.5}
        return {factor: abs(relative["uvr".index(factor[1])])}

    def _summed(self, rows: Sequence[Any], like: Array) -> Triple:
        """Coefficients times products, by axis, in the order of the terms: what cancels on paper cancels to the bit."""
        total: list[Any] = []
        for constant, line in zip(self._constant, self._lines, strict=True):
            sums = constant + 0.0 * like
            for index, weight in line:
                sums = sums + weight * rows[index]
            total.append(sums)
        return total[0], total[1], total[2]

    def acceleration(self, force: Triple, relative: Triple, velocity: Triple, heading: Array) -> Triple:
        """nu_dot over ground from a force: M^-1 force plus the change of the current, d/dt (R^T current).

        Parameters
        ----------
        force : on each axis [N, N, N m]
        relative, velocity : u, v, r relative to the water, and over ground [m/s, m/s, rad/s]
        heading : psi [rad]
        """
        i = self._inverse
        du = i[0][0] * force[0]
        dv = i[1][1] * force[1] + i[1][2] * force[2]
        dr = i[2][1] * force[1] + i[2][2] * force[2]
        if self._beside:
            du = du + (i[0][1] * force[1] + i[0][2] * force[2])
            dv, dr = dv + i[1][0] * force[0], dr + i[2][0] * force[0]
        if relative[0] is not velocity[0]:  # the water moves
            du = du + (velocity[1] - relative[1]) * velocity[2]
            dv = dv - (velocity[0] - relative[0]) * velocity[2]
        if self._growing is not None:
            ahead, starboard = earth_to_body(heading, *self._growing)
            du, dv = du + ahead, dv + starboard
        return du, dv, dr


def modelled_force(vehicle: Vehicle, motion: Motion) -> Array:
    """Right-hand side tau + other - C nu_r - D nu_r along a motion, (n, 3) [N, N, N m]."""
    equation = ForceEquation(vehicle)
    relative = through_water(vehicle, motion)
    act = actuation(vehicle, motion)
    load = act.load if act.load.any() else None
    memory = memory_states(vehicle, motion) if equation.has_memory else None
    air = None if motion.air is None else (motion.air[:, 0], motion.air[:, 1])
    force = equation.force(relative, motion.heading, act.thrust, load, memory, air, motion.minutes)
    return np.stack(force, axis=-1)


def modelled_acceleration(vehicle: Vehicle, motion: Motion) -> Array:
    """Acceleration over ground that the model predicts along a motion, (n, 3) [m/s^2, m/s^2, rad/s^2]."""
    equation = ForceEquation(vehicle)
    relative, force = through_water(vehicle, motion), tuple(modelled_force(vehicle, motion).T)
    return np.stack(equation.acceleration(force, relative, tuple(motion.velocity.T), motion.heading), axis=-1)


def held_acceleration(vehicle: Vehicle, velocity: Array, heading: Array, commands: Array) -> Array:
    """Acceleration over ground (n, 3) in states that have lasted, so that lag, delay and wake memory have settled.

    Parameters
    ----------
    velocity : (n, 3) over ground [m/s, m/s, rad/s]
    heading : (n,) [rad]
    commands : (n, thrusters) in the unit of each thruster; the air is still
    """
    equation = ForceEquation(vehicle)
    over_ground = tuple(np.asarray(velocity, dtype=float).T)
    relative = relative_velocity(vehicle, heading, over_ground)
    thrust, load = held_thrust(vehicle, commands)
    force = equation.force(relative, heading, thrust, load, (relative[1], relative[2]))
    return np.stack(equation.acceleration(force, relative, over_ground, heading), axis=-1)


def held_thrust(vehicle: Vehicle, commands: Array) -> tuple[Array, Array]:
    """Force at rest [N] and loss per advance speed [N s/m] of lasting commands (n, thrusters), (thrusters, n) each."""
    pairs = [t.lasting(np.asarray(commands[:, k], dtype=float)) for k, t in enumerate(vehicle.thrusters)]
    return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])


def calm(vehicle: Vehicle) -> Vehicle:
    """The vehicle without current, wind and trim."""
    stated = {p.symbol: p.null for p in PARAMETERS.values() if p.section == "environment"}
    return vehicle.with_values({symbol: null for symbol, null in stated.items() if vehicle.value(symbol) != null})


def at_beginning(vehicle: Vehicle) -> Vehicle:
    """The vehicle as it is when a log begins: without what changes by the minute."""
    rates = {p.symbol: p.null for p in PARAMETERS.values() if p.unit.endswith("/min")}
    return vehicle.with_values({symbol: null for symbol, null in rates.items() if vehicle.value(symbol) != null})


def stated_push(
    vehicle: Vehicle,
    heading: Array,
    relative: Triple,
    air: tuple[Array, Array] | None = None,
    minutes: Array | float = 0.0,
) -> Array:
    """Force (n, 3) [N, N, N m] of the wind and the trim that the vehicle file states.

    Parameters
    ----------
    vehicle : with wind and trim
    heading : psi [rad]
    relative : velocity relative to the water [m/s, m/s, rad/s]
    air : velocity of the air over ground, north and east [m/s]; None where no log tells of it
    minutes : since the beginning of the log
    """
    idle = np.zeros((len(vehicle.thrusters), np.asarray(heading).size))
    pair = [ForceEquation(v).force(relative, heading, idle, air=air, minutes=minutes) for v in (vehicle, calm(vehicle))]
    return np.stack([a - b + np.zeros_like(heading) for a, b in zip(*pair, strict=True)], axis=-1)
