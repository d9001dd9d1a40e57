"""What sensor noise, drawn anew, makes of a force balance.

Noise on a velocity reaches the balance through the inertia, as a rate, and through drag and coupling, as a force. The
second grows with the motion, just where the columns of effects do: it is rare, but it looks like them.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.signals import drawn_noise
from ...physics.forces import modelled_force
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from .tested_terms import Kernel

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Single = NDArray[np.float32]
_STEP = 1e-3
"""Change of a velocity by which forces are differentiated [m/s, m/s, rad/s]."""
_NUMBERS = 500_000
"""Numbers that are drawn at a time: 4 MB, which a processor keeps at hand."""


def sensed(
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
