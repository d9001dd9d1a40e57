"""Every summand of the momentum balance along given rows, each worked out once and remembered.

The balance is a sum of coefficients times products of signals (`physics.momentum_balance`). A coefficient is a number
of the vehicle; a product depends on the rows alone, but for the water's velocity, the wake's memory time and the shapes
of the thrusters. So a model is judged by a weighted sum of products, and the rows are read again only where one of
those few numbers moves.
"""

from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Sequence

import numpy as np

from ...physics.forces import apparent_wind, relative_velocity
from ...physics.frames import Array
from ...physics.momentum_balance import BalanceTerm, balances
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle
from .remembered import Remembered

_REMEMBERED = 100_000_000
"""Bytes of products that are kept: a search over an hour of log goes round in about so many."""
_WATERS = 4
"""Velocities of the water whose rows are kept: a model's own, and those beside it by which a column is taken."""
_WAKE = {"q_v": 1, "q_r": 2}
"""Signals of the wake memory, and the relative velocity that each of them follows."""
_WIND = ("u_a", "v_a", "|V_a|")

Water = tuple[float, float]
"""Velocity of the water towards north and east [m/s]."""


class Products(ABC):
    """The summands of the balance along rows.

    Parameters
    ----------
    heading : psi [rad], of a shape that goes with that of a velocity
    velocity : u, v [m/s] and r [rad/s] over ground, three arrays of one shape
    air : velocity of the air over ground, towards north and east [m/s]; None where it is still
    """

    def __init__(self, heading: Array, velocity: tuple[Array, Array, Array], air: tuple[Array, Array] | None) -> None:
        self.heading, self.velocity, self._air = heading, velocity, air
        self.known: Remembered[Array] = Remembered(_REMEMBERED)
        self._waters: OrderedDict[Water, tuple[Array, Array, Array]] = OrderedDict()

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """Of what is kept of a product."""

    @abstractmethod
    def passed(self, rows: Array) -> Array:
        """What is kept of a product along the rows."""

    @abstractmethod
    def wake(self, axis: int, vehicle: Vehicle) -> Array:
        """The wake memory that follows a relative velocity, along the rows."""

    @abstractmethod
    def response(self, index: int, unit: Thruster) -> tuple[Array, Array]:
        """Force [N] and load [N s/m] of a thruster along the rows."""

    def forces(self, vehicle: Vehicle) -> Array:
        """The whole force of a vehicle, its three axes first [N, N, N m]."""
        return self.summed([line.force for line in balances(vehicle)], vehicle)

    def summed(self, lines: Sequence[Sequence[BalanceTerm]], vehicle: Vehicle) -> Array:
        """Coefficients times products, for each of three axes."""
        total = np.zeros((3, *self.shape))
        for line, sums in zip(lines, total, strict=True):
            for term in line:
                sums += term.coefficient * self._product(term.factors, vehicle)
        return total

    def relative(self, vehicle: Vehicle) -> tuple[Array, Array, Array]:
        """Velocities relative to the water [m/s, m/s, rad/s]."""
        key = water(vehicle)
        if key not in self._waters:
            self._waters[key] = relative_velocity(vehicle, self.heading, self.velocity)
            if len(self._waters) > _WATERS:
                self._waters.popitem(last=False)
        self._waters.move_to_end(key)
        return self._waters[key]

    def _product(self, factors: Sequence[str], vehicle: Vehicle) -> Array:
        if factors and factors[0].startswith("T:"):
            names = [thruster.name for thruster in vehicle.thrusters]
            return self._thrust(names.index(factors[0][2:]), vehicle)
        factors = tuple(sorted(factors))
        return self.known.of(
            (factors, *_depends(factors, vehicle)), lambda: self.passed(self._multiplied(factors, vehicle))
        )

    def _thrust(self, index: int, vehicle: Vehicle) -> Array:
        """The force of a thruster: a gain times that of its shape, less its loss per advance speed."""
        thruster = vehicle.thrusters[index]
        key = (index, *thruster.shape)
        push = self.known.of(("push", *key), lambda: self.passed(self.response(index, thruster.unit)[0]))
        if thruster.advance_loss == 0.0:
            return thruster.gain * push
        lost = self.known.of(
            ("load", *key, water(vehicle)),
            lambda: self.passed(self.response(index, thruster.unit)[1] * self.relative(vehicle)[0]),
        )
        return thruster.gain * push - thruster.advance_loss * lost

    def _multiplied(self, factors: Sequence[str], vehicle: Vehicle) -> Array:
        signals = [self._signal(factor, vehicle) for factor in factors]
        value = signals[0] if signals else np.ones_like(self.velocity[0])
        for signal in signals[1:]:
            value = value * signal
        return value

    def _signal(self, factor: str, vehicle: Vehicle) -> Array:
        """One factor along the rows."""
        if factor in ("cos psi", "sin psi"):
            turned = np.cos(self.heading) if factor == "cos psi" else np.sin(self.heading)
            return np.broadcast_to(turned, self.velocity[0].shape)
        if factor in _WIND:
            still = np.zeros_like(self.heading)
            ahead, starboard = apparent_wind(self.heading, self.velocity[:2], self._air or (still, still))
            return (ahead, starboard, np.hypot(ahead, starboard))[_WIND.index(factor)]
        if factor in _WAKE:
            return self.wake(_WAKE[factor], vehicle)
        value = self.relative(vehicle)["uvr".index(factor.strip("|"))]
        return np.abs(value) if factor.startswith("|") else value


def _depends(factors: Sequence[str], vehicle: Vehicle) -> tuple[object, ...]:
    """The numbers of a vehicle that a product of signals moves with."""
    found: list[object] = []
    if any(factor.strip("|")[:1] in ("u", "v") or factor == "q_v" for factor in factors if factor not in _WIND):
        found.append(water(vehicle))
    if any(factor in _WAKE for factor in factors):
        found.append(vehicle.values["memory_time"])
    return tuple(found)


def water(vehicle: Vehicle) -> Water:
    """Velocity of the water that a vehicle sails in."""
    return vehicle.values["current_north"], vehicle.values["current_east"]
