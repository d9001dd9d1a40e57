"""The momentum balance in weak form: no noisy velocity is ever differentiated.

The balance M nu_r_dot = F is multiplied by a smooth, compact test function phi and integrated by parts,
`-int phi' M nu_r dt = int phi F dt` (Messenger and Bortz 2021, eq. 2.4), so that measured and modelled force pass
through the same filter. phi(t) = (1 - (t/T)^2)^p on |t| <= T, scaled to unit area, so the balance keeps the unit of
force [N, N, N m].
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.white_noise import drawn_noise, sensor_noise
from ...physics.delays_and_lags import first_order_lag
from ...physics.errors import RequestError
from ...physics.forces import CURRENT, Triple, modelled_force, remembered_before
from ...physics.frames import FORCE_UNITS, Array, earth_to_body
from ...physics.matrices import mass_matrix
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from .base import LEAST_NOISE, SEEING, Balance, Neighbourhood, WeakSettings
from .forces_along import ColumnCache, ForcesAlong, LatestTwo, ThrusterResponses
from .rollout_test import HORIZON, overlap_of, rollout_squares

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["WeakForm", "WeakSettings"]

LEAST_TESTS, _LEAST_BLOCKS = 8, 4
"""Test functions in a block, which at the usual stride is then as long as one of them; and blocks, of which one that is
held out is a quarter of the log."""
_NOISE_SEED = 20040
"""Any number: the same noise is drawn for every model, so that two of them can be compared."""
_TOGETHER = 65_536
"""Numbers that go through the test functions at once: calls are few, and memory is little beside any log's columns."""
_STEP = 1e-3
"""Change of a velocity by which forces are differentiated [m/s, m/s, rad/s]."""
_DRAWN = 500_000
"""Numbers that are drawn at once: 4 MB, which a processor keeps at hand."""


class Kernel(NamedTuple):
    """Test functions over one motion: weights of a value and of a rate, rows between two, and how many there are."""

    value: Array
    rate: Array
    stride: int
    count: int

    @classmethod
    def over(cls, motion: Motion, settings: WeakSettings) -> "Kernel":
        """Those that fit into a motion."""
        step, power = motion.time_step, settings.power
        half, stride = max(2, round(settings.half_width / step)), max(1, round(settings.stride / step))
        grid = np.arange(-half, half + 1) / half
        phi = (1.0 - grid**2) ** power
        slope = -2.0 * power * grid * (1.0 - grid**2) ** (power - 1) / (half * step)
        area = phi.sum() * step
        return cls(
            phi * (step / area), slope * (step / area), stride, len(range(half, motion.time.size - half, stride))
        )

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
class WeakForm(Balance):
    """Test functions laid over one or more motions: a balance of forces, see `Balance`.

    Parameters
    ----------
    motions, settings : what is tested, and how
    claims : (n, 3) accelerations over ground for each motion [m/s^2, m/s^2, rad/s^2] that stand in place of the
        measured ones, as a model claims them. They are functions of the same noisy velocities as the columns, so that
        no sensor noise stands between the two, and open-loop rollouts have no say.

    Attributes
    ----------
    independent : total time over half width
    claimed : the measured side is what a model claims

    Raises
    ------
    RequestError
        when there is no motion, or the motions are too short for a few blocks of test functions.
    """

    unit: ClassVar[tuple[str, str, str]] = FORCE_UNITS
    forces: ClassVar[bool] = True

    def __init__(
        self, motions: Sequence[Motion], settings: WeakSettings, claims: Sequence[Array] | None = None
    ) -> None:
        self.settings = self.tests = settings
        self.motions, self.blind, self.bins, self.sources = tuple(motions), SEEING, 1, []
        self.overlap = overlap_of(HORIZON)
        if not self.motions:
            raise RequestError("weak form: expected at least one motion, got none; give a log")
        self.claimed = claims is not None
        self.noise = np.zeros(3) if self.claimed else sensor_noise(self.motions)
        rng = np.random.default_rng(_NOISE_SEED)
        copies = settings.copies if (self.noise > LEAST_NOISE).any() else 0
        drawn = [[drawn_noise(m, self.noise, rng) for m in self.motions] for _ in range(0, copies, 2)]
        drawn = [[sign * part for part in one] for one in drawn for sign in (1.0, -1.0)][:copies]
        self._kernels = [Kernel.over(motion, settings) for motion in self.motions]
        self._edges = np.cumsum([0, *(m.time.size for m in self.motions)])
        measured = np.concatenate([m.velocity for m in self.motions])
        u, v, r = np.stack([measured, *(measured + np.concatenate(noise) for noise in drawn)]).transpose(2, 0, 1)
        heading, minutes = (
            np.concatenate(s) for s in zip(*((m.heading, m.minutes) for m in self.motions), strict=True)
        )
        north, east = np.concatenate([np.zeros((m.time.size, 2)) if m.air is None else m.air for m in self.motions]).T
        thrusters = ThrusterResponses(self.motions, partial(np.concatenate, axis=1))
        self._along = ForcesAlong(heading, (u, v, r), (north, east), minutes, thrusters, self._memory)
        self._claim = None if claims is None else np.concatenate(claims).T[:, None]
        self._sides: LatestTwo[tuple[Array, Array]] = LatestTwo(self._both_sides)
        self._columns = ColumnCache()
        self._sensed: tuple[tuple[Vehicle, int, int], NDArray[np.float32]] | None = None
        half = settings.half_width
        centres = [k.value.size // 2 + k.stride * np.arange(k.count) for k in self._kernels]
        self.time = np.concatenate([m.time[rows] for m, rows in zip(self.motions, centres, strict=True)])
        # Of one block nothing is held out, so that it may be as short as a window that is followed live.
        alone = settings.blocks == 1 and self.time.size > 0
        blocks = 1 if alone else min(settings.blocks, self.time.size // LEAST_TESTS)
        if blocks < _LEAST_BLOCKS and not alone:
            raise RequestError(
                f"weak form: {self.time.size} test functions of {2 * half:g} s fit into the log, "
                f"at least {_LEAST_BLOCKS * LEAST_TESTS} are needed; give a longer log"
            )
        self.block = np.minimum(np.arange(self.time.size) * blocks // self.time.size, blocks - 1)
        self.independent = sum(motion.duration for motion in self.motions) / half

    @property
    def reach(self) -> tuple[np.ndarray, Array, Array]:
        """See `Balance.reach`: half a width of a test function on either side."""
        number = np.repeat(np.arange(len(self.motions)), [kernel.count for kernel in self._kernels])
        return number, self.time - self.settings.half_width, self.time + self.settings.half_width

    def of_switches(self, vehicle: Vehicle) -> Array | None:
        """See `Balance.of_switches`, [N, N, N m]; None where accelerations are claimed.

        By the formula of Euler and Maclaurin (Abramowitz and Stegun 1964, 23.1.30) a sum errs by h^2/12 times the jump
        of the integrand's slope at a row. Where thrust jumps by F, that is phi' F for momentum and as much again for
        force; where it does not jump, nothing. So it is a bound: records that are averages of the commands, or late,
        leave less.
        """
        if self.claimed:
            return None
        jumps = [np.gradient(_at_rest(vehicle, m), axis=0) * (m.time_step / 6.0) for m in self.motions]
        return -self.derivative(jumps)

    def forget(self) -> None:
        """Keep no columns: they are most of the memory of a search, and made again where asked for."""
        self._columns.clear()
        self._sides.clear()
        self._sensed = None

    def about(self, vehicle: Vehicle) -> Neighbourhood:
        """The same for every vehicle; the form does not keep it, so that it is gone with the last who asked for it."""
        return Neighbourhood(self.balances, self._difference, self._columns, linear=True)

    def nearer(self, vehicle: Vehicle, moved: Vehicle) -> Vehicle:
        """The whole step: forces are all but linear, so it is never too long."""
        return moved

    def refreshed(self, about: Vehicle) -> "WeakForm":
        """The same form: none of its weights depends on a model."""
        return self

    def squares(self, vehicle: Vehicle) -> Array:
        """Mean square velocity errors of 5 s rollouts, (starts, 3), for the second judge; none for claims."""
        return np.zeros((0, 3)) if self.claimed else rollout_squares(self.motions, vehicle)

    @property
    def speeds(self) -> Array:
        """Passed through the test functions."""
        return self.average([motion.velocity for motion in self.motions])

    def signals(self, vehicle: Vehicle) -> tuple[Triple, list[Array], Array, Array, Array]:
        """What forces follow, along the rows of all motions.

        Velocities through the water [m/s, m/s, rad/s], (1 + copies, rows) each; the force of each thruster [N], the
        heading [rad] and the minutes since the beginning of the log, (rows,) each; and the place (2, rows) north, east
        [m].
        """
        place = np.concatenate([motion.position for motion in self.motions]).T
        along = self._along
        return along.relative(vehicle), list(along.thrusters.of(vehicle)[0]), along.heading, along.minutes, place

    def passed(self, rows: Array) -> Array:
        """Series along the rows of all motions (..., rows) through the test functions, (..., tests)."""
        return self._apply(rows, [kernel.value for kernel in self._kernels])

    def average(self, series: Sequence[Array]) -> Array:
        """int phi f dt for (n, c) series, one for each motion: (tests, c)."""
        return self.passed(np.concatenate(series).T).T

    def derivative(self, series: Sequence[Array]) -> Array:
        """int phi f' dt = -int phi' f dt for (n, c) series, one for each motion: (tests, c), per second."""
        return -self._apply(np.concatenate(series).T, [kernel.rate for kernel in self._kernels]).T

    def _apply(self, rows: Array, weights: Sequence[Array]) -> Array:
        pieces = zip(self._kernels, weights, pairwise(self._edges), strict=True)
        return np.concatenate([kernel.apply(rows[..., a:b], weight) for kernel, weight, (a, b) in pieces], axis=-1)

    def balance(self, vehicle: Vehicle) -> Array:
        """Measured minus modelled force, (tests, 3) [N, N, N m]; zero everywhere for a perfect model and log."""
        return self.balances(vehicle)[0]

    def balances(self, vehicle: Vehicle) -> Array:
        """The balance, and that of copies of the log with the sensor noise added once more, (1 + copies, tests, 3).

        The difference between a copy and the log shows what noise does to a column, and so to a model's score. Copies
        come in pairs of opposite noise, whose mean differs from the log only by what bends: noise on r makes a mean of
        |r| r.
        """
        return self._tested(*self._sides.of(vehicle))

    def _difference(self, one: Vehicle, other: Vehicle) -> Array:
        changed = self._along.change(one, other)
        if changed is None:
            momentum, force = (a - b for a, b in zip(self._sides.of(one), self._sides.of(other), strict=True))
            return self._tested(momentum, force)
        mass = mass_matrix(one) - mass_matrix(other)
        return self._tested(self._momentum(mass, other) if mass.any() else np.zeros((3, 1, 1)), changed)

    def _both_sides(self, vehicle: Vehicle) -> tuple[Array, Array]:
        """Momentum and modelled force along the rows, (3, 1 + copies, rows) each; of claims, the rate of momentum."""
        return self._momentum(mass_matrix(vehicle), vehicle), np.stack(self._along.of(vehicle))

    def _momentum(self, mass: Array, vehicle: Vehicle) -> Array:
        relative = self._along.relative(vehicle)
        return np.tensordot(mass, np.stack(relative if self._claim is None else self._through_water(vehicle)), 1)

    def _through_water(self, vehicle: Vehicle) -> list[Array]:
        """Claimed accelerations less those of the water along the turning hull."""
        assert self._claim is not None
        (u, v, r), (claimed_u, claimed_v, claimed_r) = self._along.velocity, self._claim
        relative = self._along.relative(vehicle)
        ahead, starboard = earth_to_body(self._along.heading, *(vehicle.values[s] / 60.0 for s in CURRENT[2:]))
        return [claimed_u - (v - relative[1]) * r - ahead, claimed_v + (u - relative[0]) * r - starboard, claimed_r]

    def _memory(self, vehicle: Vehicle, relative: Triple) -> tuple[Array, Array]:
        """The wake memory of sway speed and yaw rate from what it holds at the beginning of each motion."""
        constant, found = vehicle.values["memory_time"], (np.empty_like(relative[1]), np.empty_like(relative[2]))
        for motion, (start, stop) in zip(self.motions, pairwise(self._edges), strict=True):
            for series, filtered, begin in zip(relative[1:], found, remembered_before(vehicle, motion), strict=True):
                for row, kept in zip(series[:, start:stop], filtered[:, start:stop], strict=True):
                    kept[:] = first_order_lag(row, constant, motion.time_step, begin)
        return found

    def _tested(self, momentum: Array, force: Sequence[Array] | Array) -> Array:
        """Rate of momentum less force, (copies, rows) by axis, through the test functions, (1 + copies, tests, 3)."""
        found = np.zeros((len(self._along.velocity[0]), self.time.size, 3))
        for axis in range(3):
            if momentum[axis].any():
                rate = self.passed if self.claimed else self._rate
                found[..., axis] = rate(momentum[axis])
            if force[axis].any():
                found[..., axis] -= self.passed(force[axis])
        return found

    def _rate(self, rows: Array) -> Array:
        return -self._apply(rows, [kernel.rate for kernel in self._kernels])

    def sensed(self, vehicle: Vehicle, copies: int, seed: int) -> NDArray[np.float32] | None:
        """See `Balance.sensed`, to first order in the noise; the last draws are kept, for whoever asks for them again.

        Noise on a velocity reaches the balance through the inertia, as a rate, and through drag and coupling, as a
        force. The second grows with the motion, just where the columns of effects do: it is rare, but looks like them.
        """
        if not (self.noise > LEAST_NOISE).any():
            return None
        asked = (vehicle, copies, seed)
        if self._sensed is None or self._sensed[0] != asked:
            rng, parts = np.random.default_rng([seed, copies]), []
            for motion, kernel in zip(self.motions, self._kernels, strict=True):
                response = _response(vehicle, motion, kernel)
                found = np.empty((3, copies, kernel.count), np.float32)
                at_once = max(1, _DRAWN // motion.velocity.size)
                for start in range(0, copies, at_once):
                    some = found[:, start : start + at_once]
                    drawn = drawn_noise(motion, self.noise, rng, some.shape[1]).astype(np.float32)
                    heard = response @ drawn.reshape(some.shape[1], -1).T
                    some[:] = heard.reshape(3, kernel.count, -1).transpose(0, 2, 1)
                parts.append(found)
            self._sensed = asked, np.concatenate(parts, axis=2)
        return self._sensed[1]

    def recorded(self, motions: Sequence[Motion], vehicle: Vehicle) -> Array:
        """See `Balance.recorded`, [N, N, N m]."""
        return WeakForm(motions, replace(self.settings, copies=0)).balance(vehicle)

    def largest_force(self, vehicle: Vehicle) -> Array:
        """The largest of inertia, the model's total force, and the thrust on its axis, (tests, 3) [N, N, N m]."""
        rates = self.derivative([motion.velocity for motion in self.motions]) @ mass_matrix(vehicle)
        modelled = self.passed(self._sides.of(vehicle)[1][:, 0]).T
        thrust = self.average([_at_rest(vehicle, motion) for motion in self.motions])
        return np.abs(np.stack([rates, modelled, thrust, modelled - thrust])).max(axis=0)


def _at_rest(vehicle: Vehicle, motion: Motion) -> Array:
    """The force on a boat that does not move under the same commands, (n, 3) [N, N, N m]."""
    return modelled_force(vehicle, replace(motion, velocity=np.zeros_like(motion.velocity), past=None))


def _response(vehicle: Vehicle, motion: Motion, kernel: Kernel) -> "csr_array":
    """What a change of each velocity of each row makes of each test on each axis, (3 tests, 3 rows)."""
    from scipy.sparse import csr_array  # half a second, which only logs with noise need

    slopes = []  # of the modelled force by each velocity, by central differences
    for step in _STEP * np.eye(3):
        up, down = (replace(motion, velocity=motion.velocity + sign * step) for sign in (1.0, -1.0))
        slopes.append((modelled_force(vehicle, up) - modelled_force(vehicle, down)) / (2.0 * _STEP))
    count, width = kernel.count, kernel.value.size
    rows = kernel.stride * np.arange(count)[:, None] + np.arange(width)
    forces = np.stack(slopes, axis=2)[rows] * kernel.value[:, None, None]  # (tests, width, axes, velocities)
    weights = -(forces + kernel.rate[:, None, None] * mass_matrix(vehicle)).transpose(2, 0, 1, 3).astype(np.float32)
    columns = np.broadcast_to(3 * rows[..., None] + np.arange(3), weights.shape)
    ends = 3 * width * np.arange(3 * count + 1)
    return csr_array((weights.ravel(), columns.ravel(), ends), shape=(3 * count, motion.velocity.size))
