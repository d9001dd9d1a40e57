"""What is told of a step while it goes on: how many parts are done, and what time the others take at their pace."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from ...physics.stage import Say
from .progress import Progress, about

T = TypeVar("T")

FIRST = 2.0
"""Time after which a step tells how far it is [s]: less is no wait."""
EVERY = 5.0
"""Seconds between lines after that: often enough to see that it goes on, seldom enough for the log of a batch job."""
_MEGABYTE = 1e6
"""[B], in which lines tell of bytes."""
_OFTEN = 0.1
"""Seconds between two looks of a bar: more nobody sees."""


class Pace:
    """Lines about a step whose parts are counted.

    Parameters
    ----------
    say : called with a line; None for nobody
    step : its name, as the line begins
    unit : of what is counted
    even : whether the parts take equal times, so that the time left follows from those that are done
    """

    def __init__(self, say: Say | None, step: str, unit: str = "", even: bool = True) -> None:
        self._say, self._step, self._unit, self._even = say, step, unit, even
        self._begin()

    def _begin(self) -> None:
        self._begun = self._look = time.monotonic()
        self._done, self._next = 0.0, self._begun + FIRST

    def told(self, done: float, total: float) -> None:
        """Take note of how much is done, and tell it: a bar at once, lines where the last one is long ago.

        Fewer than before are those of another step of the same name, such as the next log.
        """
        if done < self._done:
            self._begin()
        self._done, now, ended = done, time.monotonic(), done >= total
        left = (now - self._begun) * (total - done) / done if self._even and done > 0.0 else math.nan
        line = f"{self._step}: {done:.0f} of {total:.0f}{self._unit}"
        if isinstance(self._say, Progress):
            if now < self._look and not ended:
                return
            self._look = now + _OFTEN
            if self._say.counted(line, 1.0 if ended else done / total, left):
                return
        if self._say is not None and not ended and now >= self._next:
            self._next = now + EVERY
            self._say(line if math.isnan(left) else f"{line}, {about(left)}")


def megabytes(say: Say | None) -> Callable[[int, int], None]:
    """Who is told of bytes that are read, of a large log after the other."""
    pace = Pace(say, "reading", " MB")
    return lambda done, total: pace.told(done / _MEGABYTE, total / _MEGABYTE)


def paced(items: Sequence[T], step: str, say: Say | None, *, even: bool = True) -> Iterator[T]:
    """The items of a step, with lines about it; see `Pace`."""
    pace = Pace(say, step, even=even)
    for done, item in enumerate(items):
        pace.told(done, len(items))
        yield item
    pace.told(len(items), len(items))
