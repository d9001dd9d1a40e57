"""What is told of a step while it goes on: how many parts are done, and what time the others take at their pace."""

import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")
Say = Callable[[str], None]

FIRST = 2.0
"""Time after which a step tells how far it is [s]: less is no wait."""
EVERY = 5.0
"""Seconds between lines after that: often enough to see that it goes on, seldom enough for the log of a batch job."""
_MINUTES = 100.0
"""Time from which what is left is told in minutes [s]: no pace is known to a second of it."""


class Pace:
    """Lines about a step whose parts are counted.

    Parameters
    ----------
    say : called with a line
    step : its name, as the line begins
    unit : of what is counted
    even : whether the parts take equal times, so that the time left follows from those that are done
    """

    def __init__(self, say: Say, step: str, unit: str = "", even: bool = True) -> None:
        self._say, self._step, self._unit, self._even = say, step, unit, even
        self._begin()

    def _begin(self) -> None:
        self._begun = time.monotonic()
        self._done, self._next = 0.0, self._begun + FIRST

    def told(self, done: float, total: float) -> None:
        """Take note of how much is done, and tell it where the last line is long ago; what is done in a moment is not.

        Fewer than before are those of another step of the same name, such as the next log.
        """
        if done < self._done:
            self._begin()
        self._done, now = done, time.monotonic()
        if done >= total or now < self._next:
            return
        self._next = now + EVERY
        left = f", {_left((now - self._begun) * (total - done) / done)}" if self._even and done > 0.0 else ""
        self._say(f"{self._step}: {done:.0f} of {total:.0f}{self._unit}{left}")


def paced(items: Sequence[T], step: str, say: Say | None, *, even: bool = True) -> Iterator[T]:
    """The items of a step, with lines about it; see `Pace`."""
    pace = Pace(say or _silent, step, even=even)
    for done, item in enumerate(items):
        pace.told(done, len(items))
        yield item


def _left(seconds: float) -> str:
    return f"about {seconds:.0f} s left" if seconds < _MINUTES else f"about {seconds / 60.0:.0f} min left"


def _silent(line: str) -> None:
    """Tell nobody."""
