"""Summands of the momentum balance along given rows, each computed once.

The balance is a sum of coefficients times products of signals (`physics.momentum_balance`). A coefficient belongs to
the vehicle; a product depends on the rows alone, but for the water's velocity, the wake's memory time, the length of
the hull and the shapes of the thrusters. Delays of the commands interpolate between forces shifted by whole rows, since
all that is linear in a force interpolates with it.
"""

from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Sequence
from functools import cache, partial
from itertools import pairwise
from typing import Any, final

import numpy as np

from ...physics.forces import CURRENT, across_hull, apparent_wind, commands_known, relative_velocity, remaining_thrust
from ...physics.momentum_balance import FORCES, balances
from ...physics.momentum_balance import Balance as AxisBalance
from ...physics.motion import Array, Motion
from ...physics.sampled_series import Switches, first_order_lag, switches
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle
from .base import Remembered, cache_limit

_WATERS = 4
"""Velocities of the water whose rows are kept: a model's own, and those beside it by which a column is taken."""
_WAKE = {"q_v": 1, "q_r": 2}
"""Signals of the wake memory, and the relative velocity that each of them follows."""
_WIND = ("u_a", "v_a", "|V_a|")
_CROSS_FLOW = tuple(name for _, name in FORCES)
"""Forces across the hull, which move with its size."""

Water = tuple[float, ...]
"""Velocity of the water towards north and east [m/s], and how it changes [m/s/min]."""
Key = tuple[Any, ...]
"""What a product is and depends on beside the rows: its factors or its name, the water or None, and the rest."""
Part = tuple[Key, float, Vehicle]
"""A product, its coefficient, and a vehicle that it is worked out for."""
Parts = tuple[dict[Key, tuple[float, Vehicle]], dict[Key, tuple[float, Vehicle]], dict[Key, tuple[float, Vehicle]]]
"""A sum of products on each axis."""


class Products(ABC):
    """The summands of the balance along rows.

    Parameters
    ----------
    heading : psi [rad], of a shape that goes with that of a velocity
    velocity : u, v [m/s] and r [rad/s] over ground, three arrays of one shape
    air : velocity of the air over ground, towards north and east [m/s]; None where it is still
    minutes : since the beginning of the log, of the heading's shape
    kept : how many products are kept of those that no water moves, and of the others: apart, for the current moves with
        every model and would drive out what does not
    """

    def __init__(
        self,
        heading: Array,
        velocity: tuple[Array, Array, Array],
        air: tuple[Array, Array] | None,
        minutes: Array,
        kept: tuple[int, int],
    ) -> None:
        self.heading, self.velocity, self._air, self._minutes = heading, velocity, air, minutes
        self._still: Remembered[Array] = Remembered(cache_limit(kept[0], self.shape))
        self._flowing: Remembered[Array] = Remembered(cache_limit(kept[1], self.shape))
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

    def forget(self) -> None:
        """Keep no products: they are worked out again where they are asked for."""
        self._still.clear()
        self._flowing.clear()
        self._waters.clear()

    def forces(self, vehicle: Vehicle) -> Array:
        """The whole force of a vehicle, its three axes first [N, N, N m]."""
        return self.summed(merge_products(self.force_parts(balances(vehicle), vehicle)))

    def summed(self, parts: Parts) -> Array:
        """Coefficients times products, for each of three axes."""
        total = np.zeros((3, *self.shape))
        for line, sums in zip(parts, total, strict=True):
            for key, (coefficient, vehicle) in line.items():
                kept = self._still if key[1] is None else self._flowing
                sums += coefficient * kept.of(key, partial(self.worked_out, key, vehicle))
        return total

    def force_parts(self, lines: Sequence[AxisBalance], vehicle: Vehicle) -> list[list[Part]]:
        """The summands of the force, by axis; what a thruster loses by its advance stands apart."""
        flow, memory_time = water(vehicle), vehicle.values["memory_time"]
        thrusters = {f"T:{thruster.name}": n for n, thruster in enumerate(vehicle.thrusters)}
        result: list[list[Part]] = []
        for line in lines:
            row: list[Part] = []
            for term in line.force:
                if term.factors and term.factors[0] in thrusters:
                    index = thrusters[term.factors[0]]
                    thruster = vehicle.thrusters[index]
                    row.append((("push", None, index, thruster.shape), term.coefficient * thruster.gain, vehicle))
                    if thruster.advance_loss:
                        loss = -term.coefficient * thruster.advance_loss
                        row.append((("load", flow, index, thruster.shape), loss, vehicle))
                else:
                    factors, flows, remembers, crosses = _moves_with(term.factors)
                    shape = memory_time if remembers else vehicle.hull if crosses else None
                    key = (factors, flow if flows else None, shape)
                    row.append((key, term.coefficient, vehicle))
            result.append(row)
        return result

    def worked_out(self, key: Key, vehicle: Vehicle) -> Array:
        """The product that a key stands for."""
        return self.passed(self.along(key, vehicle))

    def along(self, key: Key, vehicle: Vehicle) -> Array:
        """The product that a key stands for, along the rows."""
        if key[0] == "push":
            return self.response(key[2], vehicle.thrusters[key[2]].unit)[0]
        if key[0] == "load":
            return self.response(key[2], vehicle.thrusters[key[2]].unit)[1] * self.relative(vehicle)[0]
        return self._multiplied(key[0], vehicle)

    def relative(self, vehicle: Vehicle) -> tuple[Array, Array, Array]:
        """Velocities relative to the water [m/s, m/s, rad/s]."""
        key = water(vehicle)
        if key not in self._waters:
            self._waters[key] = relative_velocity(vehicle, self.heading, self.velocity, self._minutes)
            if len(self._waters) > _WATERS:
                self._waters.popitem(last=False)
        self._waters.move_to_end(key)
        return self._waters[key]

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
        if factor == "t":
            return np.broadcast_to(self._minutes, self.velocity[0].shape)
        if factor in _WIND:
            still = np.zeros_like(self.heading)
            ahead, starboard = apparent_wind(self.heading, self.velocity[:2], self._air or (still, still))
            return (ahead, starboard, np.hypot(ahead, starboard))[_WIND.index(factor)]
        if factor in _WAKE:
            return self.wake(_WAKE[factor], vehicle)
        if factor in _CROSS_FLOW:
            return np.asarray(across_hull(vehicle, *self.relative(vehicle)[1:])[_CROSS_FLOW.index(factor)])
        value = self.relative(vehicle)["uvr".index(factor.strip("|"))]
        return np.abs(value) if factor.startswith("|") else value


def merge_products(rows: Sequence[Sequence[Part]]) -> Parts:
    """Summands of one product, on one axis, as one."""
    found: list[dict[Key, tuple[float, Vehicle]]] = []
    for row in rows:
        line: dict[Key, tuple[float, Vehicle]] = {}
        for key, coefficient, vehicle in row:
            line[key] = (coefficient + line[key][0] if key in line else coefficient, vehicle)
        found.append(line)
    return found[0], found[1], found[2]


def subtract_products(one: Parts, other: Parts) -> Parts:
    """Difference of two sums of products: what stands in both alike is in neither.

    What a thruster does in both stands side by side, so that two shapes which push alike in a log cancel to the bit.
    """
    found: list[dict[Key, tuple[float, Vehicle]]] = []
    for left, right in zip(one, other, strict=True):
        rest = {key: (part[0] - right[key][0] if key in right else part[0], part[1]) for key, part in left.items()}
        rest |= {key: (-part[0], part[1]) for key, part in right.items() if key not in left}
        apart = [(key, part) for key, part in rest.items() if part[0] != 0.0]
        found.append(dict(sorted(apart, key=_of_thruster)))
    return found[0], found[1], found[2]


def _of_thruster(item: tuple[Key, tuple[float, Vehicle]]) -> int:
    kind, _, place = item[0][:3]
    return place if kind in ("push", "load") else -1


@cache
def _moves_with(factors: tuple[str, ...]) -> tuple[tuple[str, ...], bool, bool, bool]:
    """Factors in one order, and whether their product moves with the water, the wake's memory time, the hull's size."""
    crosses = any(f in _CROSS_FLOW for f in factors)
    flows = crosses or any(f.strip("|")[:1] in ("u", "v") or f == "q_v" for f in factors if f not in _WIND)
    return tuple(sorted(factors)), flows, any(f in _WAKE for f in factors), crosses


def water(vehicle: Vehicle) -> Water:
    """Velocity of the water that a vehicle sails in."""
    return tuple(vehicle.values[symbol] for symbol in CURRENT)


_KEPT = 16_000_000
"""Bytes of forces, and as many of commands, that are kept: on 25 min of log at 20 Hz, of 16 shapes of two thrusters."""
_WHOLE = 1e-9
"""Share of a row that is rounding of a delay of whole rows."""


@final
class LateForces:
    """Forces and losses of thrusters along some motions, of a gain and a loss of one.

    Parameters
    ----------
    motions : gap-free stretches with their commands
    """

    def __init__(self, motions: Sequence[Motion]) -> None:
        self._motions = tuple(motions)
        self._steps = [motion.time_step for motion in self._motions]
        known = [commands_known(motion, 0) for motion in self._motions]
        self._edges = np.cumsum([0, *(series.size for series, _ in known)])
        self._rows = [np.arange(b - m.time.size, b) for m, b in zip(self._motions, self._edges[1:], strict=True)]
        self._lagged: Remembered[tuple[Array, ...]] = Remembered(_KEPT)
        self._prompt: Remembered[Array] = Remembered(_KEPT)

    def forget(self) -> None:
        """Keep no forces."""
        self._lagged.clear()
        self._prompt.clear()

    def late(self, unit: Thruster) -> tuple[tuple[int, ...], Array]:
        """Whole rows by which forces are late in each motion, and the share of a row beyond."""
        rows = np.array([unit.late / step for step in self._steps])
        whole = np.floor(rows + _WHOLE)
        share = rows - whole
        return tuple(whole.astype(int).tolist()), np.where(share > _WHOLE, share, 0.0)

    def shifted(self, index: int, unit: Thruster, rows: Sequence[int]) -> Array:
        """Force [N] and load [N s/m] of a thruster along all motions, (2, n), by whole rows late; the ends hold.

        Parameters
        ----------
        index : number of the thruster in the vehicle
        unit : the thruster, with its curve, dead zone and wear
        rows : by how many whole rows each motion is late; negative, early
        """
        series = self._prompt.of((index, unit.prompt_shape), lambda: self._at_once(index, unit))
        ends = zip(self._rows, rows, pairwise(self._edges), strict=True)
        places = [np.clip(own - by, first, last - 1) for own, by, (first, last) in ends]
        result = series.take(np.concatenate(places), axis=1)
        if unit.thrust_rate:
            result *= np.concatenate([remaining_thrust(unit, motion.minutes) for motion in self._motions])
        return result

    def between(self, unit: Thruster, at: Callable[[tuple[int, ...]], Array], times: Sequence[int]) -> Array:
        """Interpolate what is linear in a force between whole rows.

        Parameters
        ----------
        at : whole rows late in each motion -> (..., m), of all motions in turn
        times : how many of the m belong to each motion
        """
        whole, share = self.late(unit)
        result = at(whole)
        if not share.any():
            return result
        # So that of a force that stays, which is the same a row later, nothing changes to the bit.
        return result + np.repeat(share, times) * (at(tuple(k + 1 for k in whole)) - result)

    def _at_once(self, index: int, unit: Thruster) -> Array:
        """Force and load along the commands of all motions and their history, (2, rows)."""
        lagged, rows, share = self._lagged.of((index, unit.lag), lambda: self._commanded(index, unit.lag))
        return unit.prompt(lagged, Switches(rows, share))

    def _commanded(self, index: int, lag: float) -> tuple[Array, ...]:
        """A command with a lag along all motions and their history, and where it switches."""
        known = zip(self._motions, self._steps, strict=True)
        lagged = [first_order_lag(commands_known(m, index)[0], lag, step) for m, step in known]
        found = [switches(series) for series in lagged]
        rows = [first + one.rows for first, one in zip(self._edges, found, strict=False)]
        return np.concatenate(lagged), np.concatenate(rows), np.concatenate([one.share for one in found])
