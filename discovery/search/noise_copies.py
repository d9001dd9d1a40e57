"""Copies of what a model leaves, of the same colour and size, that follow nothing of the log.

Sensor noise is drawn anew and passed through the balance: drag lets more of it through where the boat is fast, and
copies of the same size all over would tell chance as rarer than it is. Of what the rest has more than that at each
frequency, phases are drawn anew, the same for all axes, within blocks of the size that it has there (Theiler et al.
1992). A mean has no phase, and a constant force is no noise: the mean of a copy is drawn from the slowest waves.
"""

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...physics.vehicle import Vehicle
from ..balance.base import Balance

Single = NDArray[np.float32]
REHEARSALS = 999
"""Copies: where none of them looks as good as the log, that is 1 in 1,000."""
_NUMBERS = 500_000
"""Numbers of the copies that are worked on at a time, in single precision: 2 MB."""
_SLOWEST = 4
"""Slowest waves of a rest that tell how large the mean of noise of its colour is."""
_LEAST_SIZE = 0.1
"""Least size of the rest in a block, as a share of its size in the whole log: no block is without noise."""
_TOLD = 64
"""Copies of sensor noise of which the spectrum is the mean: it is then known to an eighth at each frequency."""
_BROAD, _FEW = 0.125, 12
"""Frequencies on either side over which spectra are compared: this share of the frequency, and never fewer."""


class NoiseCopies:
    """Copies of rests of a balance, drawn with the same noise and phases for every rest.

    Parameters
    ----------
    balance : whose tests the rests are of
    vehicle : model near which the rests are left, through whose balance the noise of sensors passes
    seed : of noise and phases
    """

    def __init__(self, balance: Balance, vehicle: Vehicle, seed: int) -> None:
        self._balance, self._vehicle, self._seed, self._rows = balance, vehicle, seed, balance.bins
        self._length: int = _quick_length(balance.time.size // self._rows)

    @property
    def sensed(self) -> bool:
        """Whether noise of sensors is in them, passed through the balance."""
        return self._drawn is not None

    @property
    def _drawn(self) -> Single | None:
        return self._balance.sensed(self._vehicle, REHEARSALS, self._seed)

    def of(self, left: Single) -> Iterator[Single]:
        """Copies of a rest (tests, 3) as (3, copies, tests), some at a time, `REHEARSALS` in all."""
        sensed = self._drawn
        if sensed is None:
            yield from self._by_phases(left)
            return
        # What passes through a model must not be louder than what it leaves.
        share = np.minimum(1.0, _size(left.T) / np.maximum(_size(sensed[:, :_TOLD]), np.finfo(np.float32).tiny))
        start = 0
        for drawn in self._by_phases(self._surplus(left, share * sensed[:, :_TOLD])):
            drawn += share * sensed[:, start : start + drawn.shape[1]]
            start += drawn.shape[1]
            yield drawn

    def _surplus(self, left: Single, sensed: Single) -> Single:
        """What a rest (tests, 3) has at each frequency beyond sensor noise (3, copies, tests)."""
        size = self._sizes(left).astype(float)
        spectrum = np.fft.rfft(left / size, axis=0)
        white = (np.abs(np.fft.rfft(sensed / size.T[:, None])) ** 2).mean(axis=1).T
        ratio = np.divide(np.abs(spectrum) ** 2, white, out=np.zeros(white.shape), where=white > 0.0)
        beyond = np.sqrt(1.0 - 1.0 / np.maximum(_near_by(ratio), 1.0))
        beyond[:, ~white.any(axis=0)] = 1.0  # no noise of sensors comes to this axis
        return np.asarray(np.fft.irfft(beyond * spectrum, left.shape[0], axis=0) * size, np.float32)

    def _by_phases(self, left: Single) -> Iterator[Single]:
        """Copies of a rest by its phases alone."""
        size = self._sizes(left)
        places = left.shape[0] // self._rows
        white = (left / size).reshape(places, self._rows * 3) * np.float32(np.sqrt(self._length / places))
        spectrum = np.asarray(np.fft.rfft(white, self._length, axis=0), np.complex64).T[:, None]
        step = max(1, _NUMBERS // (3 * left.shape[0]))
        for start in range(0, REHEARSALS, step):
            turned = spectrum * self._turns[start : start + step]
            slowest = spectrum[..., 1 : _SLOWEST + 1]
            slowest = slowest * self._means[start : start + step, : slowest.shape[-1]]
            turned[..., 0] = np.sqrt(2.0 / max(slowest.shape[-1], 1)) * slowest.real.sum(axis=-1)
            drawn = np.asarray(np.fft.irfft(turned, self._length, axis=2), np.float32)[:, :, :places]
            drawn = drawn.reshape(self._rows, 3, -1, places).transpose(1, 2, 3, 0)
            yield drawn.reshape(3, drawn.shape[1], -1) * size.T[:, None]

    @cached_property
    def _turns(self) -> NDArray[np.complex64]:
        """By how much each frequency is turned in each copy, (copies, frequencies); the fastest has a sign only."""
        found = np.empty((REHEARSALS, self._length // 2 + 1), np.complex64)
        rng = np.random.default_rng([self._seed, REHEARSALS])
        for copy in found:
            angles = rng.random(copy.size, dtype=np.float32)
            if self._length % 2 == 0:
                angles[-1] = np.round(angles[-1]) / 2.0
            np.exp(np.complex64(2j * np.pi) * angles, out=copy)
        return found

    @cached_property
    def _means(self) -> NDArray[np.complex64]:
        """By how much the slowest waves are turned that the mean of each copy is made of, (copies, waves)."""
        angles = np.random.default_rng([self._seed, REHEARSALS, _SLOWEST]).random((REHEARSALS, _SLOWEST))
        return np.asarray(np.exp(2j * np.pi * angles), np.complex64)

    def _sizes(self, left: Single) -> Single:
        """Root mean square of the rest in the block of each test, (tests, 3)."""
        block = self._balance.block
        count = np.bincount(block)
        square = np.stack([np.bincount(block, left[:, axis] ** 2) / count for axis in range(3)], axis=1)
        least = _LEAST_SIZE**2 * np.maximum((left**2).mean(axis=0), np.finfo(np.float32).tiny)
        return np.sqrt(np.maximum(square, least))[block].astype(np.float32)


def _size(rest: Single) -> Single:
    """Root mean square on each axis (3, 1, 1)."""
    return np.asarray(np.sqrt((rest**2).reshape(3, -1).mean(axis=1)), np.float32)[:, None, None]


def _near_by(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Mean over frequencies (n, 3) near each; the slowest, which is the mean of the log, is no one's neighbour."""
    place = np.arange(len(values))
    reach = np.maximum(_FEW, (_BROAD * place).astype(int))
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(values, axis=0)])
    first, last = np.maximum(place - reach, 1), np.minimum(place + reach + 1, len(values))
    return np.asarray((sums[last] - sums[first]) / (last - first)[:, None])


def _quick_length(least: int) -> int:
    """The next number without factors beyond five: a Fourier transform of that length is quick."""
    length = max(least, 1)
    while 30**20 % length:  # each factor of a number below 2**20 divides it
        length += 1
    return length
