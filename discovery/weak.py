"""The momentum balance in weak form: no noisy velocity is ever differentiated.

The balance M nu_r_dot = F is multiplied by a smooth, compact test function phi and integrated by parts,
`-int phi' M nu_r dt = int phi F dt` (Messenger and Bortz 2021, eq. 2.4), so that measured and modelled force pass
through the same filter. phi(t) = (1 - (t/T)^2)^p on |t| <= T, scaled to unit area, so the balance keeps the unit of
force [N, N, N m].
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..physics.errors import RequestError
from ..physics.forces import modelled_force, relative_velocity
from ..physics.frames import Array
from ..physics.matrices import mass_matrix
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class WeakSettings:
    """How the balance is tested.

    Attributes
    ----------
    half_width : half the support of a test function, T [s]
    stride : distance between test functions [s]
    power : p of the test function
    blocks : number of contiguous blocks for held-out scores and block bootstrap
    """

    half_width: float = 0.8
    stride: float = 0.2
    power: int = 3
    blocks: int = 16


class WeakForm:
    """Test functions laid over one or more motions.

    Attributes
    ----------
    motions : the gap-free stretches; no test function reaches across two of them
    time : (tests,) centre of each test function [s]
    block : (tests,) index of the contiguous block each test function belongs to
    independent : effective number of independent tests (total time / half width)
    memo : results that callers keep with the data they belong to
    """

    def __init__(self, motions: Sequence[Motion], settings: WeakSettings) -> None:
        self.settings = settings
        self.motions = tuple(motions)
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
        if self.time.size < 4 * settings.blocks:
            raise RequestError(
                f"weak form: {self.time.size} test functions of {2 * settings.half_width:g} s fit into the log, "
                f"at least {4 * settings.blocks} are needed; give a longer log"
            )
        self.block = np.minimum(np.arange(self.time.size) * settings.blocks // self.time.size, settings.blocks - 1)
        covered = sum(motion.duration for motion in self.motions)
        self.independent = covered / settings.half_width

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
            if first.size:
                windows = np.lib.stride_tricks.sliding_window_view(values, kernel.size, axis=0)[first]
                parts.append(windows @ kernel)
        return np.concatenate(parts)

    def noise_gains(self) -> list[float]:
        """For each motion, the root mean square of the tested derivative of white noise of unit deviation [1/s]."""
        return [float(np.sqrt((slope**2).sum())) for _, slope, _ in self._kernels]

    def balance(self, vehicle: Vehicle) -> Array:
        """Measured minus modelled force, (tests, 3) [N, N, N m]; zero everywhere for a perfect model and log."""
        mass = mass_matrix(vehicle)
        momentum, force = [], []
        for motion in self.motions:
            relative = relative_velocity(vehicle, motion.heading, tuple(motion.velocity.T))
            momentum.append(np.stack(relative, axis=-1) @ mass)
            force.append(modelled_force(vehicle, motion))
        return self.derivative(momentum) - self.average(force)

    def force_scale(self, vehicle: Vehicle) -> Array:
        """Size of the forces at work on each axis (3,) [N, N, N m].

        The root mean square over the log of the largest single contribution to the balance: inertia, or the model's
        total force, or the thrust on its axis, whichever is larger at the time.
        """
        mass = mass_matrix(vehicle)
        rates = self.derivative([motion.velocity for motion in self.motions]) @ mass
        modelled = self.average([modelled_force(vehicle, motion) for motion in self.motions])
        passive = []
        for motion in self.motions:
            still = Motion(
                motion.time,
                motion.position,
                motion.heading,
                np.zeros_like(motion.velocity),
                motion.commands,
                motion.thrusters,
            )
            passive.append(modelled_force(vehicle, still))
        thrust = self.average(passive)
        parts = np.stack([rates, modelled, thrust, modelled - thrust])
        return np.sqrt((np.abs(parts).max(axis=0) ** 2).mean(axis=0))
