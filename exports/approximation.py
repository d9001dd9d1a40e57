"""Approximation of a model by a simpler format: the force that goes missing [N], effect by effect, and steady runs.

Throttle and steering are those of autopilots: sum and difference of the shares of full command at both sides.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..physics.effects import EFFECTS, PARAMETERS
from ..physics.errors import RequestError
from ..physics.forces import (
    ForceEquation,
    at_beginning,
    calm,
    current_at,
    held_thrust,
    relative_velocity,
    remaining_thrust,
)
from ..physics.integration import Legs, rollouts
from ..physics.laws.damping_power import Envelope
from ..physics.momentum_balance import push_of, stated, values_of
from ..physics.motion import AXES, FORCE_UNITS, Array, Motion, earth_to_body
from ..physics.presentation import listing
from ..physics.thrusters import Thruster, command_of
from ..physics.vehicle import Vehicle
from .program.vectors import commands_of

_STATES = 2000
"""States in which forces are compared: enough for a mean square that two seeds agree on within some per cent."""
_WIND, _MINUTES = 5.0, 10.0
"""Speed of the air [m/s] and time since the beginning of a log [min] that forces of wind and ageing are told for."""
_NOTHING = 1e-9
"""Share of the largest force below which a difference is rounding."""


def missing_forces(vehicle: Vehicle, envelope: Envelope, instead: Mapping[str, float]) -> list[str]:
    """A sentence for each effect that has other values in a format, with the force that is missing.

    Parameters
    ----------
    instead : by symbol, the value that the format has in the place of the vehicle's
    """
    sentences, rest = [], {s: x for s, x in instead.items() if any(own != x for own in values_of(vehicle, s))}
    for effect in EFFECTS:
        own = {f"{t.name}_scale" for t in vehicle.thrusters} if effect.per_thruster else set(effect.symbols)
        moved = {symbol: rest.pop(symbol) for symbol in list(rest) if symbol in own}
        if moved:
            sentences.append(_sentence(effect.name, vehicle, envelope, moved))
    return sentences + [_sentence(symbol, vehicle, envelope, {symbol: value}) for symbol, value in rest.items()]


def _sentence(name: str, vehicle: Vehicle, envelope: Envelope, moved: Mapping[str, float]) -> str:
    values = ", ".join(stated(vehicle, symbol, 4) for symbol in moved)
    begin = f"{name} ({values})"
    if set(moved) <= {"lag", "delay"}:
        full = total_thrust(t for t in vehicle.thrusters if any(getattr(t, s) for s in moved))
        return f"{begin}: thrust is early, by up to {full:.3g} N after a step from rest to full command."
    when = f" in {_WIND:g} m/s of wind" * any(s.startswith("wind_") and len(s) == 6 for s in moved)
    when += f" after {_MINUTES:g} minutes" * any(vehicle.parameter(symbol).unit.endswith("/min") for symbol in moved)
    return f"{begin}{when}: {difference(vehicle, vehicle.with_values(moved), envelope)}"


def difference(one: Vehicle, other: Vehicle, envelope: Envelope, what: str = "the missing force") -> str:
    """How much the forces of two vehicles differ in the same motions over ground, in words.

    Parameters
    ----------
    what : name of the difference
    """
    told = []
    for axis, unit, x, y in zip(AXES, FORCE_UNITS, *_forces((one, other), envelope), strict=True):
        most = np.abs(x - y).max()
        if most > _NOTHING * max(np.abs(x).max(), 1.0):
            told.append(f"{axis} {np.sqrt(np.mean((x - y) ** 2)):.3g} {unit} (up to {most:.3g})")
    if not told:
        return "no force within the envelope."
    return f"{what}, root mean square over the envelope, is {listing(told)}."


def _forces(vehicles: Sequence[Vehicle], envelope: Envelope) -> list[Array]:
    """Forces by axis (3, n) of each vehicle, in a breeze and some minutes after the start.

    States, and commands that have lasted, are drawn within an envelope in the water of the first.
    """
    rng = np.random.default_rng(7)
    velocity = rng.uniform(envelope.lower, envelope.upper, (_STATES, 3)).T
    heading, direction = rng.uniform(-np.pi, np.pi, (2, _STATES))
    flow = current_at(vehicles[0], _MINUTES)
    if flow is not None:
        velocity[:2] += earth_to_body(heading, *flow)
    share = rng.uniform(-1.0, 1.0, (_STATES, len(vehicles[0].thrusters)))
    air = (_WIND * np.cos(direction), _WIND * np.sin(direction))
    found = []
    for vehicle in vehicles:
        u, v, r = relative_velocity(vehicle, heading, tuple(velocity), _MINUTES)
        thrust, load = held_thrust(vehicle, commands_of(vehicle, share))
        left = np.array([remaining_thrust(t, np.full(_STATES, _MINUTES)) for t in vehicle.thrusters])
        equation = ForceEquation(vehicle)
        found.append(np.array(equation.force((u, v, r), heading, left * thrust, left * load, (v, r), air, _MINUTES)))
    return found


def total_thrust(thrusters: Iterable[Thruster]) -> float:
    """Sum of the sizes of the forces [N] of thrusters at full command."""
    return float(sum(abs(t.lasting(command_of(t, np.ones(1)))[0][0]) for t in thrusters))


_SETTLING, _STEP = 120.0, 0.05
"""Time after which a boat runs steadily, and step of the simulation [s]: five times the slowest hull of the shipped."""
Commanded = Callable[[Thruster, Array], Array]


@dataclass(frozen=True, slots=True)
class Sides:
    """A boat with one thruster at each side; places of both among its thrusters."""

    vehicle: Vehicle
    port: int
    starboard: int

    def steady(self, left: Array, right: Array, commanded: Commanded = command_of) -> Array:
        """Velocities (n, 3) after two minutes of commands, shares of full command at both sides (n,) each.

        `commanded` makes commands of a thruster from shares.
        """
        vehicle = calm(at_beginning(self.vehicle))
        rows, names = round(_SETTLING / _STEP) + 1, tuple(t.name for t in vehicle.thrusters)
        commands = np.zeros((len(left), len(names)))
        for k, share in ((self.port, left), (self.starboard, right)):
            commands[:, k] = commanded(vehicle.thrusters[k], share)
        motions = (Motion.at_rest(_STEP, np.tile(held, (rows, 1)), names) for held in commands)
        legs = [(vehicle, Legs(motion, np.array([0]), rows - 1)) for motion in motions]
        return np.array([found.states[0, -1, 1:] for found in rollouts(legs, placed=False)])

    def thrusters(self) -> tuple[Thruster, Thruster]:
        """That at port and that at starboard."""
        return self.vehicle.thrusters[self.port], self.vehicle.thrusters[self.starboard]


def missing_surroundings(vehicle: Vehicle, envelope: Envelope, written: Collection[str] = ()) -> list[str]:
    """A sentence for all that surrounds a vehicle or changes by the minute, but for symbols that are written."""
    around = (p for p in PARAMETERS.values() if p.section == "environment" or p.unit.endswith("/min"))
    return missing_forces(vehicle, envelope, {p.symbol: p.null for p in around if p.symbol not in written})


def sides_of(vehicle: Vehicle, to: str) -> Sides:
    """The thrusters of a boat at both sides.

    Raises
    ------
    RequestError
        when it has not one thruster to port and one to starboard that push ahead.
    """
    pushes = [push_of(thruster) for thruster in vehicle.thrusters]
    port = [k for k, (ahead, _, turn) in enumerate(pushes) if ahead > 0.5 and turn > 0.0]
    starboard = [k for k, (ahead, _, turn) in enumerate(pushes) if ahead > 0.5 and turn < 0.0]
    if len(vehicle.thrusters) != 2 or len(port) != 1 or len(starboard) != 1:
        text = ", ".join(f"{t.name} at y = {t.y:g} m" for t in vehicle.thrusters)
        raise RequestError(
            f"export --to {to}: expected one thruster at port and one at starboard that push ahead, got {text}; the "
            f"parameters of {to} that steer by thrust are for such boats"
        )
    return Sides(vehicle, port[0], starboard[0])
