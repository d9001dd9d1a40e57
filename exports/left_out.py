"""What a format cannot say, told in newtons: how much force goes missing over the envelope, effect by effect."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..physics.effects import EFFECTS
from ..physics.forces import ForceEquation, current_at, held_thrust, relative_velocity, thrust_left
from ..physics.frames import AXES, FORCE_UNITS, Array, earth_to_body
from ..physics.in_words import listing
from ..physics.laws.damping_power import Envelope
from ..physics.stated_values import stated, values_of
from ..physics.thrusters import Thruster, command_of
from ..physics.vehicle import Vehicle
from .program.vectors import commands_of

_STATES = 2000
"""States in which forces are compared: enough for a mean square that two seeds agree on within some per cent."""
_WIND, _MINUTES = 5.0, 10.0
"""Speed of the air [m/s] and time since the beginning of a log [min] that forces of wind and ageing are told for."""
_NOTHING = 1e-9
"""Share of the largest force below which a difference is rounding."""


def told(vehicle: Vehicle, envelope: Envelope, instead: Mapping[str, float]) -> list[str]:
    """A sentence for each effect that has other values in a format, with the force that is missing.

    Parameters
    ----------
    instead : by symbol, the value that the format has in the place of the vehicle's
    """
    sentences, rest = [], {s: x for s, x in instead.items() if any(own != x for own in values_of(vehicle, s))}
    for effect in EFFECTS:
        own = {f"{t.name}_scale" for t in vehicle.thrusters} if effect.per_thruster else set(effect.symbols)
        moved = {symbol: rest.pop(symbol) for symbol in [s for s in rest if s in own]}
        if moved:
            sentences.append(_sentence(effect.name, vehicle, envelope, moved))
    return sentences + [_sentence(symbol, vehicle, envelope, {symbol: value}) for symbol, value in rest.items()]


def _sentence(name: str, vehicle: Vehicle, envelope: Envelope, moved: Mapping[str, float]) -> str:
    values = ", ".join(stated(vehicle, symbol, 4) for symbol in moved)
    begin = f"{name} ({values})"
    if set(moved) <= {"lag", "delay"}:
        full = total_thrust(vehicle, [t for t in vehicle.thrusters if any(getattr(t, s) for s in moved)])
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
    drawn = _drawn(one, envelope)
    a, b = (forces(vehicle, drawn) for vehicle in (one, other))
    told = []
    for axis, unit, x, y in zip(AXES, FORCE_UNITS, a, b, strict=True):
        most = np.abs(x - y).max()
        if most > _NOTHING * max(np.abs(x).max(), 1.0):
            told.append(f"{axis} {np.sqrt(np.mean((x - y) ** 2)):.3g} {unit} (up to {most:.3g})")
    if not told:
        return "no force within the envelope."
    return f"{what}, root mean square over the envelope, is {listing(told)}."


class _Drawn(NamedTuple):
    """States: heading (n,), velocity over ground (3, n), shares of full command (n, thrusters), and the air."""

    heading: Array
    velocity: Array
    share: Array
    air: tuple[Array, Array]


def _drawn(vehicle: Vehicle, envelope: Envelope) -> _Drawn:
    rng = np.random.default_rng(7)
    velocity = rng.uniform(envelope.lower, envelope.upper, (_STATES, 3)).T
    heading, direction = rng.uniform(-np.pi, np.pi, (2, _STATES))
    flow = current_at(vehicle)
    if flow is not None:
        velocity[:2] += earth_to_body(heading, *flow)
    share = rng.uniform(-1.0, 1.0, (_STATES, len(vehicle.thrusters)))
    return _Drawn(heading, velocity, share, (_WIND * np.cos(direction), _WIND * np.sin(direction)))


def forces(vehicle: Vehicle, drawn: _Drawn) -> Array:
    """Forces by axis (3, n), of commands that have lasted, in a breeze and some minutes after the beginning."""
    u, v, r = drawn.velocity
    relative = relative_velocity(vehicle, drawn.heading, (u, v, r), _MINUTES)
    thrust, load = held_thrust(vehicle, commands_of(vehicle, drawn.share))
    left = np.array([thrust_left(t, np.full(_STATES, _MINUTES)) for t in vehicle.thrusters])
    wake = (relative[1], relative[2])
    force = ForceEquation(vehicle).force(relative, drawn.heading, left * thrust, left * load, wake, drawn.air, _MINUTES)
    return np.array(force)


def total_thrust(vehicle: Vehicle, of: Sequence[Thruster] | None = None) -> float:
    """Sum of the sizes of the forces [N] of all thrusters, or of some, at full command."""
    thrusters = vehicle.thrusters if of is None else of
    return float(sum(abs(t.lasting(command_of(t, np.ones(1)))[0][0]) for t in thrusters))
