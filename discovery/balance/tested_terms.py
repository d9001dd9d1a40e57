"""The summands of the momentum balance along a log and its noisier copies, passed through the test functions."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple, final

import numpy as np

from ...physics.forces import thruster_response
from ...physics.frames import Array
from ...physics.momentum_balance import balances
from ...physics.motion import Motion
from ...physics.thrusters import Thruster, first_order_lag
from ...physics.vehicle import Vehicle
from .products import Products, water

_RATES = ("u_dot", "v_dot", "r_dot")


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


@final
class TestedTerms(Products):
    """Products of the balance as (copies, tests), or (1, tests) where no copy differs.

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
        self._claim = None if claims is None else np.concatenate(claims).T
        u, v, r = np.concatenate([np.moveaxis(v, -1, 0) for v in velocities], axis=-1)
        air = [np.zeros((m.time.size, 2)) if m.air is None else m.air for m in motions]
        north, east = np.concatenate(air).T
        super().__init__(np.concatenate([m.heading for m in motions]), (u, v, r), (north, east))

    @property
    def shape(self) -> tuple[int, ...]:
        """(copies, tests)."""
        return self.velocity[0].shape[0], sum(kernel.count for kernel in self._kernels)

    def balances(self, vehicle: Vehicle) -> Array:
        """Inertia less force of a vehicle, (3, copies, tests) [N, N, N m]."""
        lines = balances(vehicle)
        total = -self.summed([line.force for line in lines], vehicle)
        for line, sums in zip(lines, total, strict=True):
            for term in line.inertia:
                axis = _RATES.index(term.factors[0])
                moves = water(vehicle) if axis < 2 else ()
                sums += term.coefficient * self.known.of((axis, *moves), lambda a=axis: self._rate(a, vehicle))
        return total

    def passed(self, rows: Array) -> Array:
        """Rows (copies, n) through the test functions, (copies, tests)."""
        return self._test(rows, [kernel.value for kernel in self._kernels])

    def wake(self, axis: int, vehicle: Vehicle) -> Array:
        """The wake memory from the beginning of each motion, (copies, rows)."""
        velocity, constant = self.relative(vehicle)[axis], vehicle.values["memory_time"]
        found = np.empty_like(velocity)
        for motion, (start, stop) in zip(self._motions, pairwise(self._edges), strict=True):
            for row, kept in zip(velocity[:, start:stop], found[:, start:stop], strict=True):
                kept[:] = first_order_lag(row, constant, motion.time_step)
        return found

    def response(self, index: int, unit: Thruster) -> tuple[Array, Array]:
        """Force [N] and load [N s/m] of a thruster, (1, rows) each: commands have no noise."""
        pairs = [thruster_response(motion, index, unit) for motion in self._motions]
        return np.concatenate([p[0] for p in pairs])[None], np.concatenate([p[1] for p in pairs])[None]

    def _rate(self, axis: int, vehicle: Vehicle) -> Array:
        """The tested derivative of a relative velocity, or of a claimed one, (copies, tests)."""
        if self._claim is None:
            return -self._test(self.relative(vehicle)[axis], [kernel.rate for kernel in self._kernels])
        claimed = self._claim[axis][None]
        if axis < 2:  # less what the turning of the current adds over ground
            drift = self.velocity[1 - axis] - self.relative(vehicle)[1 - axis]
            claimed = claimed + (-1.0, 1.0)[axis] * drift * self.velocity[2]
        return self.passed(claimed)

    def _test(self, rows: Array, weights: Sequence[Array]) -> Array:
        pieces = zip(self._kernels, weights, pairwise(self._edges), strict=True)
        return np.concatenate([kernel.apply(rows[:, a:b], weight) for kernel, weight, (a, b) in pieces], axis=1)
