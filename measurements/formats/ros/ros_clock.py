"""Time of a message: its header stamp where that can be trusted, on one clock with messages that have no header."""

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....physics.motion import Array
from ..base import from_first

OTHER_CLOCK = 5.0
"""Headers further than this from the receipt [s], in the median, come from another clock (or from a simulation's)."""
AHEAD = 0.1
"""Headers that much later than the receipt [s], in the median, are of another clock: nothing is received before it is
made, and computers that set their clocks by each other agree better."""
LATE = 0.02
"""A median delay above this [s] is worth a note."""
_ASTRAY = 30.0
"""Time by which a header may be later than usual [s]: no message waits longer for its recorder."""
DISORDER = 1.0
"""Stamps that run back by less [s] are of messages that overtook each other."""

CLOCK = "rosgraph_msgs/msg/Clock"
"""Type of the messages by which a simulation tells its time."""
_ALONE = 0.1
"""Latency [s] that even the fastest topic may have, where nothing tells it."""
_AT_LEAST, _MESSAGES, _AT_MOST = 0.2, 20, 2.0
"""Of a window [s] in which the fastest message tells the clock: shortest, its messages, and longest."""
_NEAR = 5.0
"""Time [s] at either end of a clock by which its rate beyond is told."""
_FAST = 5.0
"""Per cent of the messages of a topic that are faster than the one that stands for it."""

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


class ClockTopic:
    """The messages of `/clock`: what a simulation's clock showed, and when the recorder was told."""

    def __init__(self, name: str, unpack: Callable[[bytes | memoryview], Any]) -> None:
        self._name = name
        self._unpack = unpack
        self._received = array("q")
        self._shown = array("q")

    def take(self, received: int, raw: bytes | memoryview) -> None:
        """Unpack one message; a broken one is passed over, for others tell the same."""
        try:
            shown = self._unpack(raw).clock
            stamp = shown.sec * 1_000_000_000 + shown.nanosec
        except Exception:
            return
        self._received.append(received)
        self._shown.append(stamp)

    @property
    def stamps(self) -> Stamps:
        """The messages as stamps: their time of receipt, and the time that they show."""
        received, shown = (np.frombuffer(values, np.int64) for values in (self._received, self._shown))
        return Stamps(received, shown, self._name)


def agree(
    topics: Sequence[Stamps], first: int, clocks: Sequence[Stamps] = ()
) -> tuple[list[Array], int, list[str], float]:
    """Put all topics on one time axis [s].

    A header stamp says when a value was measured, a receipt when it had passed the network: headers are preferred. A
    topic whose headers are zero, run backwards or jump is taken at its receipts. Where all headers are of another
    clock than the receipts (a simulation's), everything is put on that clock, topics without a header by the messages
    of `/clock`, or for want of them by the pairs of header and receipt of the fastest topic; its latency then stays
    unknown. Where some are, those are moved by their median delay.

    Parameters
    ----------
    topics : the stamps of each topic, in the order of receipt
    first : receipt of the first message of the file [ns]
    clocks : what `/clock` told

    Returns
    -------
    (times of each topic [s], the stamp at their zero [ns], notes, by how much topics with and without a header may be
    out of step because of it [s])
    """
    notes: list[str] = []
    sound = [_sound(stamps, notes) for stamps in topics]
    delays = [_delay(stamps) if good else 0.0 for stamps, good in zip(topics, sound, strict=True)]
    foreign = [good and not -AHEAD <= delay <= OTHER_CLOCK for good, delay in zip(sound, delays, strict=True)]
    if any(foreign) and foreign == sound:
        stamped = [stamps for stamps, good in zip(topics, sound, strict=True) if good]
        fullest = max(stamped, key=lambda s: s.received.size)
        for clock in [*(c for c in clocks if c.received.size > 1 and _sound(c, notes)), fullest]:
            if all(_on(clock, stamps) for stamps in stamped):
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
    return times, first, [epoch, *dict.fromkeys(notes)], 0.0


def overtaken(time: Array) -> NDArray[np.intp] | None:
    """Give the order of stamps [s] where messages overtook each other, None where there is nothing to change.

    A clock that was set back is left as it is, for the rules of the log to refuse.
    """
    steps = np.diff(time)
    return np.argsort(time, kind="stable") if steps.size and -DISORDER < steps.min() < 0 else None


def _sound(stamps: Stamps, notes: list[str]) -> bool:
    """True when the headers can be trusted; says in a note why not."""
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
    """True when headers are of the clock of another topic, however fast that runs."""
    if stamps.header is None:
        return False
    return abs(float(np.median(_headers_at(clock, stamps.received) - stamps.header))) / 1e9 <= OTHER_CLOCK


def _headers_at(clock: Stamps, received: Nanoseconds) -> Nanoseconds:
    """What the clock showed at times of receipt; beyond the ends at the rate that it has there."""
    assert clock.header is not None
    order = np.argsort(clock.received, kind="stable")
    known, shown = clock.received[order], clock.header[order]
    inside = np.interp((received - known[0]) / 1e9, (known - known[0]) / 1e9, (shown - shown[0]) / 1e9)
    near = np.searchsorted(known, [known[0] + 1e9 * _NEAR, known[-1] - 1e9 * _NEAR])
    early, late = min(int(near[0]), known.size - 1), max(int(near[1]) - 1, 0)
    before = _rate(known, shown, 0, early) * np.minimum(received - known[0], 0)
    after = _rate(known, shown, late, -1) * np.maximum(received - known[-1], 0)
    outside = np.round(before + after).astype(np.int64)
    return shown[0] + np.round(1e9 * inside).astype(np.int64) + outside


def _rate(known: Nanoseconds, shown: Nanoseconds, start: int, end: int) -> float:
    """How fast a clock ran between two of its stamps; 1 where that is one stamp."""
    passed = float(known[end] - known[start])
    return float(shown[end] - shown[start]) / passed if passed > 0 else 1.0


def _fastest(clock: Stamps) -> Stamps:
    """The message of each short window that came soonest after the time that it shows.

    A network makes a message late, never early: the others would put what is read from the clock too early.
    """
    assert clock.header is not None
    order = np.argsort(clock.received, kind="stable")
    received, shown = clock.received[order], clock.header[order]
    at, told = (received - received[0]) / 1e9, (shown - shown[0]) / 1e9
    window = float(np.clip(_MESSAGES * at[-1] / max(at.size - 1, 1), _AT_LEAST, _AT_MOST))
    number = np.floor(at / window).astype(np.int64)
    middle = (number + 0.5) * window
    before, after = np.maximum(middle - 2.0 * window, 0.0), np.minimum(middle + 2.0 * window, at[-1])
    rate = (np.interp(after, at, told) - np.interp(before, at, told)) / np.maximum(after - before, 1e-9)
    ranked = np.lexsort((told - rate * (at - middle), number))
    chosen = np.sort(ranked[np.append(np.diff(number[ranked]) > 0, True)])
    return Stamps(received[chosen], shown[chosen], clock.name)


def _latency(clock: Stamps, stamps: Stamps, percent: float = 50.0) -> float:
    """How much later than its headers a topic was received, by a clock [s]; so slow are so many of its messages."""
    assert stamps.header is not None
    return float(np.percentile((_headers_at(clock, stamps.received) - stamps.header) / 1e9, percent))


def _on_header_clock(
    topics: Sequence[Stamps], sound: Sequence[bool], clock: Stamps, notes: list[str]
) -> tuple[list[Array], int, list[str], float]:
    stamped = {id(s): s.header for s, good in zip(topics, sound, strict=True) if good and s.header is not None}
    known = [s for s in topics if id(s) in stamped]
    first = min(int(header.min()) for header in stamped.values())
    others = sum(not good for good in sound)
    exact = id(clock) not in stamped
    if not exact:
        clock = min(known, key=lambda s: _latency(clock, s, _FAST))
    shown = _fastest(clock)
    slowest = max(known, key=lambda s: _latency(shown, s))
    slow = _latency(shown, slowest)
    assert clock.header is not None
    assert shown.header is not None
    rate = _rate(shown.received, shown.header, 0, -1)
    texts = [
        f"header stamps are of another clock than the receive times, {_delay(clock):.3f} s apart, at {rate:.3f} times "
        f"its rate (a simulation?); they are used, and {others} topics without one are put on it by {clock.name}"
    ]
    doubt = 0.0
    if exact:
        if slow > LATE:
            texts.append(f"{slowest.name}: received {slow:.3f} s (median) after its header stamps, which are used")
    elif others:
        doubt = max(slow, _ALONE)
        spread = "" if slowest is clock else f", and {slowest.name}, the slowest, comes {slow:.3f} s after it"
        texts.append(
            f"topics without a header may be early by {doubt:.3f} s or more, for nothing tells the latency of "
            f"{clock.name}{spread}: a lag or a delay of that size may be none; record /clock to know"
        )
    moved = [stamped[id(s)] if id(s) in stamped else _headers_at(shown, s.received) for s in topics]
    epoch = f"time counts from the first header stamp, {first} ns"
    return [from_first(stamps, first) for stamps in moved], first, [epoch, *texts, *dict.fromkeys(notes)], doubt
