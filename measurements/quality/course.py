"""Course over ground against heading: the direction of the axes where no speed was measured.

A boat's way has no part across its heading but current and the drift of its turns; in a mirrored log that holds for the
mirror image of the heading, in a turned one for a turned heading. The simplest reading is taken on which no other is
much better in squared way across, by the rule of `faults`. The angle of a reading is half that of the squared ways
(Mardia and Jupp, Directional Statistics, 2000, section 9.4).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array
from ..canonical import command_kind
from ..log import Log
from .axes import Mixed, mixed_axes, noise_of_ways, other_places
from .faults import BLOCK, FEWEST, OVERWHELMING, Size, size_of, size_of_unexplained
from .lags import blocks_of_pieces, courses

_QUARTER = 0.5 * np.pi
"""A quarter turn [rad]: a way along one heading goes, all of it, across another a quarter turn away."""


@dataclass(frozen=True, slots=True)
class Course:
    """How the course over ground goes with the heading.

    Attributes
    ----------
    turn : -1 where course plus heading keeps to one angle, else 1
    angle : that angle, from bow to track, clockwise [rad]
    quarters : quarter turns in that angle; None where it is none of these
    unexplained : share of the way that goes across this reading
    size : how much this reading explains beside that of the log as it is recorded, over half of the way, which is what
        a heading of no meaning leaves across it
    drifts : whether a current, or drift in turns, would have to be most of the way for the log to be right as recorded;
        nothing else speaks against it
    unrelated : how much of the way goes across every reading, beyond noise
    """

    turn: int
    angle: float
    quarters: int | None
    unexplained: float
    size: Size
    drifts: bool
    unrelated: Size

    @property
    def sound(self) -> bool:
        """True when all axes point where they should."""
        return self.turn == 1 and self.quarters == 0


@dataclass(frozen=True, slots=True, eq=False)
class _Ways:
    """Ways over pieces (m,) [m], north and east as one complex number, headings and turning [rad], lengths [s].

    `push` is 1 where the commands push ahead, -1 where they push astern, 0 where they are not known.
    """

    way: NDArray[np.complex128]
    heading: Array
    turning: Array
    span: Array
    push: Array
    piece: NDArray[np.int64]

    def angle(self, turn: int) -> float:
        """The angle that the course keeps to the heading, or to its mirror image (`turn` -1), where it is driven."""
        made = self.way * np.exp(-1j * turn * self.heading)
        axis = 0.5 * float(np.angle((made**2).sum()))
        ahead = made * (self.push if self.push.any() else 1.0) * np.exp(-1j * axis)
        return float(np.angle(np.exp(1j * (axis + np.pi * (ahead.real.sum() < 0.0)))))

    def across(self, turn: int, angle: float, beside: bool = True) -> Array:
        """Squared ways across a reading (m,) [m^2], beside the current and the drift in turns that fit it best."""
        bow = np.exp(-1j * (turn * self.heading + angle))
        made, drift = self.way * bow, self.span * bow
        table = np.column_stack([drift.imag, drift.real, self.turning * made.real])
        fitted = table @ np.linalg.lstsq(table, made.imag, rcond=1e-9)[0] if beside else 0.0
        return np.asarray((made.imag - fitted) ** 2)


def course_of(logs: Sequence[Log]) -> Course | None:
    """Compare course and heading of logs with positions; None where the boats are hardly driven."""
    both = [log for log in logs if {"x", "y", "psi"} <= set(log.channels)]
    ways = _joined([one for log in both if (one := _ways(log)) is not None])
    if ways is None:
        return None
    block = blocks_of_pieces(ways.piece)
    if np.unique(block).size < FEWEST:
        return None
    found, noise = _read(ways, block, beside=True), 0.5 * noise_of_ways(both)  # one of its two parts
    power, left = np.abs(ways.way) ** 2, min((ways.across(turn, ways.angle(turn)) for turn in (1, -1)), key=np.sum)
    # Where the bow sweeps over much of the compass in a piece, its way may go anywhere, and few others tell nothing.
    steady = np.abs(ways.turning) < _QUARTER
    steady &= np.unique(block[steady]).size >= FEWEST
    unrelated = size_of_unexplained((left - noise)[steady], (power - 2.0 * noise)[steady], block[steady])
    if found[-1].likely:
        return Course(*found, drifts=False, unrelated=unrelated)
    alone = _read(ways, block, beside=False)
    drifts = min(alone[-1].share.value, 0.5 * alone[-1].weight.value) > 1.0 - OVERWHELMING
    return Course(*(alone if drifts else found), drifts=drifts, unrelated=unrelated)


def _read(ways: _Ways, block: NDArray[np.int64], beside: bool) -> tuple[int, float, int | None, float, Size]:
    """The simplest reading on which no other is much better: turn, angle, quarters, what it leaves, and its size.

    Parameters
    ----------
    beside : whether a current and drift in turns explain what they can of every reading
    """

    def across(turn: int, angle: float, _: int | None) -> Array:
        return ways.across(turn, angle, beside)

    power, free = np.abs(ways.way) ** 2, {turn: ways.angle(turn) for turn in (1, -1)}
    numbers = {turn: round(angle / _QUARTER) for turn, angle in free.items()}
    levels: list[list[tuple[int, float, int | None]]] = [
        [(1, 0.0, 0)],
        [(turn, _QUARTER * number, number % 4) for turn, number in numbers.items()],
        [(turn, angle, None) for turn, angle in free.items()],
    ]
    as_is = across(1, 0.0, 0)
    levels[-1] = [one for one in levels[-1] if _holds(ways, *one[:2])]
    least = min((across(*one) for level in levels for one in level), key=np.sum)
    for level in filter(None, levels):
        reading = min(level, key=lambda one: float(across(*one).sum()))
        told = across(*reading)
        if not size_of(told, least, as_is, block).likely:
            break
    if reading == (1, 0.0, 0) and ways.push.any() and np.cos(free[1]) < 0.0:  # doubled angles: the stern leaves as much
        astern = np.cos(np.angle(ways.way) - ways.heading) * ways.push < 0.0
        reading, as_is, told = (1, np.pi, 2), power * astern, power * ~astern
    turn, angle, quarters = reading
    return turn, angle, quarters, float(told.sum() / power.sum()), size_of(as_is, told, 0.5 * power, block)


def _holds(ways: _Ways, turn: int, angle: float) -> bool:
    """Whether an angle holds in all parts of the log: that of drift or a tether comes and goes, a wrong one stays."""
    told, as_is = ways.across(turn, angle, beside=False), ways.across(1, 0.0, beside=False)
    power, each = 0.5 * np.abs(ways.way) ** 2, np.arange(ways.way.size)
    part = (np.cumsum(ways.span) / (FEWEST * BLOCK)).astype(np.int64)
    some = [one for number in np.unique(part) if (one := each[part == number]).size >= FEWEST]
    return not any(size_of(told[one], as_is[one], power[one], one).warns for one in some)


def _joined(found: Sequence[_Ways]) -> _Ways | None:
    """The ways of all logs."""
    if not found:
        return None
    begun = np.cumsum([0, *(int(one.piece[-1]) + 1 for one in found)])
    piece = np.concatenate([one.piece + first for one, first in zip(found, begun, strict=False)])
    columns = zip(*((one.heading, one.turning, one.span, one.push) for one in found), strict=True)
    heading, turning, span, push = (np.concatenate(column) for column in columns)
    return _Ways(np.concatenate([one.way for one in found]), heading, turning, span, push, piece)


def _ways(log: Log) -> _Ways | None:
    """The ways of a log, where its commands push, if these are known."""
    cut = courses(log)
    if cut is None:
        return None
    way, heading, turning, begins, ends = cut
    push = _push(log, begins, ends)
    driven = np.flatnonzero((push != 0.0) if push.any() else np.abs(way) > 0.0)
    if not driven.size:
        return None
    heading, turning, span, push = (part[driven] for part in (heading, turning, ends - begins, push))
    return _Ways(way[driven], heading, turning, span, push, driven)


def _push(log: Log, begins: Array, ends: Array) -> Array:
    """Sign of the sum of all commands, counted from what is usually their neutral, in pieces (m,); 0 for none."""
    total = np.zeros(begins.size)
    for name, channel in log.channels.items():
        if command_kind(name) is None or channel.time.size < 2:
            continue
        value = channel.value - (1500.0 if name.startswith("pwm") else 0.0)
        reach = float(np.abs(value).max())
        sums = np.concatenate(([0.0], np.cumsum(value[:-1] * np.diff(channel.time))))
        over = np.interp(ends, channel.time, sums) - np.interp(begins, channel.time, sums)
        total += over / reach if reach else 0.0
    return np.sign(total)


def off_course(course: Course, opposed: bool | None, surveyed: bool) -> Mixed | None:
    """What is mixed up in a log whose course and heading go together so; None where nothing is.

    Parameters
    ----------
    opposed : whether heading and yaw rate have opposite signs; None where that is not known
    surveyed : whether positions are made of latitudes and longitudes, whose axes are sure
    """
    if course.sound:
        return None
    mixed = mixed_axes(course.turn, 1, course.angle, course.quarters, opposed)
    if course.turn == 1 and course.quarters == 2:
        mixed = replace(mixed, sentence=f"the bow is taken for the stern, for {mixed.sentence}")
    others = None if course.turn == 1 or surveyed else other_places(course.quarters)
    if others is None:
        return mixed
    return replace(
        mixed,
        channels=(*mixed.channels, "x", "y"),
        sentence=f"{mixed.sentence}; or {others.sentence}",
        remedy=f"{mixed.remedy}; or, if it is the positions, {others.remedy}",
    )
