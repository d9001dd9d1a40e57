"""The force equation, written once: discovery, simulation, reports and exports all call this.

M nu_r_dot = B T + other - C(nu_r) nu_r - D(nu_r) nu_r, with nu_r = nu - R(psi)^T current for a steady irrotational
current (Fossen 2021, section 10.3), wind as a mean earth-fixed force, the force of the apparent wind (section 10.1), a
first-order wake memory and a constant trim.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .effects import PARAMETERS
from .frames import Array, earth_to_body
from .matrices import active_terms, mass_matrix, thruster_matrix
from .motion import Motion
from .thrusters import first_order_lag
from .vehicle import Vehicle

Triple = tuple[Array, Array, Array]


@dataclass(frozen=True, slots=True)
class Actuation:
    """What the thrusters do along a motion: force at rest and its loss per advance speed, (thrusters, n) each."""

    thrust: Array
    load: Array


def actuation(vehicle: Vehicle, motion: Motion) -> Actuation:
    """Thruster forces [N] and advance losses [N s/m] along a motion, with lag, delay, dead zone and scales applied."""
    commands, past = motion.commands, 0
    if motion.run_up is not None:
        commands, past = np.concatenate([motion.run_up, commands]), motion.run_up.shape[0]
    pairs = [thruster.response(commands[:, k], motion.time_step) for k, thruster in enumerate(vehicle.thrusters)]
    return Actuation(np.array([p[0][past:] for p in pairs]), np.array([p[1][past:] for p in pairs]))


def relative_velocity(vehicle: Vehicle, heading: Array, velocity: Triple) -> Triple:
    """Velocity relative to the water [m/s, m/s, rad/s]."""
    p = vehicle.values
    if p["current_north"] == 0.0 and p["current_east"] == 0.0:
        return velocity
    ahead, starboard = earth_to_body(heading, p["current_north"], p["current_east"])
    return velocity[0] - ahead, velocity[1] - starboard, velocity[2]


def apparent_wind(heading: Array, velocity: tuple[Array, Array], air: tuple[Array, Array]) -> tuple[Array, Array]:
    """Velocity of the air relative to the boat, ahead and to starboard [m/s], as an anemometer on board measures it.

    Parameters
    ----------
    velocity : of the boat over ground, ahead and to starboard [m/s]
    air : velocity of the air over ground, towards north and east [m/s]
    """
    ahead, starboard = earth_to_body(heading, *air)
    return ahead - velocity[0], starboard - velocity[1]


def memory_states(vehicle: Vehicle, motion: Motion) -> tuple[Array, Array]:
    """The wake memory's filtered sway speed and yaw rate (n,) each along a motion, at rest in its start value."""
    u_r, v_r, r = relative_velocity(vehicle, motion.heading, tuple(motion.velocity.T))
    del u_r
    constant = vehicle.values["memory_time"]
    return first_order_lag(v_r, constant, motion.time_step), first_order_lag(r, constant, motion.time_step)


class ForceEquation:
    """The force equation of one vehicle, ready to be evaluated many times.

    Everything that does not change from call to call (matrices, active terms) is worked out once. Arrays may be torch
    tensors: only operators and methods that both have act on them.
    """

    __slots__ = (
        "_effective",
        "_inverse",
        "_mass",
        "_terms",
        "_trim",
        "_windage",
        "has_memory",
        "inverse_mass",
        "memory",
        "vehicle",
    )

    def __init__(self, vehicle: Vehicle) -> None:
        p = vehicle.values
        self.vehicle = vehicle
        mass = mass_matrix(vehicle)
        self._mass: list[list[float]] = mass.tolist()
        self.inverse_mass = np.linalg.inv(mass)
        self._inverse: list[list[float]] = self.inverse_mass.tolist()
        self._terms = active_terms(vehicle)
        self._effective: list[list[float]] = thruster_matrix(vehicle).tolist()
        self._trim = p["yaw_trim"]
        self._windage = (p["wind_x"], p["wind_y"], p["wind_n"])
        self.memory = (p["memory_sway"], p["memory_yaw"])
        self.has_memory = any(self.memory)

    def force(
        self,
        relative: Triple,
        heading: Array,
        thrust: Array,
        load: Array | None = None,
        memory: tuple[Array, Array] | None = None,
        air: tuple[Array, Array] | None = None,
    ) -> Triple:
        """Right-hand side tau + other - C nu_r - D nu_r, by axis [N, N, N m].

        Parameters
        ----------
        relative : nu_r, three arrays of one shape [m/s, m/s, rad/s]
        heading : psi, the same shape [rad]
        thrust : (thrusters, *shape) forces at zero advance [N]
        load : (thrusters, *shape) loss of thrust per advance speed [N s/m]
        memory : filtered sway speed and yaw rate of the wake memory
        air : velocity of the air over ground, towards north and east [m/s]; still when None
        """
        u, v, r = relative
        if load is not None:
            thrust = thrust - load * u
        m = self._mass
        total: list[Any] = [
            sum(share * push for share, push in zip(row, thrust, strict=True)) for row in self._effective
        ]
        c13, c23 = -(m[1][1] * v + m[1][2] * r), m[0][0] * u
        total[0] = total[0] - c13 * r
        total[1] = total[1] - c23 * r
        total[2] = total[2] + c13 * u + c23 * v + self._trim
        for value, axis, form in self._terms:
            total[axis] = total[axis] + value * form(u, v, r)
        p = self.vehicle.values
        if p["wind_force_north"] or p["wind_force_east"]:
            ahead, starboard = earth_to_body(heading, p["wind_force_north"], p["wind_force_east"])
            total[0], total[1] = total[0] + ahead, total[1] + starboard
        if any(self._windage):
            still = 0.0 * u
            moving, drifting = earth_to_body(heading, p["current_north"], p["current_east"])
            over_ground = (u + moving, v + drifting)
            ahead, starboard = apparent_wind(heading, over_ground, (still, still) if air is None else air)
            speed = (ahead * ahead + starboard * starboard) ** 0.5
            total[0] = total[0] + self._windage[0] * ahead * speed
            total[1] = total[1] + self._windage[1] * starboard * speed
            total[2] = total[2] + self._windage[2] * ahead * starboard
        if self.has_memory and memory is not None:
            total[1] = total[1] - self.memory[0] * memory[0]
            total[2] = total[2] - self.memory[1] * memory[1]
        return total[0], total[1], total[2]

    def acceleration(self, force: Triple, relative: Triple, velocity: Triple) -> Triple:
        """nu_dot over ground from a force: M^-1 force plus the turning of the current, d/dt (R^T current)."""
        i = self._inverse
        turn_u, turn_v = velocity[1] - relative[1], -(velocity[0] - relative[0])
        du = i[0][0] * force[0] + turn_u * velocity[2]
        dv = i[1][1] * force[1] + i[1][2] * force[2] + turn_v * velocity[2]
        dr = i[2][1] * force[1] + i[2][2] * force[2]
        return du, dv, dr


def modelled_force(vehicle: Vehicle, motion: Motion) -> Array:
    """Right-hand side tau + other - C nu_r - D nu_r along a motion, (n, 3) [N, N, N m]."""
    equation = ForceEquation(vehicle)
    relative = relative_velocity(vehicle, motion.heading, tuple(motion.velocity.T))
    act = actuation(vehicle, motion)
    load = act.load if act.load.any() else None
    memory = memory_states(vehicle, motion) if equation.has_memory else None
    air = None if motion.air is None else (motion.air[:, 0], motion.air[:, 1])
    return np.stack(equation.force(relative, motion.heading, act.thrust, load, memory, air), axis=-1)


def modelled_acceleration(vehicle: Vehicle, motion: Motion) -> Array:
    """Acceleration over ground that the model predicts along a motion, (n, 3) [m/s^2, m/s^2, rad/s^2]."""
    equation = ForceEquation(vehicle)
    velocity = tuple(motion.velocity.T)
    relative = relative_velocity(vehicle, motion.heading, velocity)
    force = tuple(modelled_force(vehicle, motion).T)
    return np.stack(equation.acceleration(force, relative, velocity), axis=-1)


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
    return np.stack(equation.acceleration(force, relative, over_ground), axis=-1)


def held_thrust(vehicle: Vehicle, commands: Array) -> tuple[Array, Array]:
    """Force at rest [N] and loss per advance speed [N s/m] of lasting commands (n, thrusters), (thrusters, n) each."""
    settled = [t.model_copy(update={"lag": 0.0, "delay": 0.0}) for t in vehicle.thrusters]
    pairs = [t.response(np.asarray(commands[:, k], dtype=float), 1.0) for k, t in enumerate(settled)]
    return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])


def calm(vehicle: Vehicle) -> Vehicle:
    """The vehicle without current, wind and trim."""
    stated = {p.symbol: p.null for p in PARAMETERS.values() if p.section == "environment"}
    return vehicle.with_values({symbol: null for symbol, null in stated.items() if vehicle.value(symbol) != null})


def stated_push(vehicle: Vehicle, heading: Array, relative: Triple, air: tuple[Array, Array] | None = None) -> Array:
    """Force (n, 3) [N, N, N m] of the wind and the trim that the vehicle file states."""
    idle = np.zeros((len(vehicle.thrusters), np.asarray(heading).size))
    pair = [ForceEquation(v).force(relative, heading, idle, air=air) for v in (vehicle, calm(vehicle))]
    return np.stack([a - b + np.zeros_like(heading) for a, b in zip(*pair, strict=True)], axis=-1)
