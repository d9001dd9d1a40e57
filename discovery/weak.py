"""The momentum balance in weak form: no noisy velocity is ever differentiated.

The balance M nu_r_dot = F is multiplied by a smooth, compact test function phi and integrated by parts,
`-int phi' M nu_r dt = int phi F dt` (Messenger and Bortz 2021, eq. 2.4), so that measured and modelled force pass
through the same filter. phi(t) = (1 - (t/T)^2)^p on |t| <= T, scaled to unit area, so the balance keeps the unit of
force [N, N, N m].
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..measurements.alignment import sensor_noise
from ..physics.errors import RequestError
from ..physics.forces import modelled_acceleration, modelled_force, relative_velocity
from ..physics.frames import FORCE_UNITS, Array
from ..physics.matrices import mass_matrix
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .rollouts import rollout_squares

_LEAST_TESTS, _LEAST_BLOCKS = 8, 4
_AT_ONCE = 1024
"""Test functions that are applied in one go."""
_NOISE_SEED = 20040
_QUIET = np.array([1e-4, 1e-4, 1e-4])
"""Noise [m/s, m/s, rad/s] below which a log counts as noise-free, as simulators write it."""


@dataclass(frozen=True, slots=True)
class WeakSettings:
    """How the balance is tested.

    Attributes
    ----------
    half_width : half the support of a test function, T [s]
    stride : distance between test functions [s]
    power : p of the test function
    blocks : most contiguous blocks for held-out scores and block bootstrap; a short log has fewer
    copies : copies of the log with more noise, from which the effect of sensor noise on scores is known
    """

    half_width: float = 0.8
    stride: float = 0.2
    power: int = 3
    blocks: int = 16
    copies: int = 2


class WeakForm:
    """Test functions laid over one or more motions.

    Parameters
    ----------
    motions, settings : what is tested, and how
    claims : (n, 3) accelerations over ground for each motion [m/s^2, m/s^2, rad/s^2] that stand in place of the
        measured ones, as a model claims them. They are functions of the same noisy velocities as the columns, so that
        no sensor noise stands between the two, and open-loop rollouts have no say.

    Attributes
    ----------
    motions : the gap-free stretches; no test function reaches across two of them
    time : (tests,) centre of each test function [s]
    block : (tests,) index of the contiguous block each test function belongs to
    independent : effective number of independent tests (total time / half width)
    noise : (3,) white sensor noise on u, v [m/s] and r [rad/s], estimated from the motions
    memo : results that callers keep with the data they belong to
    linear : columns of damping, mass and thrust do not depend on the model
    step_share : share of a parameter's step by which its column is taken
    forces : the balance is one of forces, so that a lighter hull needs less of it
    claimed : the measured side is what a model claims

    Raises
    ------
    RequestError
        when the motions are too short for a few blocks of test functions.
    """

    linear = True
    step_share = 1.0
    forces = True
    unit = FORCE_UNITS

    def __init__(
        self, motions: Sequence[Motion], settings: WeakSettings, claims: Sequence[Array] | None = None
    ) -> None:
        self.settings = settings
        self.motions = tuple(motions)
        self._claims = None if claims is None else tuple(claims)
        self.claimed = claims is not None
        self.noise = np.zeros(3) if self.claimed else sensor_noise(self.motions)
        rng = np.random.default_rng(_NOISE_SEED)
        copies = settings.copies if (self.noise > _QUIET).any() else 0
        self._noisier = [
            [replace(m, velocity=m.velocity + self.noise * rng.standard_normal(m.velocity.shape)) for m in self.motions]
            for _ in range(copies)
        ]
        self.memo: dict[tuple[object, ...], Array] = {}
        self._kernels: list[tuple[Array, Array, np.ndarray]] = []
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
            self._kernels.append((phi * motion.time_step / area, slope * motion.time_step / area, centres - half))
            times.append(motion.time[centres])
        self.time = np.concatenate(times) if times else np.zeros(0)
        blocks = min(settings.blocks, self.time.size // _LEAST_TESTS)
        if blocks < _LEAST_BLOCKS:
            raise RequestError(
                f"weak form: {self.time.size} test functions of {2 * settings.half_width:g} s fit into the log, "
                f"at least {_LEAST_BLOCKS * _LEAST_TESTS} are needed; give a longer log"
            )
        self.block = np.minimum(np.arange(self.time.size) * blocks // self.time.size, blocks - 1)
        covered = sum(motion.duration for motion in self.motions)
        self.independent = covered / settings.half_width

    def about(self, vehicle: Vehicle) -> "WeakForm":
        """The form in which columns about a vehicle are taken: this one, whatever the vehicle."""
        return self

    def nearer(self, vehicle: Vehicle, moved: Vehicle) -> Vehicle:
        """The model that a Gauss-Newton step reached: forces are all but linear, so a full step is never too long."""
        return moved

    def squares(self, vehicle: Vehicle) -> Array:
        """Mean square velocity errors of 5 s rollouts, (starts, 3), for the second judge; none for claims."""
        return np.zeros((0, 3)) if self.claimed else rollout_squares(self.motions, vehicle)

    def average(self, series: Sequence[Array]) -> Array:
        """int phi f dt for (n, c) series, one for each motion: (tests, c)."""
        return self._apply(series, 0)

    def derivative(self, series: Sequence[Array]) -> Array:
        """int phi f' dt = -int phi' f dt for (n, c) series, one for each motion: (tests, c), per second."""
        return -self._apply(series, 1)

    def _apply(self, series: Sequence[Array], which: int) -> Array:
        parts = []
        for values, kernels in zip(series, self._kernels, strict=True):
            kernel, first = kernels[which], kernels[2]
            windows = np.lib.stride_tricks.sliding_window_view(values, kernel.size, axis=0) if first.size else values
            for k in range(0, first.size, _AT_ONCE):  # picking windows copies them: a long log would need a gigabyte
                parts.append(windows[first[k : k + _AT_ONCE]] @ kernel)
        return np.concatenate(parts)

    def balance(self, vehicle: Vehicle) -> Array:
        """Measured minus modelled force, (tests, 3) [N, N, N m]; zero everywhere for a perfect model and log."""
        return self._balance(vehicle, self.motions)

    def balances(self, vehicle: Vehicle) -> Array:
        """The balance, and that of copies of the log with the sensor noise added once more, (1 + copies, tests, 3).

        The difference between a copy and the log shows what noise does to a column, and so to a model's score.
        """
        return np.stack([self._balance(vehicle, motions) for motions in (self.motions, *self._noisier)])

    def _balance(self, vehicle: Vehicle, motions: Sequence[Motion]) -> Array:
        mass = mass_matrix(vehicle)
        if self._claims is not None:
            pairs = zip(motions, self._claims, strict=True)
            return self.average([(claim - modelled_acceleration(vehicle, m)) @ mass for m, claim in pairs])
        momentum, force = [], []
        for motion in motions:
            relative = relative_velocity(vehicle, motion.heading, tuple(motion.velocity.T))
            momentum.append(np.stack(relative, axis=-1) @ mass)
            force.append(modelled_force(vehicle, motion))
        return self.derivative(momentum) - self.average(force)

    def force_scale(self, vehicle: Vehicle) -> Array:
        """Size of the forces at work on each axis (3,) [N, N, N m].

        The root mean square over the log of the largest single contribution to the balance: inertia, or the model's
        total force, or the thrust on its axis, whichever is larger at the time.
        """
        return np.sqrt((self.largest_force(vehicle) ** 2).mean(axis=0))

    def largest_force(self, vehicle: Vehicle) -> Array:
        """Modulus of the largest single contribution to the balance at each test, (tests, 3) [N, N, N m]."""
        mass = mass_matrix(vehicle)
        rates = self.derivative([motion.velocity for motion in self.motions]) @ mass
        modelled = self.average([modelled_force(vehicle, motion) for motion in self.motions])
        passive = []
        for motion in self.motions:
            still = replace(motion, velocity=np.zeros_like(motion.velocity))
            passive.append(modelled_force(vehicle, still))
        thrust = self.average(passive)
        parts = np.stack([rates, modelled, thrust, modelled - thrust])
        return np.abs(parts).max(axis=0)
