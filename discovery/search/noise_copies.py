"""Copies of what a model leaves, of the same colour and size, that follow nothing of the log.

Phases are drawn anew, the same for all axes, within blocks of the size that the rest has there (Theiler et al. 1992).
A mean has no phase, and a constant force is no noise: the mean of a copy is drawn from the slowest waves of the rest.
"""

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

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


class NoiseCopies:
    """Copies of rests of a balance, drawn with the same phases for every rest.

    Parameters
    ----------
    balance : whose tests the rests are of
    seed : of the phases
    """

    def __init__(self, balance: Balance, seed: int) -> None:
        self._balance, self._seed, self._rows = balance, seed, balance.bins
        self._length: int = _quick_length(balance.time.size // self._rows)

    def of(self, left: Single) -> Iterator[Single]:
        """Copies of a rest (tests, 3) as (3, copies, tests), some at a time, `REHEARSALS` in all."""
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


def _quick_length(least: int) -> int:
    """The next number without factors beyond five: a Fourier transform of that length is quick."""
    length = max(least, 1)
    while 30**20 % length:  # each factor of a number below 2**20 divides it
        length += 1
    return length
