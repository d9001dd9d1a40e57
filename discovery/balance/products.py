"""Summands of the momentum balance along given rows, each computed once, and the same through test functions.

The balance is a sum of coefficients times products of signals (`physics.momentum_balance`). A coefficient belongs to
the vehicle; a product depends on the rows alone, but for the water's velocity, the wake's memory time, the length of
the hull and the shapes of the thrusters.
"""

from abc import ABC, abstractmethod
from collections import OrderedDict, deque
from collections.abc import Sequence
from functools import cache, partial, reduce
from itertools import pairwise
from typing import Any, NamedTuple, final

import numpy as np

from ...physics.forces import (
    CURRENT,
    across_hull,
    apparent_wind,
    relative_velocity,
    remembered_before,
)
from ...physics.momentum_balance import FORCES, balances
from ...physics.momentum_balance import Balance as AxisBalance
from ...physics.motion import Array, Motion, earth_to_body
from ...physics.sampled_series import first_order_lag
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle
from .base import LateForces, Remembered, cache_limit

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
Line = dict[Key, tuple[float, Vehicle]]
"""A sum of products: the coefficient of each, and the vehicle that it is worked out for."""
Parts = list[Line]
"""A sum of products on each of three axes."""


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
        self.heading, self.velocity, self._air, self.minutes = heading, velocity, air, minutes
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
        factors = (self._signal(factor, vehicle) for factor in key[0])
        return reduce(np.multiply, factors, np.ones_like(self.velocity[0]))

    def relative(self, vehicle: Vehicle) -> tuple[Array, Array, Array]:
        """Velocities relative to the water [m/s, m/s, rad/s]."""
        key = water(vehicle)
        if key not in self._waters:
            self._waters[key] = relative_velocity(vehicle, self.heading, self.velocity, self.minutes)
            if len(self._waters) > _WATERS:
                self._waters.popitem(last=False)
        self._waters.move_to_end(key)
        return self._waters[key]

    def _signal(self, factor: str, vehicle: Vehicle) -> Array:
        """One factor along the rows."""
        if factor in ("cos psi", "sin psi"):
            turned = np.cos(self.heading) if factor == "cos psi" else np.sin(self.heading)
            return np.broadcast_to(turned, self.velocity[0].shape)
        if factor == "t":
            return np.broadcast_to(self.minutes, self.velocity[0].shape)
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
    found: Parts = [{} for _ in rows]
    for line, row in zip(found, rows, strict=True):
        for key, coefficient, vehicle in row:
            line[key] = (coefficient + line[key][0] if key in line else coefficient, vehicle)
    return found


def subtract_products(one: Parts, other: Parts) -> Parts:
    """Difference of two sums of products: what stands in both alike is in neither.

    What a thruster does in both stands side by side, so that two shapes which push alike in a log cancel to the bit.
    """
    found: Parts = []
    for left, right in zip(one, other, strict=True):
        rest = {key: (part[0] - right[key][0] if key in right else part[0], part[1]) for key, part in left.items()}
        rest |= {key: (-part[0], part[1]) for key, part in right.items() if key not in left}
        apart = [(key, part) for key, part in rest.items() if part[0] != 0.0]
        found.append(dict(sorted(apart, key=_of_thruster)))
    return found


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


_RATES = ("u_dot", "v_dot", "r_dot")
_KEPT = (400, 200)
"""Products that are kept: of a few shapes of each thruster and a few waters, between which a search goes to and fro."""
_KNOWN = 4
"""Vehicles whose parts are kept: a model's own, to which others beside it are compared."""
_TOGETHER = 65_536
"""Numbers that go through the test functions at once: calls are few, and memory is little beside any log's columns."""


class Kernel(NamedTuple):
    """Test functions over one motion: weights of a value and of a rate, rows between two, and how many there are."""

    value: Array
    rate: Array
    stride: int
    count: int

    def apply(self, rows: Array, weights: Array) -> Array:
        """Weighted sums of rows (..., n) about each centre, (..., count)."""
        total = np.zeros((*rows.shape[:-1], self.count))
        if not self.count:
            return total
        # A window is some strides long: each stride of rows meets each stride of weights once, in one product.
        pieces = -(-weights.size // self.stride)
        padded = np.zeros((pieces, self.stride))
        padded.flat[: weights.size] = weights
        strides = self.count + pieces - 1
        known = min(rows.shape[-1], strides * self.stride)
        flat, sums = rows.reshape(-1, rows.shape[-1]), total.reshape(-1, self.count)
        few = max(1, _TOGETHER // known)
        for k in range(0, len(flat), few):
            some, met_by = flat[k : k + few], sums[k : k + few]
            whole = np.zeros((len(some), strides * self.stride))
            whole[:, :known] = some[:, :known]
            met = (padded @ whole.reshape(-1, self.stride).T).reshape(pieces, len(some), strides)
            for piece in range(pieces):
                met_by += met[piece, :, piece : piece + self.count]
        return total


@final
class TestedTerms(Products):
    """Products of the balance as (copies, tests), or (1, tests) where no copy differs.

    Parameters
    ----------
    motions : the gap-free stretches
    velocities : (copies, n, 3) over ground for each motion; the first is the measured one
    kernels : test functions of each motion
    claims : (n, 3) accelerations over ground for each motion that stand in place of the measured ones
    like : terms of other motions, whose sums of products, which are of vehicles and not of motions, are these, too
    """

    def __init__(
        self,
        motions: Sequence[Motion],
        velocities: Sequence[Array],
        kernels: Sequence[Kernel],
        claims: Sequence[Array] | None,
        like: "TestedTerms | None" = None,
    ) -> None:
        self._motions, self._kernels = motions, kernels
        self._edges = np.cumsum([0, *(m.time.size for m in motions)])
        self._claim = None if claims is None else np.concatenate(claims).T
        u, v, r = np.concatenate([np.moveaxis(v, -1, 0) for v in velocities], axis=-1)
        air = [np.zeros((m.time.size, 2)) if m.air is None else m.air for m in motions]
        north, east = np.concatenate(air).T
        self._known: deque[tuple[Vehicle, Parts]] = deque(maxlen=_KNOWN) if like is None else like._known
        self._known_rates: dict[int, tuple[Array, ...]] = {}
        self._units: dict[tuple[object, ...], Parts] = {} if like is None else like._units
        self._thrusts = LateForces(motions)
        heading, minutes = (
            np.concatenate(parts) for parts in zip(*((m.heading, m.minutes) for m in motions), strict=True)
        )
        super().__init__(heading, (u, v, r), (north, east), minutes, _KEPT)

    @property
    def shape(self) -> tuple[int, ...]:
        """(copies, tests)."""
        return self.velocity[0].shape[0], sum(kernel.count for kernel in self._kernels)

    def balances(self, vehicle: Vehicle) -> Array:
        """Inertia less force of a vehicle, (3, copies, tests) [N, N, N m]."""
        return self.summed(self._balance(vehicle))

    def difference(self, one: Vehicle, other: Vehicle) -> Array:
        """The balance of one vehicle less that of another, (3, copies, tests): only what differs is read."""
        parts = subtract_products(self._balance(one), self._balance(other))
        if water(one) == water(other):
            return self.summed(parts)
        # Waters beside a model's own are asked for once: their products are added up along the rows and tested as one.
        still, flowing = (
            [{k: p for k, p in line.items() if (k[1] is None) is s} for line in parts] for s in (True, False)
        )
        total = self.summed(still)
        wanted: dict[Key, list[tuple[int, float, Vehicle]]] = {}
        for axis, line in enumerate(flowing):
            for key, (coefficient, vehicle) in line.items():
                wanted.setdefault(key, []).append((axis, coefficient, vehicle))
        rows = np.zeros((3, *self.velocity[0].shape))
        for key, (first, *others) in wanted.items():
            rate = key[0] == "rate"
            product, sums = (self._rate(key[2], first[2]), total) if rate else (self.along(key, first[2]), rows)
            for axis, coefficient, _ in (first, *others):
                sums[axis] += coefficient * product
        return total + self.passed(rows)

    def unit(self, about: Vehicle, symbol: str, beside: tuple[object, ...]) -> Array:
        """What a unit of a parameter in which the balance is linear takes off it, (3, copies, tests).

        Which products it multiplies is the same in all waters.

        Parameters
        ----------
        beside : what else its coefficients depend on
        """
        parts = self._units.get((symbol, *beside))
        if parts is None:
            without, within = (about.with_values({symbol: value}) for value in (0.0, 1.0))
            parts = self._units[symbol, *beside] = subtract_products(self._balance(without), self._balance(within))
        flow = water(about)
        return self.summed(
            [
                {(k[0], None if k[1] is None else flow, *k[2:]): (part[0], about) for k, part in line.items()}
                for line in parts
            ]
        )

    def _balance(self, vehicle: Vehicle) -> Parts:
        for known, parts in self._known:
            if known is vehicle:
                return parts
        lines = balances(vehicle)
        rows = [[(key, -coefficient, v) for key, coefficient, v in row] for row in self.force_parts(lines, vehicle)]
        for row, line in zip(rows, lines, strict=True):
            for term in line.inertia:
                axis = _RATES.index(term.factors[0])
                row.append((("rate", water(vehicle) if axis < 2 else None, axis), term.coefficient, vehicle))
        self._known.append((vehicle, merge_products(rows)))
        return self._known[-1][1]

    def worked_out(self, key: Key, vehicle: Vehicle) -> Array:
        """The product that a key stands for, the tested derivatives among them."""
        if key[0] == "rate":
            return self._rate(key[2], vehicle)
        return self._push(key[2], vehicle.thrusters[key[2]]) if key[0] == "push" else super().worked_out(key, vehicle)

    def forget(self) -> None:
        """Keep no products and no forces."""
        super().forget()
        self._known_rates.clear()
        self._thrusts.forget()

    def passed(self, rows: Array) -> Array:
        """Rows (..., n) through the test functions, (..., tests)."""
        return self._test(rows, [kernel.value for kernel in self._kernels])

    def wake(self, axis: int, vehicle: Vehicle) -> Array:
        """The wake memory from what it holds at the beginning of each motion, (copies, rows)."""
        velocity, constant = self.relative(vehicle)[axis], vehicle.values["memory_time"]
        result = np.empty_like(velocity)
        for motion, (start, stop) in zip(self._motions, pairwise(self._edges), strict=True):
            begin = remembered_before(vehicle, motion)[axis - 1]
            for row, kept in zip(velocity[:, start:stop], result[:, start:stop], strict=True):
                kept[:] = first_order_lag(row, constant, motion.time_step, begin)
        return result

    def response(self, index: int, unit: Thruster) -> tuple[Array, Array]:
        """Force [N] and load [N s/m] of a thruster, (1, rows) each: commands have no noise."""

        def at(rows: tuple[int, ...]) -> Array:
            return self._thrusts.shifted(index, unit, rows)

        force, load = self._thrusts.between(unit, at, np.diff(self._edges).tolist())
        return force[None], load[None]

    def _push(self, index: int, thruster: Thruster) -> Array:
        """The force of a thruster of a gain of one through the test functions, (1, tests)."""
        unit = thruster.unit
        shape = ("whole", index, unit.prompt_shape, unit.thrust_rate)

        def at(rows: tuple[int, ...]) -> Array:
            return self._still.of((*shape, rows), partial(tested, rows))

        def tested(rows: tuple[int, ...]) -> Array:
            return self.passed(self._thrusts.shifted(index, unit, rows)[:1])

        return self._thrusts.between(unit, at, [kernel.count for kernel in self._kernels])

    def _rate(self, axis: int, vehicle: Vehicle) -> Array:
        """The tested derivative of a relative velocity, or of a claimed one, (copies, tests)."""
        if self._claim is None:
            measured, *flowing = self._rates(axis)
            parts = zip(water(vehicle), flowing, strict=True) if axis < 2 else ()
            return measured - sum(speed * rate for speed, rate in parts if speed)
        claimed = self._claim[axis][None]
        if axis < 2:  # less what the turning of the current adds over ground
            drift = self.velocity[1 - axis] - self.relative(vehicle)[1 - axis]
            claimed = claimed + (-1.0, 1.0)[axis] * drift * self.velocity[2]
            northwards, eastwards = (rate / 60.0 for rate in water(vehicle)[2:])
            claimed = claimed - earth_to_body(self.heading, northwards, eastwards)[axis]
        return self.passed(claimed)

    def _rates(self, axis: int) -> tuple[Array, ...]:
        """Tested derivatives of a velocity over ground, and of what a unit of each number of the water adds to it."""
        weights = [kernel.rate for kernel in self._kernels]
        if axis not in self._known_rates:
            rows = [self.velocity[axis]]
            if axis < 2:
                turned = [earth_to_body(self.heading, *unit)[axis][None] for unit in ((1.0, 0.0), (0.0, 1.0))]
                rows += [*turned, *(self.minutes * one for one in turned)]
            self._known_rates[axis] = tuple(-self._test(one, weights) for one in rows)
        return self._known_rates[axis]

    def _test(self, rows: Array, weights: Sequence[Array]) -> Array:
        pieces = zip(self._kernels, weights, pairwise(self._edges), strict=True)
        return np.concatenate([kernel.apply(rows[..., a:b], weight) for kernel, weight, (a, b) in pieces], axis=-1)
