"""The momentum balance in weak form, which differentiates no measured velocity, and what sensor noise adds to it.

M nu_r_dot = F is multiplied by a smooth, compact test function phi and integrated by parts,
`-int phi' M nu_r dt = int phi F dt` (Messenger and Bortz 2021, eq. 2.4): both sides pass the same filter, and with phi
of unit area, phi(t) ~ (1 - (t/T)^2)^p on |t| <= T, the balance keeps the unit of force [N, N, N m]. Noise on a velocity
enters through the inertia and, growing with speed, through drag and coupling, where it looks like an effect's column.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.signals import drawn_noise, sensor_noise
from ...physics.errors import RequestError
from ...physics.forces import modelled_force
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import FORCE_UNITS, Array, Motion
from ...physics.vehicle import Vehicle
from .base import LEAST_NOISE, MANY, Balance, Neighbourhood, Remembered, WeakSettings, cache_limit
from .products import Kernel, TestedTerms
from .shooting import rollout_overlap, rollout_squares
from .starts import HORIZON

if TYPE_CHECKING:
    from scipy.sparse import csr_array


Single = NDArray[np.float32]
_STEP = 1e-3
"""Change of a velocity by which forces are differentiated [m/s, m/s, rad/s]."""
_NUMBERS = 500_000
"""Numbers that are drawn at a time: 4 MB, which a processor keeps at hand."""


def propagate_noise(
    motions: Sequence[Motion], kernels: Sequence[Kernel], noise: Array, vehicle: Vehicle, copies: int, seed: int
) -> Single:
    """The balance of copies of a log less that of the log, to first order in the noise, (3, copies, tests) [N, N, N m].

    Parameters
    ----------
    motions, kernels : the log, and the test functions over each of its stretches
    noise : (3,) white sensor noise on u, v [m/s] and r [rad/s]
    vehicle : whose balance it is
    copies, seed : how many are drawn, and from where
    """
    rng, parts = np.random.default_rng([seed, copies]), []
    for motion, kernel in zip(motions, kernels, strict=True):
        passed, found = _passed(vehicle, motion, kernel), np.empty((3, copies, kernel.count), np.float32)
        at_once = max(1, _NUMBERS // motion.velocity.size)
        for start in range(0, copies, at_once):
            some = found[:, start : start + at_once]
            drawn = drawn_noise(motion, noise, rng, some.shape[1]).astype(np.float32)
            some[:] = (passed @ drawn.reshape(some.shape[1], -1).T).reshape(3, kernel.count, -1).transpose(0, 2, 1)
        parts.append(found)
    return np.concatenate(parts, axis=2)


def _passed(vehicle: Vehicle, motion: Motion, kernel: Kernel) -> "csr_array":
    """What a change of each velocity of each row makes of each test on each axis, (3 tests, 3 rows)."""
    from scipy.sparse import csr_array  # half a second, which only logs with noise need

    count, width = kernel.count, kernel.value.size
    rows = kernel.stride * np.arange(count)[:, None] + np.arange(width)
    forces = _slopes(vehicle, motion)[rows] * kernel.value[:, None, None]  # (tests, width, axes, velocities)
    rates = kernel.rate[:, None, None] * mass_matrix(vehicle)
    weights = -(forces + rates).transpose(2, 0, 1, 3).astype(np.float32)
    columns = np.broadcast_to(3 * rows[..., None] + np.arange(3), weights.shape)
    ends = 3 * width * np.arange(3 * count + 1)
    return csr_array((weights.ravel(), columns.ravel(), ends), shape=(3 * count, motion.velocity.size))


def _slopes(vehicle: Vehicle, motion: Motion) -> Array:
    """Change of the modelled force with each velocity along a motion, (n, 3, 3), by central differences."""
    found = []
    for step in _STEP * np.eye(3):
        up, down = (replace(motion, velocity=motion.velocity + sign * step) for sign in (1.0, -1.0))
        found.append((modelled_force(vehicle, up) - modelled_force(vehicle, down)) / (2.0 * _STEP))
    return np.stack(found, axis=2)


__all__ = ["WeakForm", "WeakSettings"]

LEAST_TESTS, _LEAST_BLOCKS = 8, 4
"""Test functions in a block, which at the usual stride is then as long as one of them; and blocks, for all of three
agree by chance in one log of four."""
_NOISE_SEED = 20040
"""Any number: the same noise is drawn for every model, so that two of them can be compared."""


@final
class WeakForm(Balance):
    """Test functions laid over one or more motions: a balance of forces, see `Balance`.

    Parameters
    ----------
    motions, settings : what is tested, and how
    claims : (n, 3) accelerations over ground for each motion [m/s^2, m/s^2, rad/s^2] that stand in place of the
        measured ones, as a model claims them. They are functions of the same noisy velocities as the columns, so that
        no sensor noise stands between the two, and open-loop rollouts have no say.
    like : the form of other motions of the same boat, whose work on vehicles is not done again

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
        self,
        motions: Sequence[Motion],
        settings: WeakSettings,
        claims: Sequence[Array] | None = None,
        like: "WeakForm | None" = None,
    ) -> None:
        self.settings = self.tests = settings
        self.bins, self.overlap, self.sources = 1, rollout_overlap(HORIZON), []
        self.motions = tuple(motions)
        if not self.motions:
            raise RequestError("weak form: expected at least one motion, got none; give a log")
        self.claimed = claims is not None
        self.noise = np.zeros(3) if self.claimed else sensor_noise(self.motions)
        rng = np.random.default_rng(_NOISE_SEED)
        copies = settings.copies if (self.noise > LEAST_NOISE).any() else 0
        drawn = [[drawn_noise(m, self.noise, rng) for m in self.motions] for _ in range(0, copies, 2)]
        drawn = [[sign * part for part in one] for one in drawn for sign in (1.0, -1.0)][:copies]
        velocities = [
            np.stack([m.velocity, *(m.velocity + noise[k] for noise in drawn)]) for k, m in enumerate(self.motions)
        ]
        self._kernels: list[Kernel] = []
        times = []
        for motion in self.motions:
            half = max(2, round(settings.half_width / motion.time_step))
            grid = np.arange(-half, half + 1) / half
            phi = (1.0 - grid**2) ** settings.power
            area = phi.sum() * motion.time_step
            slope = -2.0 * settings.power * grid * (1.0 - grid**2) ** (settings.power - 1)
            slope = slope / (half * motion.time_step)
            stride = max(1, round(settings.stride / motion.time_step))
            centres = np.arange(half, motion.time.size - half, stride)
            scale = motion.time_step / area
            self._kernels.append(Kernel(phi * scale, slope * scale, stride, centres.size))
            times.append(motion.time[centres])
        self._terms = TestedTerms(
            self.motions, velocities, self._kernels, claims, None if like is None else like._terms
        )
        self._memo: Remembered[Array] = Remembered(cache_limit(MANY, (3, *self._terms.shape)))
        self._sensed: tuple[tuple[Vehicle, int, int], Single] | None = None
        self.time = np.concatenate(times)
        # Of one block nothing is held out, so that it may be as short as a window that is followed live.
        alone = settings.blocks == 1 and self.time.size > 0
        blocks = 1 if alone else min(settings.blocks, self.time.size // LEAST_TESTS)
        if blocks < _LEAST_BLOCKS and not alone:
            raise RequestError(
                f"weak form: {self.time.size} test functions of {2 * settings.half_width:g} s fit into the log, "
                f"at least {_LEAST_BLOCKS * LEAST_TESTS} are needed; give a longer log"
            )
        self.block = np.minimum(np.arange(self.time.size) * blocks // self.time.size, blocks - 1)
        covered = sum(motion.duration for motion in self.motions)
        self.independent = covered / settings.half_width

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
        found = []
        for motion, kernel in zip(self.motions, self._kernels, strict=True):
            still = replace(motion, velocity=np.zeros_like(motion.velocity), past=None)
            jumps = np.gradient(modelled_force(vehicle, still), axis=0)
            found.append(motion.time_step / 6.0 * kernel.apply(jumps.T, kernel.rate).T)
        return np.concatenate(found)

    def forget(self) -> None:
        """Keep no columns and no products: they are most of the memory of a search, and made again where asked for."""
        self._memo.clear()
        self._terms.forget()
        self._sensed = None

    def about(self, vehicle: Vehicle) -> Neighbourhood:
        """The same for every vehicle; the form does not keep it, so that it is gone with the last who asked for it."""
        return Neighbourhood(self.noisy_residuals, self._difference, self._memo, self._unit)

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

    def signals(self, vehicle: Vehicle) -> tuple[tuple[Array, Array, Array], list[Array], Array, Array, Array]:
        """What forces follow, along the rows of all motions.

        Velocities through the water [m/s, m/s, rad/s], (1 + copies, rows) each; the force of each thruster [N], the
        heading [rad] and the minutes since the beginning of the log, (rows,) each; and the place (2, rows) north, east
        [m].
        """
        terms = self._terms
        thrusts = [terms.response(index, thruster)[0][0] for index, thruster in enumerate(vehicle.thrusters)]
        place = np.concatenate([motion.position for motion in self.motions]).T
        return terms.relative(vehicle), thrusts, terms.heading, terms.minutes, place

    def passed(self, rows: Array) -> Array:
        """Series along the rows of all motions (..., rows) through the test functions, (..., tests)."""
        return self._terms.passed(rows)

    def average(self, series: Sequence[Array]) -> Array:
        """int phi f dt for (n, c) series, one for each motion: (tests, c)."""
        pairs = zip(self._kernels, series, strict=True)
        return np.concatenate([kernel.apply(values.T, kernel.value).T for kernel, values in pairs])

    def derivative(self, series: Sequence[Array]) -> Array:
        """int phi f' dt = -int phi' f dt for (n, c) series, one for each motion: (tests, c), per second."""
        pairs = zip(self._kernels, series, strict=True)
        return np.concatenate([-kernel.apply(values.T, kernel.rate).T for kernel, values in pairs])

    def residual(self, vehicle: Vehicle) -> Array:
        """Measured minus modelled force, (tests, 3) [N, N, N m]; zero everywhere for a perfect model and log."""
        return self.noisy_residuals(vehicle)[0]

    def noisy_residuals(self, vehicle: Vehicle) -> Array:
        """The balance, and that of copies of the log with the sensor noise added once more, (1 + copies, tests, 3).

        The difference between a copy and the log shows what noise does to a column, and so to a model's score. Copies
        come in pairs of opposite noise, whose mean differs from the log only by what bends: noise on r makes a mean of
        |r| r.
        """
        return self._terms.balances(vehicle).transpose(1, 2, 0)

    def propagated_noise(self, vehicle: Vehicle, copies: int, seed: int) -> Single | None:
        """See `Balance.propagated_noise`; the last draws are kept, for whoever asks for the same ones."""
        if not (self.noise > LEAST_NOISE).any():
            return None
        asked = (vehicle, copies, seed)
        if self._sensed is None or self._sensed[0] != asked:
            self._sensed = asked, propagate_noise(self.motions, self._kernels, self.noise, *asked)
        return self._sensed[1]

    def recorded(self, motions: Sequence[Motion], vehicle: Vehicle) -> Array:
        """See `Balance.recorded`, [N, N, N m]."""
        return WeakForm(motions, replace(self.settings, copies=0)).residual(vehicle)

    def _difference(self, one: Vehicle, other: Vehicle) -> Array:
        return self._terms.difference(one, other).transpose(1, 2, 0)

    def _unit(self, about: Vehicle, symbol: str, beside: tuple[object, ...]) -> Array:
        return self._terms.unit(about, symbol, beside).transpose(1, 2, 0)

    def largest_contribution(self, vehicle: Vehicle) -> Array:
        """The largest of inertia, the model's total force, and the thrust on its axis, (tests, 3) [N, N, N m]."""
        rates = self.derivative([motion.velocity for motion in self.motions]) @ mass_matrix(vehicle)
        modelled = self._terms.forces(vehicle)[:, 0].T
        still = [replace(motion, velocity=np.zeros_like(motion.velocity), past=None) for motion in self.motions]
        thrust = self.average([modelled_force(vehicle, motion) for motion in still])
        parts = np.stack([rates, modelled, thrust, modelled - thrust])
        return np.abs(parts).max(axis=0)
