"""From newtons that a controller asks for to the commands of thrusters, by the curves that its model knows."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..physics.forces import thrust_left
from ..physics.frames import Array
from ..physics.thrusters import TableCurve, Thruster, command_of
from ..physics.vehicle import Vehicle

_POINTS = 801
"""Commands at which a curve is looked up: 400 a side, so that neighbours are less than the noise of a motor apart."""
_WIDE = 10.0
"""Multiple of the most force up to which a force of `in_newtons` goes in a straight line: bounds end it, not a bend."""


@dataclass(frozen=True, slots=True, eq=False)
class ThrustInverse:
    """The inverse of each thruster's curve, dead zone, scales and loss under way.

    Attributes
    ----------
    vehicle : whose curves they are
    lower, upper : (thrusters,) forces at rest that its commands reach [N]
    """

    vehicle: Vehicle
    commands: tuple[Array, ...]
    forces: tuple[Array, ...]
    losses: tuple[Array, ...]

    @property
    def lower(self) -> Array:
        """Least force of each thruster at rest [N]."""
        return np.array([force.min() for force in self.forces])

    @property
    def upper(self) -> Array:
        """Largest force of each thruster at rest [N]."""
        return np.array([force.max() for force in self.forces])

    def command(self, force: Array, minutes: float = 0.0, advance: float = 0.0) -> Array:
        """Commands (thrusters,) in the thrusters' own units that give forces (thrusters,) [N].

        Parameters
        ----------
        minutes : since the beginning, for a thrust that wears
        advance : surge speed through the water [m/s], where forces are those under way; 0 for forces at rest
        """
        found = []
        for k, thruster in enumerate(self.vehicle.thrusters):
            left = float(thrust_left(thruster, np.array(minutes))) if thruster.thrust_rate else 1.0
            made = left * (self.forces[k] - advance * self.losses[k])
            rising = np.maximum.accumulate(made if made[-1] >= made[0] else made[::-1])
            order = self.commands[k] if made[-1] >= made[0] else self.commands[k][::-1]
            found.append(_looked_up(float(force[k]), rising, order))
        return np.array(found)

    def at_rest(self, command: Array, minutes: float = 0.0) -> Array:
        """Forces at rest (thrusters,) that commands (thrusters,) give [N]."""
        found = np.array(
            [float(t.lasting(np.array([c]))[0][0]) for t, c in zip(self.vehicle.thrusters, command, strict=True)]
        )
        return found * [float(thrust_left(t, np.array(minutes))) for t in self.vehicle.thrusters]

    def share(self, command: Array) -> Array:
        """Commands (n, thrusters) as shares of full command."""
        pairs = enumerate(self.vehicle.thrusters)
        return np.column_stack([t.curve.normalised(command[:, k], t.command) for k, t in pairs])


def _looked_up(force: float, rising: Array, order: Array) -> float:
    """The command of a force; on a flat stretch, its middle, so that no thrust is asked for by a thruster at rest."""
    low, high = np.searchsorted(rising, force - 1e-9), np.searchsorted(rising, force + 1e-9, side="right")
    if high > low:
        return float(0.5 * (order[low] + order[high - 1]))
    return float(np.interp(force, rising, order))


def thrust_inverse(vehicle: Vehicle) -> ThrustInverse:
    """The inverse of a vehicle's thrusters."""
    shares = np.linspace(-1.0, 1.0, _POINTS)
    commands = tuple(command_of(t, shares) for t in vehicle.thrusters)
    pairs = [t.lasting(c) for t, c in zip(vehicle.thrusters, commands, strict=True)]
    return ThrustInverse(
        vehicle, commands, tuple(p[0] for p in pairs), tuple(np.broadcast_to(p[1], p[0].shape) for p in pairs)
    )


def in_newtons(vehicle: Vehicle) -> Vehicle:
    """The vehicle with thrusters that are commanded in newtons at rest: places, lag, delay and loss under way stay.

    A controller that plans in newtons has a smooth problem whatever the curves are: a dead zone, of which a derivative
    says nothing, is the inverse's. The lag then acts on the force in place of the command, and the loss goes with the
    force, not the command; on straight curves both are the same.
    """
    inverse = thrust_inverse(vehicle)
    ends = np.maximum(np.abs(inverse.lower), np.abs(inverse.upper))
    thrusters = tuple(_straight(t, float(end)) for t, end in zip(vehicle.thrusters, ends, strict=True))
    return vehicle.model_copy(update={"thrusters": thrusters}).with_values({})


def _straight(thruster: Thruster, most: float) -> Thruster:
    wide = _WIDE * max(most, 1e-9)
    kept: dict[str, Any] = {
        name: getattr(thruster, name) for name in ("name", "x", "y", "angle", "lag", "delay", "arm_scale")
    }
    curve = TableCurve(kind="table", command=(-wide, wide), force=(-wide, wide))
    command = "tau" if thruster.command == "tau" else "newton"
    return Thruster(**kept, command=command, curve=curve, advance_loss=_WIDE * thruster.advance_loss)
