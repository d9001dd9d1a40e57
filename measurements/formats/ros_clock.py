"""When a message was true: header stamps where they can be trusted, on one clock with what has no header."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...physics.frames import Array
from .base import from_first

OTHER_CLOCK = 5.0
"""Headers further than this from the receipt [s], in the median, come from another clock (or from a simulation's)."""
AHEAD = 0.1
"""Headers that much later than the receipt [s], in the median, are of another clock: nothing is received before it is
made, and computers that set their clocks by each other agree better."""
LATE = 0.02
"""A median delay above this [s] is worth a note."""
_ASTRAY = 30.0
DISORDER = 1.0
"""Stamps that run back by less [s] are of messages that overtook each other."""

Nanoseconds = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Stamps:
    """Stamps of the messages of one topic.

    Attributes
    ----------
    received : (n,) when the recorder had them [ns]
    header : (n,) when they say that they were made [ns]; None for a type without a header
    name : topic, for messages
    """

    received: Nanoseconds
    header: Nanoseconds | None
    name: str = ""


def agree(topics: Sequence[Stamps], first: int) -> tuple[list[Array], int, list[str]]:
    """Put all topics on one time axis [s].

    A header stamp says when a value was measured, a receipt when it had passed the network: headers are preferred. A
    topic whose headers are zero, run backwards or jump is taken at its receipts. Where all headers are of another
    clock than the receipts (a simulation's), everything is put on that clock, topics without a header by the pairs of
    header and receipt of the fullest topic. Where some are, those are moved by their median delay.

    Parameters
    ----------
    topics : the stamps of each topic, in the order of receipt
    first : receipt of the first message of the file [ns]

    Returns
    -------
    (times of each topic [s], the stamp at their zero [ns], notes)
    """
    notes: list[str] = []
    sound = [_sound(stamps, notes) for stamps in topics]
    delays = [_delay(stamps) if good else 0.0 for stamps, good in zip(topics, sound, strict=True)]
    foreign = [good and not -AHEAD <= delay <= OTHER_CLOCK for good, delay in zip(sound, delays, strict=True)]
    if any(foreign) and foreign == sound:
        clock = max((s for s, good in zip(topics, sound, strict=True) if good), key=lambda s: s.received.size)
        if all(_on(clock, stamps) for stamps, good in zip(topics, sound, strict=True) if good):
            return _on_header_clock(topics, sound, clock, notes)
    times = []
    for stamps, good, delay, other in zip(topics, sound, delays, foreign, strict=True):
        header = stamps.header if good else None
        if header is None:
            times.append(from_first(stamps.received, first))
            continue
        moved = header
        if other:
            moved = header + np.int64(round(1e9 * delay))
            if np.abs(stamps.received - moved).max() > 1e9 * DISORDER:
                notes.append(
                    f"{stamps.name}: its header stamps are of a clock that runs at another rate; receive times used"
                )
                times.append(from_first(stamps.received, first))
                continue
            notes.append(
                f"{stamps.name}: its header stamps are of another clock, moved by {delay:.3f} s to the receive times"
            )
        elif abs(delay) > LATE:
            longest = float((stamps.received - header).max()) / 1e9
            notes.append(
                f"{stamps.name}: received {delay:.3f} s (median), {longest:.3f} s at most, after its header stamps, "
                "which are used"
            )
        times.append(from_first(moved, first))
    epoch = f"time counts from the first message, {first} ns"
    return times, first, [epoch, *dict.fromkeys(notes)]


def overtaken(time: Array) -> NDArray[np.intp] | None:
    """Give the order of stamps [s] where messages overtook each other, None where there is nothing to change.

    A clock that was set back is left as it is, for the rules of the log to refuse.
    """
    steps = np.diff(time)
    return np.argsort(time, kind="stable") if steps.size and -DISORDER < steps.min() < 0 else None


def _sound(stamps: Stamps, notes: list[str]) -> bool:
    """Whether the headers can be trusted; says in a note why not."""
    if stamps.header is None:
        return False
    zero = int(np.count_nonzero(stamps.header <= 0))
    why = ""
    if zero:
        why = f"{zero} of {stamps.header.size} header stamps are zero"
    elif stamps.header.size > 1 and np.diff(stamps.header).min() < -1e9 * DISORDER:
        why = f"header stamps run back by {-np.diff(stamps.header).min() / 1e9:.3f} s"
    else:
        delay = (stamps.received - stamps.header) / 1e9
        middle = float(np.median(delay))
        astray = float(np.abs(delay - middle).max())
        if abs(middle) <= OTHER_CLOCK and astray > _ASTRAY:
            why = f"header stamps stray by {astray:.1f} s from the receive times"
    if why:
        notes.append(f"{stamps.name}: {why}; receive times used")
    return not why


def _delay(stamps: Stamps) -> float:
    return float(np.median(stamps.received - stamps.header)) / 1e9 if stamps.header is not None else 0.0


def _on(clock: Stamps, stamps: Stamps) -> bool:
    """Whether headers are of the clock of another topic, however fast that runs."""
    if stamps.header is None:
        return False
    return abs(float(np.median(_headers_at(clock, stamps.received) - stamps.header))) / 1e9 <= OTHER_CLOCK


def _headers_at(clock: Stamps, received: Nanoseconds) -> Nanoseconds:
    """What the clock showed at times of receipt; at its own rate beyond the ends."""
    assert clock.header is not None
    order = np.argsort(clock.received, kind="stable")
    known, shown = clock.received[order], clock.header[order]
    inside = np.interp((received - known[0]) / 1e9, (known - known[0]) / 1e9, (shown - shown[0]) / 1e9)
    before, after = np.minimum(received - known[0], 0), np.maximum(received - known[-1], 0)
    rate = float(shown[-1] - shown[0]) / max(float(known[-1] - known[0]), 1.0) if known.size > 1 else 1.0
    outside = np.round(rate * (before + after)).astype(np.int64)
    return shown[0] + np.round(1e9 * inside).astype(np.int64) + outside


def _on_header_clock(
    topics: Sequence[Stamps], sound: Sequence[bool], clock: Stamps, notes: list[str]
) -> tuple[list[Array], int, list[str]]:
    shown = [s.header for s, good in zip(topics, sound, strict=True) if good and s.header is not None]
    first = min(int(header.min()) for header in shown)
    received = clock.received
    assert clock.header is not None
    rate = float(clock.header[-1] - clock.header[0]) / max(float(received[-1] - received[0]), 1.0)
    moved = [
        stamps.header if good and stamps.header is not None else _headers_at(clock, stamps.received)
        for stamps, good in zip(topics, sound, strict=True)
    ]
    others = sum(not good for good in sound)
    told = (
        f"header stamps are of another clock than the receive times, {_delay(clock):.3f} s apart, at {rate:.3f} times "
        f"its rate (a simulation?); they are used, and {others} topics without one are put on it by {clock.name}"
    )
    epoch = f"time counts from the first header stamp, {first} ns"
    return [from_first(stamps, first) for stamps in moved], first, [epoch, told, *dict.fromkeys(notes)]
