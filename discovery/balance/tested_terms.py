"""Every summand of the momentum balance, passed through the test functions once and remembered.

The balance is a sum of coefficients times products of signals (`physics.momentum_balance`). A coefficient is a number
of the vehicle; a product depends on the log alone, but for the water's velocity, the wake's memory time and the shapes
of the thrusters. So a model is judged by a weighted sum of series that are as long as there are tests, and the rows of
the log are read again only where one of those few numbers moves.
"""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...physics.forces import apparent_wind, relative_velocity
from ...physics.frames import Array
from ...physics.momentum_balance import BalanceTerm, balances
from ...physics.motion import Motion
from ...physics.thrusters import Thruster, first_order_lag
from ...physics.vehicle import Vehicle

_REMEMBERED = 100_000_000
"""Bytes of tested series that are kept: a search over an hour of log goes round in about so many."""
_WATERS = 4
"""Velocities of the water whose rows are kept: a model's own, and those beside it by which a column is taken."""
_RATES = ("u_dot", "v_dot", "r_dot")
_WAKE = {"q_v": 1, "q_r": 2}
"""Signals of the wake memory, and the relative velocity that each of them follows."""
_WIND = ("u_a", "v_a", "|V_a|")


class Kernel(NamedTuple):
    """Test functions over one motion: weights of a value and of a rate, rows between two, and how many there are."""

    value: Array
    rate: Array
    stride: int
    count: int

    def apply(self, rows: Array, weights: Array) -> Array:
        """Weighted sums of rows (..., n) about each centre, (..., count)."""
        total = np.zeros((*rows.shape[:-1], self.count))
        reach = self.stride * (self.count - 1) + 1
        for offset, weight in enumerate(weights):
            if weight != 0.0 and self.count:
                total += weight * rows[..., offset : offset + reach : self.stride]
        return total


class TestedTerms:
    """The summands of the balance along a log and along noisier copies of it.

    Parameters
    ----------
    motions : the gap-free stretches
    velocities : (copies, n, 3) over ground for each motion; the first is the measured one
    kernels : test functions of each motion
    claims : (n, 3) accelerations over ground for each motion that stand in place of the measured ones
    """

    def __init__(
        self,
        motions: Sequence[Motion],
        velocities: Sequence[Array],
        kernels: Sequence[Kernel],
        claims: Sequence[Array] | None,
    ) -> None:
        self._motions, self._kernels = motions, kernels
        self._edges = np.cumsum([0, *(m.time.size for m in motions)])
        self._velocity = np.concatenate([np.moveaxis(v, -1, 0) for v in velocities], axis=-1)
        self._heading = np.concatenate([m.heading for m in motions])
        self._claim = None if claims is None else np.concatenate(claims).T
        self._waters: OrderedDict[tuple[float, float], tuple[Array, Array, Array]] = OrderedDict()
        self._known: OrderedDict[tuple[object, ...], Array] = OrderedDict()
        self._bytes = 0

    def balances(self, vehicle: Vehicle) -> Array:
        """Inertia less force of a vehicle, (copies, tests, 3) [N, N, N m]."""
        copies, tests = self._velocity.shape[1], sum(kernel.count for kernel in self._kernels)
        total = np.zeros((3, copies, tests))
        for line, sums in zip(balances(vehicle), total, strict=True):
            for term in line.inertia:
                sums += term.coefficient * self._tested(term, vehicle)
            for term in line.force:
                sums -= term.coefficient * self._tested(term, vehicle)
        return np.ascontiguousarray(total.transpose(1, 2, 0))

    def forces(self, vehicle: Vehicle) -> Array:
        """The whole force of a vehicle along the measured motions, (tests, 3) [N, N, N m]."""
        tests = sum(kernel.count for kernel in self._kernels)
        lines = [[t.coefficient * self._tested(t, vehicle)[0] for t in line.force] for line in balances(vehicle)]
        return np.stack([sum(line, np.zeros(tests)) for line in lines], axis=-1)

    def _tested(self, term: BalanceTerm, vehicle: Vehicle) -> Array:
        """The product of a summand's factors, tested: (copies, tests), or (1, tests) where no copy differs."""
        first = term.factors[0] if term.factors else ""
        if first.startswith("T:"):
            names = [thruster.name for thruster in vehicle.thrusters]
            return self._thrust(names.index(first[2:]), vehicle)
        factors = tuple(sorted(term.factors))
        key = (factors, *self._depends(factors, vehicle))
        if first in _RATES:
            return self._remember(key, lambda: self._rate(_RATES.index(first), vehicle))
        return self._remember(key, lambda: self._test(self._product(factors, vehicle)))

    def _thrust(self, index: int, vehicle: Vehicle) -> Array:
        """The tested force of a thruster: a gain times that of its shape, less its loss per advance speed."""
        thruster = vehicle.thrusters[index]
        shape = thruster.shape
        push = self._remember(("push", index, shape), lambda: self._test(self._response(thruster, index)[0]))
        force = thruster.gain * push
        if thruster.advance_loss != 0.0:
            water = _water(vehicle)
            lost = self._remember(
                ("load", index, shape, water),
                lambda: self._test(self._response(thruster, index)[1] * self._relative(vehicle)[0]),
            )
            force = force - thruster.advance_loss * lost
        return force

    def _response(self, thruster: Thruster, index: int) -> tuple[Array, Array]:
        """Force for a gain of one [N] and load for an advance loss of one, (1, rows) each."""
        pairs = []
        for motion in self._motions:
            commands, past = motion.commands[:, index], 0
            if motion.run_up is not None:
                commands, past = np.concatenate([motion.run_up[:, index], commands]), motion.run_up.shape[0]
            force, load = thruster.unit.response(commands, motion.time_step)
            pairs.append((force[past:], load[past:]))
        return np.concatenate([p[0] for p in pairs])[None], np.concatenate([p[1] for p in pairs])[None]

    def _rate(self, axis: int, vehicle: Vehicle) -> Array:
        """The tested derivative of a relative velocity, or of a claimed one, (copies, tests)."""
        if self._claim is None:
            return -self._test(self._relative(vehicle)[axis], rate=True)
        claimed = self._claim[axis][None]
        if axis < 2:  # d/dt of the current in body axes
            drift = self._velocity[1 - axis] - self._relative(vehicle)[1 - axis]
            claimed = claimed + (-1.0, 1.0)[axis] * drift * self._velocity[2]
        return self._test(claimed)

    def _product(self, factors: Sequence[str], vehicle: Vehicle) -> Array:
        value = np.ones((1, self._heading.size))
        for factor in factors:
            value = value * self._signal(factor, vehicle)
        return value

    def _signal(self, factor: str, vehicle: Vehicle) -> Array:
        """One factor along the rows, (copies or 1, rows)."""
        if factor == "cos psi":
            return np.cos(self._heading)[None]
        if factor == "sin psi":
            return np.sin(self._heading)[None]
        if factor in _WIND:
            ahead, starboard = self._wind()
            return (ahead, starboard, np.hypot(ahead, starboard))[_WIND.index(factor)]
        if factor in _WAKE:
            return self._wake(self._relative(vehicle)[_WAKE[factor]], vehicle.values["memory_time"])
        value = self._relative(vehicle)["uvr".index(factor.strip("|"))]
        return np.abs(value) if factor.startswith("|") else value

    def _wind(self) -> tuple[Array, Array]:
        air = np.concatenate([np.zeros((m.time.size, 2)) if m.air is None else m.air for m in self._motions])
        return apparent_wind(self._heading, (self._velocity[0], self._velocity[1]), (air[:, 0], air[:, 1]))

    def _wake(self, velocity: Array, constant: float) -> Array:
        found = np.empty_like(velocity)
        for motion, (start, stop) in zip(self._motions, pairwise(self._edges), strict=True):
            for row, kept in zip(velocity[:, start:stop], found[:, start:stop], strict=True):
                kept[:] = first_order_lag(row, constant, motion.time_step)
        return found

    def _relative(self, vehicle: Vehicle) -> tuple[Array, Array, Array]:
        """Velocities relative to the water, (copies, rows) each."""
        water = _water(vehicle)
        if water not in self._waters:
            self._waters[water] = relative_velocity(vehicle, self._heading, tuple(self._velocity))
            if len(self._waters) > _WATERS:
                self._waters.popitem(last=False)
        self._waters.move_to_end(water)
        return self._waters[water]

    @staticmethod
    def _depends(factors: Sequence[str], vehicle: Vehicle) -> tuple[object, ...]:
        """The numbers of a vehicle that a product of signals moves with."""
        found: list[object] = []
        if any(factor.strip("|")[:1] in ("u", "v") or factor == "q_v" for factor in factors if factor not in _WIND):
            found.append(_water(vehicle))
        if any(factor in _WAKE for factor in factors):
            found.append(vehicle.values["memory_time"])
        return tuple(found)

    def _test(self, rows: Array, *, rate: bool = False) -> Array:
        """Rows (copies, n) through the test functions, (copies, tests)."""
        parts = [
            kernel.apply(rows[:, start:stop], kernel.rate if rate else kernel.value)
            for kernel, (start, stop) in zip(self._kernels, pairwise(self._edges), strict=True)
        ]
        return np.concatenate(parts, axis=1)

    def _remember(self, key: tuple[object, ...], compute: Callable[[], Array]) -> Array:
        if key not in self._known:
            value = self._known[key] = compute()
            self._bytes += value.nbytes
            while self._bytes > _REMEMBERED and len(self._known) > 1:
                self._bytes -= self._known.popitem(last=False)[1].nbytes
        self._known.move_to_end(key)
        return self._known[key]


def _water(vehicle: Vehicle) -> tuple[float, float]:
    return vehicle.values["current_north"], vehicle.values["current_east"]
