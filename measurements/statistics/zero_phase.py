"""Filters that move nothing in time, as a share of each frequency that is kept.

Forward and backward through a Butterworth filter, a record keeps the squared modulus of that filter's response, which
is known in closed form; applied to the spectrum of the record and its mirror image, it needs no filter at all.
`scipy.signal` does the same by recursion, and takes longer to load than a whole log takes here. They differ at the
ends, where neither knows what came before: by much in a record that is shorter than the longest period that is kept.
"""

from collections.abc import Callable

import numpy as np

from ...physics.frames import Array

_FACTOR = 7
"""Digits of the largest factor that a length may have: a Fourier transform of a large prime takes ten times as long."""


def low_pass(values: Array, step: float, cutoff: float, order: int, padding: int) -> Array:
    """Butterworth low-pass, forward and backward, along the first axis of `values` (n, ...), sampled every `step` [s].

    Parameters
    ----------
    cutoff : -3 dB frequency of one pass [Hz]
    order : of one pass
    padding : rows by which both ends are continued, as what they mirror with the other sign; at most n - 1
    """
    edge = _warped(np.array(cutoff), step)

    def gain(at: Array) -> Array:
        with np.errstate(over="ignore"):  # at half the rate, of which nothing is kept
            return np.asarray(1.0 / (1.0 + (at / edge) ** (2 * order)))

    return _kept(values, step, padding, gain)


def band_pass(values: Array, step: float, band: tuple[float, float], order: int, padding: int) -> Array:
    """The same of a band [Hz], which ends below half the rate."""
    low, high = _warped(np.array(band), step)

    def gain(at: Array) -> Array:
        with np.errstate(divide="ignore", over="ignore"):
            return np.asarray(1.0 / (1.0 + ((at - low * high / at) / (high - low)) ** (2 * order)))

    return _kept(values, step, padding, gain)


def _kept(values: Array, step: float, padding: int, gain: Callable[[Array], Array]) -> Array:
    rows = values.shape[0]
    even = 1 << max(0, (rows + 2 * padding).bit_length() - _FACTOR)  # a multiple of it has small factors
    spare = min(padding + -(rows + 2 * padding) % even, rows - 1)
    before, after = values[padding:0:-1], values[-2 : -2 - spare : -1]
    whole = np.concatenate([2.0 * values[0] - before, values, 2.0 * values[-1] - after])
    mirrored = np.concatenate([whole, whole[::-1]])  # so that its end meets its beginning
    at = _warped(np.asarray(np.fft.rfftfreq(mirrored.shape[0], step), dtype=float), step)
    share = gain(at).reshape(-1, *(1,) * (values.ndim - 1))
    found = np.fft.irfft(np.fft.rfft(mirrored, axis=0) * share, mirrored.shape[0], axis=0)
    return np.asarray(found[padding : padding + rows])


def _warped(frequency: Array, step: float) -> Array:
    """Where the bilinear transform puts a frequency [Hz]."""
    return np.asarray(np.tan(np.pi * frequency * step))
