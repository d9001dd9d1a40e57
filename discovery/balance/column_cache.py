"""Arrays by what they depend on: the latest are kept, up to a number of bytes."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

import numpy as np

from ...physics.motion import Array

_MOST = 30_000_000
"""Bytes of arrays that are kept, however long the log is."""

T = TypeVar("T", Array, tuple[Array, ...])


class Remembered(Generic[T]):
    """Arrays, or tuples of them, that are computed once and kept until younger ones need their place.

    Parameters
    ----------
    most : bytes that are kept; the latest is kept, however large
    """

    def __init__(self, most: int) -> None:
        self._most, self._bytes = most, 0
        self._kept: OrderedDict[Hashable, T] = OrderedDict()

    def of(self, key: Hashable, compute: Callable[[], T]) -> T:
        """What is kept under a key, computed where nothing is."""
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        value = self._kept[key] = compute()
        self._bytes += _size(value)
        while self._bytes > self._most and len(self._kept) > 1:
            self._bytes -= _size(self._kept.popitem(last=False)[1])
        return value

    def clear(self) -> None:
        """Keep nothing."""
        self._kept.clear()
        self._bytes = 0


def room(many: int, shape: tuple[int, ...]) -> int:
    """Bytes of many arrays of a shape; of a long log, fewer are kept."""
    return min(_MOST, many * 8 * int(np.prod(shape)))


def _size(value: Array | tuple[Array, ...]) -> int:
    return sum(part.nbytes for part in value) if isinstance(value, tuple) else value.nbytes
