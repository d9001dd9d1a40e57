"""Forces of many vehicles along the same rows, and how they differ: what two vehicles have alike is not evaluated."""

from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import Generic, TypeVar, final

import numpy as np

from ...physics.delays_and_lags import first_order_lag, shift, switches
from ...physics.forces import (
    CURRENT,
    Coefficients,
    ForceEquation,
    Triple,
    commands_known,
    force_coefficients,
    relative_velocity,
    thrust_left,
)
from ...physics.frames import Array
from ...physics.matrices import push_of
from ...physics.motion import Motion
from ...physics.thrusters import Thruster
from ...physics.vehicle import SHARED_THRUSTER_KEYS, Vehicle

T = TypeVar("T")
_MOST = 30_000_000
"""Bytes of arrays that are kept, however long the log is."""
_NOTHING = [0.0, 0.0, 0.0]
"""Coefficients of a product that a vehicle does not have."""


@final
class ColumnCache:
    """Arrays that are computed once and kept until younger ones need their place; the latest is kept, however large."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, Array] = OrderedDict()
        self._bytes = 0

    def of(self, key: Hashable, compute: Callable[[], Array]) -> Array:
        """The array of a key, computed where it is not kept."""
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        value = self._kept[key] = compute()
        self._bytes += value.nbytes
        while self._bytes > _MOST and len(self._kept) > 1:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return value

    def clear(self) -> None:
        """Keep nothing."""
        self._kept.clear()
        self._bytes = 0


@final
class LatestTwo(Generic[T]):
    """What is computed of the two vehicles that were asked for last: a model, and the one that it is compared to."""

    def __init__(self, compute: Callable[[Vehicle], T]) -> None:
        self._compute = compute
        self._kept: deque[tuple[Vehicle, T]] = deque(maxlen=2)

    def of(self, vehicle: Vehicle) -> T:
        """That of a vehicle."""
        for known in self._kept:
            if known[0] is vehicle:
                if known is not self._kept[-1]:
                    self._kept.rotate()
                return known[1]
        self._kept.append((vehicle, self._compute(vehicle)))
        return self._kept[-1][1]

    def clear(self) -> None:
        """Keep nothing."""
        self._kept.clear()


@final
class ThrusterResponses:
    """Forces and losses of thrusters along some motions, by the shape of each thruster.

    Parameters
    ----------
    motions : gap-free stretches with their commands
    laid : force and loss (2, n) along each motion -> (2, ...) along all of them
    """

    def __init__(self, motions: Sequence[Motion], laid: Callable[[list[Array]], Array]) -> None:
        self._motions, self._laid, self._kept = tuple(motions), laid, ColumnCache()

    def of(self, vehicle: Vehicle) -> tuple[Array, Array]:
        """Forces at zero advance [N] and their losses per advance speed [N s/m], (thrusters, ...) each."""
        pairs = [self.response(k, thruster) for k, thruster in enumerate(vehicle.thrusters)]
        return np.stack([pair[0] for pair in pairs]), np.stack([pair[1] for pair in pairs])

    def response(self, index: int, thruster: Thruster) -> tuple[Array, Array]:
        """Force and loss (...) of one thruster."""
        kept = self._kept.of(
            (index, thruster.shape, thruster.advance_loss != 0.0), partial(self._unit, index, thruster)
        )
        force = thruster.gain * kept[0]
        return force, thruster.advance_loss * kept[1] if thruster.advance_loss else np.zeros_like(force)

    def _unit(self, index: int, thruster: Thruster) -> Array:
        return self._laid([self._late(n, index, thruster) for n in range(len(self._motions))])

    def _late(self, number: int, index: int, thruster: Thruster) -> Array:
        """Force and loss, if any (2, n), along a motion, from what is the same for every delay."""
        motion = self._motions[number]
        commands, past = commands_known(motion, index)

        def prompt() -> Array:
            unit = thruster.unit
            lagged = first_order_lag(commands, unit.lag, motion.time_step)
            return unit.prompt(lagged, switches(lagged))

        kept = self._kept.of((number, index, thruster.prompt_shape), prompt)
        rows = kept if thruster.advance_loss else kept[:1]
        late = np.stack([shift(row, thruster.late, motion.time_step) for row in rows])[:, past:]
        return thrust_left(thruster, motion.minutes) * late if thruster.thrust_rate else late


@final
class ForcesAlong:
    """Forces of vehicles along rows, at which the boat has been measured, or predicted to be.

    Parameters
    ----------
    heading : psi [rad], of a shape that goes with that of a velocity
    velocity : u, v [m/s] and r [rad/s] over ground, of one shape
    air : velocity of the air over ground, towards north and east [m/s]; None where it is still
    minutes : since the beginning of the log
    thrusters : along these rows
    wake : vehicle and velocities through the water -> the wake memory's two states
    """

    def __init__(
        self,
        heading: Array,
        velocity: Triple,
        air: tuple[Array, Array] | None,
        minutes: Array,
        thrusters: ThrusterResponses,
        wake: Callable[[Vehicle, Triple], tuple[Array, Array]],
    ) -> None:
        self.heading, self.velocity, self.minutes, self.thrusters = heading, velocity, minutes, thrusters
        self._air, self._wake = air, wake
        self._water: tuple[tuple[float, ...], Triple] | None = None
        self._coefficients: LatestTwo[Coefficients] = LatestTwo(force_coefficients)

    def relative(self, vehicle: Vehicle) -> Triple:
        """Velocities through the water [m/s, m/s, rad/s]."""
        water = tuple(vehicle.values[symbol] for symbol in CURRENT)
        if self._water is None or self._water[0] != water:
            self._water = water, relative_velocity(vehicle, self.heading, self.velocity, self.minutes)
        return self._water[1]

    def of(self, vehicle: Vehicle) -> Triple:
        """The whole force, by axis [N, N, N m]."""
        return self.evaluator(vehicle, ForceEquation(vehicle))(self.relative(vehicle), self.heading)

    def evaluator(self, vehicle: Vehicle, equation: ForceEquation) -> Callable[[Triple, Array], Triple]:
        """The force at other velocities through the water and headings, under the same thrust and wake."""
        thrust, load = self.thrusters.of(vehicle)
        if thrust[0].ndim < self.velocity[0].ndim:  # no copy of a log has other commands
            thrust, load = thrust[:, None], load[:, None]
        memory = self._wake(vehicle, self.relative(vehicle)) if equation.has_memory else None
        lost = load if load.any() else None
        return lambda relative, heading: equation.force(
            relative, heading, thrust, lost, memory, self._air, self.minutes
        )

    def change(self, one: Vehicle, other: Vehicle) -> list[Array] | None:
        """The force of one vehicle less that of another, by axis; None where every signal differs.

        That is where the water moves otherwise, or the wake or the hull is another. What thrusters of two shapes do
        alike cancels to the bit.
        """
        alike = all(one.values[symbol] == other.values[symbol] for symbol in (*CURRENT, "memory_time"))
        if not alike or one.hull != other.hull:
            return None
        relative, changed = self.relative(one), self._changed(one, other)
        force: list[Array] = [np.zeros((1,) * self.velocity[0].ndim)] * 3
        if changed:
            memory = self._wake(one, relative) if any("q_" in f for factors in changed for f in factors) else None
            equation, still = ForceEquation(one, changed), np.zeros(len(one.thrusters))
            force = list(equation.force(relative, self.heading, still, None, memory, self._air, self.minutes))
        for k, pair in enumerate(zip(one.thrusters, other.thrusters, strict=True)):
            same = pair[0] is pair[1] or pair[0] == pair[1]
            for sign, thruster in () if same else zip((1.0, -1.0), pair, strict=True):
                thrust, load = self.thrusters.response(k, thruster)
                push = thrust - load * relative[0] if thruster.advance_loss else thrust
                for axis, share in enumerate(push_of(thruster)):
                    force[axis] = force[axis] + sign * share * push if share else force[axis]
        return force

    def _changed(self, one: Vehicle, other: Vehicle) -> Coefficients:
        """The coefficients of one vehicle less those of another, where they differ, but for those of thrusters."""
        hull = (symbol for symbol in one.values if symbol not in SHARED_THRUSTER_KEYS)
        if one.terms == other.terms and all(one.values[symbol] == other.values[symbol] for symbol in hull):
            return {}
        a, b = self._coefficients.of(one), self._coefficients.of(other)
        pairs = {f: (a.get(f, _NOTHING), b.get(f, _NOTHING)) for f in {**a, **b}}
        return {
            factors: [left - right for left, right in zip(*pair, strict=True)]
            for factors, pair in pairs.items()
            if pair[0] != pair[1] and not any(factor.startswith("T:") for factor in factors)
        }
