"""White noise on a record, told from differences in which smooth motion cancels."""

from collections.abc import Callable, Sequence
from math import comb

import numpy as np

from ...physics.frames import Array
from ...physics.motion import Motion
from .robust import spread


def noise_of_differences(differences: Array, order: int) -> float:
    """Standard deviation of the white noise that makes differences of some order, in the record's unit.

    Differences of order k of white noise of variance 1 have the variance (2 k over k): 6 for second ones, 20 for third.
    """
    return float(spread(differences) / np.sqrt(comb(2 * order, order)))


def noise_level(values: Array) -> float | None:
    """Estimate the white noise on an evenly sampled record (n,), in its unit; None for fewer than ten values.

    From third differences; the median makes single jumps harmless. Motion faster than a few samples counts as noise, so
    this is an upper limit.
    """
    return noise_of_differences(np.diff(values, 3), 3) if values.size >= 10 else None


_DIFFERENCED = np.sqrt(2.0 / 1.4)
"""What third differences miss of the noise on a central difference: of 2 parts of its variance they tell 28/20."""


def drawn_noise(motion: Motion, level: Array, rng: np.random.Generator, *copies: int) -> Array:
    """Noise like that on the velocities of a motion, drawn anew, (*copies, n, 3) [m/s, m/s, rad/s].

    Parameters
    ----------
    level : (3,) as `sensor_noise` tells it
    """
    return _as_derived(rng.standard_normal((*copies, *motion.velocity.shape)), motion) * level


def filtered_noise(motion: Motion, level: Array, low_pass: Callable[[Array], Array]) -> Array:
    """Mean square of the noise on the velocities of a motion that a linear filter leaves, (3,) [m^2/s^2, rad^2/s^2].

    White noise keeps the sum of the squares of the filter's answer to a single row.

    Parameters
    ----------
    level : (3,) as `sensor_noise` tells it
    low_pass : filters columns (n, 3) along the first axis
    """
    single = np.zeros_like(motion.velocity)
    single[len(single) // 2] = 1.0
    return np.asarray((low_pass(_as_derived(single, motion)) ** 2).sum(axis=0) * level**2)


def _as_derived(white: Array, motion: Motion) -> Array:
    """White noise (..., n, 3) as it stands on the velocities of a motion.

    That of velocities that are derivatives is the difference of a white one two steps apart, which all but vanishes in
    an average over seconds.
    """
    for axis in np.flatnonzero(motion.derived):
        column = white[..., axis]
        white[..., axis] = _DIFFERENCED * (np.roll(column, -1, axis=-1) - np.roll(column, 1, axis=-1)) / np.sqrt(2.0)
    return white


def sensor_noise(motions: Sequence[Motion]) -> Array:
    """White noise on readings of u, v [m/s] and r [rad/s], (3,): what an average over many rows meets.

    Readings that were averaged onto even times had more of it than rows show, see `Motion.understated`.
    """
    return _joined(motions, np.array([motion.understated for motion in motions]))


def noise_on_rows(motions: Sequence[Motion]) -> Array:
    """White noise on rows of u, v [m/s] and r [rad/s], (3,): what differences of neighbours meet."""
    return _joined(motions, np.ones((len(motions), 3)))


def _joined(motions: Sequence[Motion], understated: Array) -> Array:
    """Root mean square over the motions, weighted by their rows."""
    levels = np.array([[noise_level(m.velocity[:, axis]) or 0.0 for axis in range(3)] for m in motions])
    rows = np.array([m.time.size for m in motions], dtype=float)
    return np.sqrt((levels**2 * understated * rows[:, None]).sum(axis=0) / rows.sum())
