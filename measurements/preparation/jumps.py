"""Positions that jump: a receiver that changes its solution, or a filter that sets its origin anew."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...physics.motion import Array
from ...physics.presentation import listing
from ..canonical import Channel
from .resampling import Span, gap_limit

_LEAST = 50
"""Fixes from which the usual step can be told."""
_NOISE = 10.0
"""Times the median change from step to step that a jump has: white noise reaches four of it."""
_FIXES, _SECONDS = 3.0, 1.0
"""A jump is farther than the boat goes at its top speed in three fixes, and in a second: noise and a late fix move it
by one fix, and what it goes in a second is the way over which speeds are told."""
_NEAR = 10
"""Steps before and after one that tell how fast the boat goes."""
_BACK = 60.0
"""Longest time after which a jump back ends an excursion [s]; later, both stand for themselves."""
_HALF = 0.5
"""Share of a jump within which another one takes it back."""
_TOLD = 3
"""Jumps that a sentence lists."""


@dataclass(frozen=True, slots=True)
class Jump:
    """A jump of the position.

    Attributes
    ----------
    before, after : stamps of the last fix before it and of the first one on the old track again, or on the new one [s]
    north, east : by how much [m]
    step : time from the fix before to the one after the jump [s]
    returns : whether the position comes back at `after`
    """

    before: float
    after: float
    north: float
    east: float
    step: float
    returns: bool = False

    @property
    def size(self) -> float:
        """How far [m]."""
        return float(np.hypot(self.north, self.east))

    @property
    def sentence(self) -> str:
        """What happened, for a list.

        >>> Jump(9.95, 10.0, 60.0, 0.0, 0.05).sentence
        '60 m at t = 9.95 s, in 0.05 s (1200 m/s)'
        """
        text = f"{self.size:.3g} m at t = {self.before:.2f} s, in {self.step:.2g} s ({self.size / self.step:.4g} m/s)"
        return f"{text}, and back after {self.after - self.before:.3g} s" if self.returns else text


def jumps_of(channels: Mapping[str, Channel]) -> tuple[Jump, ...]:
    """Find the jumps in the positions of a log, in their order; none without positions that come together.

    Steps over a gap are none: the log is cut there anyway.
    """
    if not {"x", "y"} <= set(channels):
        return ()
    x, y = channels["x"], channels["y"]
    if x.time.size != y.time.size or not np.array_equal(x.time, y.time):
        return ()
    new = np.concatenate(([True], (np.diff(x.value) != 0.0) | (np.diff(y.value) != 0.0)))
    if np.count_nonzero(new) < _LEAST:
        return ()
    time, place = x.time[new], np.column_stack([x.value[new], y.value[new]])
    steps, taken = np.diff(place, axis=0), np.diff(time)
    size = np.hypot(*steps.T)
    noise = float(np.median(np.hypot(*np.diff(steps, axis=0).T)))
    top = _top_speed(time, place)
    far = size > np.maximum(_NOISE * noise, top * np.maximum(_SECONDS, _FIXES * taken))
    at = [row for row in np.flatnonzero(far & (taken <= gap_limit(x, None))).tolist() if _alone(size / taken, row)]
    return tuple(_sentence(at, steps, time))


def _alone(speed: Array, row: int) -> bool:
    """True when a step is far quicker than those beside it: a boat that mostly drifts may go as fast for a while."""
    near = np.concatenate([speed[max(row - _NEAR, 0) : row], speed[row + 1 : row + 1 + _NEAR]])
    return bool(speed[row] > _FIXES * np.median(near))


def _top_speed(time: Array, place: Array) -> float:
    """Speed that is exceeded in a tenth of the windows of a second [m/s]: a boat that spins goes nowhere in more."""
    later = np.searchsorted(time, time + _SECONDS)
    known = later < time.size
    if not known.any():
        return float(np.hypot(*(place[-1] - place[0])) / max(time[-1] - time[0], 1e-9))
    rows, ends = np.flatnonzero(known), later[known]
    return float(np.quantile(np.hypot(*(place[ends] - place[rows]).T) / (time[ends] - time[rows]), 0.9))


def _sentence(at: Sequence[int], steps: Array, time: Array) -> list[Jump]:
    result: list[Jump] = []
    open_row: int | None = None
    for row in at:
        north, east = steps[row]
        one = Jump(float(time[row]), float(time[row + 1]), float(north), float(east), float(time[row + 1] - time[row]))
        if open_row is not None and time[row] - time[open_row] <= _BACK:
            left = np.hypot(*(steps[row] + steps[open_row]))
            if left < _HALF * result[-1].size:
                if row == open_row + 1:
                    result.pop()  # a single value: no jump, but a spike
                else:
                    result[-1] = replace(result[-1], after=one.after, returns=True)
                open_row = None
                continue
        result.append(one)
        open_row = row
    return result


def holes_of(jumps: Sequence[Jump]) -> list[Span]:
    """Where a log is cut for jumps, as gaps (start, end) [s]."""
    return [(jump.before, jump.after) for jump in jumps]


def in_words(jumps: Sequence[Jump]) -> str:
    """Say what positions do, as a sentence without an end."""
    told = listing([jump.sentence for jump in jumps[:_TOLD]])
    more = f", and {len(jumps) - _TOLD} times more" if len(jumps) > _TOLD else ""
    return f"the positions jump: {told}{more}"


def without(channels: Mapping[str, Channel], jumps: Sequence[Jump]) -> dict[str, Channel]:
    """The channels without the positions of excursions, and with a gap at each jump, at which every reader cuts."""
    x = channels["x"]
    half = 0.55 * gap_limit(x, None)
    keep = np.ones(x.time.size, dtype=bool)
    for jump in jumps:
        middle = 0.5 * (jump.before + jump.after)
        reach = max(half, middle - jump.before)
        keep &= np.abs(x.time - middle) >= reach
        keep &= ~((x.time > jump.before) & (x.time < jump.after))
    thinned = {name: replace(channels[name], time=x.time[keep], value=channels[name].value[keep]) for name in "xy"}
    return {**channels, **thinned}
