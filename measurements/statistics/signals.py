"""Signals: peaks between samples, running means, filters without delay, and white noise from differences."""

from collections.abc import Callable, Sequence
from math import comb

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...physics.motion import Array, Motion
from .blocks import spread


def turning_point(before: float, here: float, after: float) -> float:
    """Steps from the middle of three values to where the parabola through them turns; none where they lie in a line.

    >>> turning_point(4.0, 1.0, 0.0)  # (x - 1)^2 at -1, 0, 1
    1.0
    """
    bend = before - 2.0 * here + after
    return 0.5 * (before - after) / bend if abs(bend) > 0.0 else 0.0


def running_mean(values: Array, rows: int) -> Array:
    """The mean of so many rows about each one of `values` (n, ...), the ends mirrored; of an even number one before.

    >>> running_mean(np.array([0.0, 3.0, 6.0]), 3).tolist()
    [1.0, 3.0, 5.0]
    """
    around = [(rows // 2, rows - 1 - rows // 2), *[(0, 0)] * (values.ndim - 1)]
    total = np.cumsum(np.pad(values, around, mode="symmetric"), axis=0)
    total[rows:] -= total[:-rows].copy()
    return np.asarray(total[rows - 1 :] / rows)


def running_median(values: Array, rows: int) -> Array:
    """The median of an odd number of rows about each one of `values` (n, ...), the ends held.

    >>> running_median(np.array([0.0, 9.0, 1.0, 2.0]), 3).tolist()
    [0.0, 1.0, 2.0, 2.0]
    """
    around = [(rows // 2, rows // 2), *[(0, 0)] * (values.ndim - 1)]
    windows = sliding_window_view(np.pad(values, around, mode="edge"), rows, axis=0)
    return np.asarray(np.median(windows, axis=-1))


_FACTOR = 7
"""Digits of the largest factor that a length may have: a Fourier transform of a large prime takes ten times as long."""


def low_pass(values: Array, step: float, cutoff: float, order: int, padding: int) -> Array:
    """Butterworth low-pass, forward and backward, along the first axis of `values` (n, ...), sampled every `step` [s].

    Forward and backward through a Butterworth filter, a record keeps the squared modulus of its response, known in
    closed form; it is applied to the spectrum of the record and its mirror image. `scipy.signal` does the same by
    recursion; they differ at the ends, where neither knows what came before.

    Parameters
    ----------
    cutoff : -3 dB frequency of one pass [Hz]
    order : of one pass
    padding : rows by which both ends are continued, as what they mirror with the other sign; at most n - 1
    """
    edge = _warped(np.array(cutoff), step)
    return _kept(values, step, order, padding, lambda at: at / edge)


def band_pass(values: Array, step: float, band: tuple[float, float], order: int, padding: int) -> Array:
    """The same of a band [Hz], which ends below half the rate.

    Parameters
    ----------
    values : (n, ...)
    step : [s]
    band : its ends [Hz]
    order : of the filter, one way
    padding : rows that are mirrored at each end
    """
    low, high = _warped(np.array(band), step)
    return _kept(values, step, order, padding, lambda at: (at - low * high / at) / (high - low))


LEAST_CORRELATION = 0.7
"""Correlation from which two records tell of the same motion, or, negative, of opposite ones: half of the variance of
one is that of the other."""
_BAND = (0.05, 1.0)
"""Motion slower or faster than this [Hz] is left out of the comparison: below is drift, above is noise of
derivatives."""
_AT_ONCE = 1 << 18
"""Values that are filtered at once: 2 MB, of which the filter makes some five copies."""


def drift_free(rate: Array, step: float) -> Array:
    """Integrate rates (n, ...) sampled every `step` [s], and keep 0.05 to 1 Hz of them, without moving them in time."""
    return band_passed(integrated(rate, step), step, (_BAND[0], min(_BAND[1], 0.4 / step)))


def integrated(rate: Array, step: float) -> Array:
    """What rates (n, ...) sampled every `step` [s] add up to from their first row on, by trapezoids.

    >>> integrated(np.array([0.0, 2.0, 4.0]), 0.5).tolist()
    [0.0, 0.5, 2.0]
    """
    total = np.zeros(rate.shape)
    np.cumsum(0.5 * step * (rate[1:] + rate[:-1]), axis=0, out=total[1:])
    return total


def band_passed(values: Array, step: float, band: tuple[float, float]) -> Array:
    """Keep a band [Hz] of records (n, ...) sampled every `step` [s], without moving them in time.

    Parameters
    ----------
    values : (n, ...)
    step : [s]
    band : its ends [Hz]
    """
    padding = min(values.shape[0] - 1, round(5.0 / step))
    result = np.empty(values.shape)
    # Long records one after the other: the filter makes several copies of what it is given.
    columns, mean = values.reshape(values.shape[0], -1), np.atleast_1d(values.mean(axis=0))
    passed, width = result.reshape(columns.shape), max(1, _AT_ONCE // values.shape[0])
    for begin in range(0, columns.shape[1], width):
        few = slice(begin, begin + width)
        passed[:, few] = band_pass(columns[:, few] - mean[few], step, band, 2, padding)
    return result


def _kept(values: Array, step: float, order: int, padding: int, ratio: Callable[[Array], Array]) -> Array:
    """Filter values both ways by a Butterworth filter; `ratio` of a warped frequency to its edge is 1 there."""
    rows = values.shape[0]
    even = 1 << max(0, (rows + 2 * padding).bit_length() - _FACTOR)  # a multiple of it has small factors
    spare = min(padding + -(rows + 2 * padding) % even, rows - 1)
    before, after = values[padding:0:-1], values[-2 : -2 - spare : -1]
    whole = np.concatenate([2.0 * values[0] - before, values, 2.0 * values[-1] - after])
    mirrored = np.concatenate([whole, whole[::-1]])  # so that its end meets its beginning
    at = _warped(np.asarray(np.fft.rfftfreq(mirrored.shape[0], step), dtype=float), step)
    with np.errstate(divide="ignore", over="ignore"):  # at no frequency and at half the rate, of which nothing is kept
        gain = np.asarray(1.0 / (1.0 + ratio(at) ** (2 * order)))
    share = gain.reshape(-1, *(1,) * (values.ndim - 1))
    found = np.fft.irfft(np.fft.rfft(mirrored, axis=0) * share, mirrored.shape[0], axis=0)
    return np.asarray(found[padding : padding + rows])


def _warped(frequency: Array, step: float) -> Array:
    """Where the bilinear transform puts a frequency [Hz]."""
    return np.asarray(np.tan(np.pi * frequency * step))


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

    White noise keeps the sum of the squares of the filter's answer to a single record; that of records which are rarer
    than rows is spread over the rows between them first.

    Parameters
    ----------
    level : (3,) of the records, as `sensor_noise` tells it
    low_pass : filters columns (n, 3) along the first axis
    """
    rows, spread = np.arange(motion.time.size), np.zeros_like(motion.velocity)
    every = [_rows_of_a_record(motion, axis) for axis in range(3)]
    for axis, step in enumerate(every):
        single = np.zeros_like(motion.velocity[::step])
        single[len(single) // 2] = 1.0
        spread[:, axis] = np.interp(rows, rows[::step], _as_derived(single, motion)[:, axis])
    return np.asarray((low_pass(spread) ** 2).sum(axis=0) / every * level**2)


def _rows_of_a_record(motion: Motion, axis: int) -> int:
    return max(1, round(motion.record_step[axis] / motion.time_step))


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
    """White noise on records of u, v [m/s] and r [rad/s], (3,): what differences of neighbours meet."""
    return _joined(motions, np.ones((len(motions), 3)))


def _joined(motions: Sequence[Motion], understated: Array) -> Array:
    """Root mean square over the motions, weighted by their rows."""
    levels = np.array(
        [[noise_level(m.velocity[:: _rows_of_a_record(m, axis), axis]) or 0.0 for axis in range(3)] for m in motions]
    )
    rows = np.array([m.time.size for m in motions], dtype=float)
    return np.sqrt((levels**2 * understated * rows[:, None]).sum(axis=0) / rows.sum())
