"""Axes and units of a log: the track by position against heading and speeds, or against the heading alone.

Position rate = R(psi) c [u v] + current, with a complex number c. Anything reversed, exchanged, turned or in another
unit is one of four rules: the heading runs the right way round or not, and sway to the right side or not. Where no
speed was measured, a boat's way has no part across its heading but current and the drift of its turns; in a mirrored
log that holds for the mirror image of the heading, in a turned one for a turned heading. The simplest reading is taken
on which no other is much better (there, in squared way across), by the rule of `faults`. The angle of a reading by the
heading alone is half that of the squared ways (Mardia and Jupp, Directional Statistics, 2000, section 9.4).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array
from ..canonical import Channel, command_kind
from ..log import Log
from ..statistics.blocks import interval, numbered_on
from ..statistics.signals import noise_level
from .faults import BLOCK, FEWEST, OVERWHELMING, Size, size_of, size_of_unexplained
from .lags import Pieces, beside_drift, blocks_of_pieces, courses, fit_ways, headings, ways
from .record import Channels, Fix

SPEEDS = {0.514444: "knots", 0.277778: "km/h", 0.3048: "feet per second", 0.44704: "miles per hour", 0.01: "cm/s"}
"""Metres a second in one of the other units of speed: no number that decides."""
LENGTHS = {3.28084: "feet", 100.0: "cm", 1000.0: "mm", 0.001: "km"}
"""The other units of length in a metre, which positions can be in."""


@dataclass(frozen=True, slots=True)
class Axes:
    """A reading of the axes of a log, by its track.

    Attributes
    ----------
    turn, side : -1 where the heading runs the other way round, and where sway points to the other side; else 1
    angle : from the way by speeds, or from the bow, to the way by position, clockwise [rad]
    quarters : quarter turns in that angle; None where it is none of these
    unexplained : share of the track that this leaves unexplained
    size : how much this reading explains beside that of the log as it is recorded
    unrelated : how much of the track no reading explains, beyond noise
    """

    turn: int
    side: int
    angle: float
    quarters: int | None
    unexplained: float
    size: Size
    unrelated: Size

    @property
    def sound(self) -> bool:
        """True when all axes point where they should."""
        return self.turn == self.side == 1 and self.quarters == 0


@dataclass(frozen=True, slots=True)
class Track(Axes):
    """What relates the track by position to heading and speeds.

    Attributes
    ----------
    scale, interval : way by position over way by speeds [1], and its 95 % interval
    unit : the other unit of a length or a speed that the scale is; 1 for none, None for a scale that is no unit
    """

    scale: float
    interval: tuple[float, float]
    unit: float | None

    @property
    def certain(self) -> bool:
        """True when the track follows from heading and speeds."""
        return self.unexplained < OVERWHELMING


@dataclass(frozen=True, slots=True)
class Course(Axes):
    """How the course over ground goes with the heading; see `course_of`.

    The size of its reading is over half of the way, which is what a heading of no meaning leaves across it.

    Attributes
    ----------
    drifts : whether a current, or drift in turns, would have to be most of the way for the log to be right as recorded;
        nothing else speaks against it
    """

    drifts: bool


@dataclass(frozen=True, slots=True)
class Mixed:
    """What is mixed up.

    Attributes
    ----------
    channels : at fault, or one of which is
    sentence, remedy : for a person
    fix : what puts it right, where one change does
    """

    channels: tuple[str, ...]
    sentence: str
    remedy: str
    fix: Fix | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Rule:
    """One way round of heading and sway: the ways by it, the number that fits best, and the interval of its size."""

    turn: int
    side: int
    ways: Pieces
    best: complex
    interval: tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Reading:
    """A rule with a number that it has by some quarter turns and a unit, or by any angle and size (None).

    `swept` are ways (m,) that an antenna sweeps beside the boat's own as it turns [m]; none of one at the origin.
    """

    rule: _Rule
    c: complex
    quarters: int | None
    unit: float | None
    swept: NDArray[np.complex128] | float = 0.0

    def errors(self) -> Array:
        ways = self.rule.ways
        return replace(ways, measured=ways.measured - self.swept).errors(self.c)


def track_of(logs: Sequence[Log]) -> Track | None:
    """Find the simplest reading of tracks, headings and speeds on which no other is much better.

    None without positions, speed and heading, or where there is too little to compare.
    """
    both = [log for log in logs if {"x", "y", "psi", "u"} <= set(log.channels)]
    rules = [one for turn in (1, -1) for side in (1, -1) if (one := _rule(both, turn, side)) is not None]
    if len(rules) < 4:
        return None
    ways, block = rules[0].ways, rules[0].ways.block
    aside = 0.5 * (ways.implied - rules[1].ways.implied)
    way, sway = (np.abs(beside_drift(one, ways.span)) ** 2 for one in (ways.measured, aside))
    as_is, (first, quarters, *others) = ways.errors(1.0), _readings(rules)
    armed = replace(first[0], swept=_swept(both, ways))
    least = min((rule.ways.errors(rule.best) for rule in rules), key=np.sum)
    turned = min(float(one.errors().sum()) for one in quarters)
    for level in (first, [armed] if float(armed.errors().sum()) < turned else quarters, quarters, *others):
        reading = min(level, key=lambda one: float(one.errors().sum()))
        rule, told = reading.rule, reading.errors()
        own = sway if (rule.turn, rule.side, reading.quarters) == (1, -1, 0) else way
        # Sway alone makes little of the way, and is weighed against its own part of it.
        other = next(one for one in rules if (one.turn, one.side) == (rule.turn, -rule.side)).ways.errors(reading.c)
        if not size_of(told, least, way, block).likely and not size_of(told, other, sway, block).likely:
            break
    noise = noise_of_ways(both)
    return Track(
        *(rule.turn, rule.side, float(np.angle(rule.best)), reading.quarters),
        *(float(told.sum() / max(way.sum(), 1e-300)), size_of(as_is, told, own, block)),
        *(size_of_unexplained(least - noise, way - noise, block), abs(rule.best), rule.interval, reading.unit),
    )


def _swept(logs: Sequence[Log], ways: Pieces) -> NDArray[np.complex128]:
    """The part of the ways of a log as recorded that an antenna sweeps, of the arm that explains most [m]."""
    found = headings(logs)
    turned, rest = (beside_drift(part, ways.span) for part in (found.measured, ways.measured - ways.implied))
    arm = np.vdot(turned, rest) / max(float(np.vdot(turned, turned).real), 1e-300)
    return (found.measured * arm).astype(np.complex128)


def _readings(rules: Sequence[_Rule]) -> list[list[_Reading]]:
    """Readings from the simplest on: as recorded, by quarter turns, in another unit, of any size, at any angle."""
    quarters = [round(float(np.angle(rule.best)) / (0.5 * np.pi)) % 4 for rule in rules]
    sizes = [max(abs(rule.best), 1e-12) for rule in rules]
    units = [min((*SPEEDS, *LENGTHS), key=lambda unit, s=size: abs(np.log(s / unit))) for size in sizes]
    pairs = list(zip(rules, quarters, strict=True))
    return [
        [_Reading(rules[0], 1.0 + 0.0j, 0, 1.0)],
        [_Reading(rule, 1j**near, near, 1.0) for rule, near in pairs],
        [_Reading(rule, unit * 1j**near, near, unit) for (rule, near), unit in zip(pairs, units, strict=True)],
        [_Reading(rule, size * 1j**near, near, None) for (rule, near), size in zip(pairs, sizes, strict=True)],
        [_Reading(rule, rule.best / size, None, 1.0) for rule, size in zip(rules, sizes, strict=True)],
        [_Reading(rule, rule.best, None, None) for rule in rules],
    ]


def noise_of_ways(logs: Sequence[Log]) -> float:
    """Mean square of what noise of the positions makes of the way over a piece [m^2]."""
    found = [sum((noise_level(log.channels[name].value) or 0.0) ** 2 for name in ("x", "y")) for log in logs]
    return 2.0 * float(np.mean(found))


def _rule(logs: Sequence[Log], turn: int, side: int) -> _Rule | None:
    found = ways(logs, turn, side)
    fit = None if found is None else fit_ways(found)
    if found is None or fit is None:
        return None
    (ahead, across), (one, other) = fit.values[:2], fit.errors[:2]
    scale = float(np.hypot(ahead, across))
    # A boat that only ever goes straight ahead says nothing of the way across, whose error is infinite.
    known = scale > 0.0 and np.isfinite([one, other]).all()
    error = float(np.hypot(ahead * one, across * other) / scale) if known else np.inf
    return _Rule(turn, side, found, complex(ahead, across), interval(scale, error))


def surveyed(logs: Sequence[Log]) -> bool:
    """True when positions came from latitude and longitude, which fix the handedness of the axes."""
    origins = [log.channels["x"].origin.lower() for log in logs if "x" in log.channels]
    return bool(origins) and all("lat" in origin for origin in origins)


def mixed_up(axes: Axes, opposed: bool | None) -> Mixed | None:
    """What is mixed up in a log with these axes; None where nothing is.

    Parameters
    ----------
    opposed : whether heading and yaw rate have opposite signs; None where that is not known
    """
    if axes.sound:
        return None
    angle, quarters = axes.angle, axes.quarters
    if axes.side == -1 and quarters is not None:
        return (_SPEEDS if axes.turn == 1 else _PLACES)[quarters]
    names = ("psi",) if axes.turn == 1 or opposed else ("psi", "r")
    degrees = float(np.degrees(angle))
    if axes.turn == 1:
        text = f"the boat goes {abs(degrees):.0f} degrees to the {'right' if degrees > 0 else 'left'} of its heading"
        remedy = (
            f"turn the heading with 'psi: {{from: ..., offset: {angle:.4f}}}' in a channel map, or x and y, or u "
            "and v, whichever is not in its axes"
        )
        if axes.side == -1:
            text = f"{text}, and sway is to the other side"
        return Mixed(("psi", "x", "y", "u", "v"), f"{text}: heading, positions and speeds have other axes", remedy)
    psi = "psi has" if len(names) == 1 else "psi and r have"
    text = f"{psi} the opposite sign: the heading turns against the track"
    if quarters != 0:
        text = f"{text}, from another north (by {degrees:.0f} degrees)"
    remedy = f"map it with 'psi: {{from: ..., scale: -1, offset: {angle:.4f}}}'"
    if len(names) > 1:
        remedy = f"{remedy} and 'r: {{from: ..., scale: -1}}', or say --frame enu if the log is ENU/FLU"
    return Mixed(names, text, remedy)


def taken_from(rules: Mapping[str, tuple[str, float]]) -> Callable[[Channels], dict[str, Channel]]:
    """Give each channel the stamps and values of another, times a sign."""

    def apply(channels: Channels) -> dict[str, Channel]:
        result = dict(channels)
        for name, (source, sign) in rules.items():
            if source in channels:
                one = channels[source]
                result[name] = Channel(name, one.time, sign * one.value, one.origin, one.lost)
        return result

    return apply


def _pair(first: str, second: str) -> tuple[Mixed, Mixed, Mixed, Mixed]:
    """What is mixed up in a pair of axes whose plane is mirrored, by quarters of a turn."""

    def mixed(names: tuple[str, ...], text: str, rules: dict[str, tuple[str, float]]) -> Mixed:
        lines = ", ".join(f"'{n}: {{from: column of {s}, scale: {sign:g}}}'" for n, (s, sign) in rules.items())
        fix = Fix(f"{text}: put right", taken_from(rules))
        return Mixed(names, text, f"map {lines}; or say --frame enu if the log is ENU/FLU", fix)

    both = (first, second)
    swapped = f"{first} and {second} are swapped"
    return (
        mixed((second,), f"{second} has the opposite sign", {second: (second, -1.0)}),
        mixed(both, swapped, {first: (second, 1.0), second: (first, 1.0)}),
        mixed((first,), f"{first} has the opposite sign", {first: (first, -1.0)}),
        mixed(both, f"{swapped} and reversed", {first: (second, -1.0), second: (first, -1.0)}),
    )


_SPEEDS, _PLACES = _pair("u", "v"), _pair("x", "y")


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
    steady = np.abs(ways.turning) < 0.5 * np.pi
    steady &= np.unique(block[steady]).size >= FEWEST
    unrelated = size_of_unexplained((left - noise)[steady], (power - 2.0 * noise)[steady], block[steady])
    if found[-1].likely:
        return Course(*found, unrelated, drifts=False)
    alone = _read(ways, block, beside=False)
    drifts = min(alone[-1].share.value, 0.5 * alone[-1].weight.value) > 1.0 - OVERWHELMING
    return Course(*(alone if drifts else found), unrelated, drifts)


def _read(ways: _Ways, block: NDArray[np.int64], beside: bool) -> tuple[int, int, float, int | None, float, Size]:
    """The simplest reading on which no other is much better: turn, side, angle, quarters, what it leaves, and its size.

    Parameters
    ----------
    beside : whether a current and drift in turns explain what they can of every reading
    """

    def across(turn: int, angle: float, _: int | None) -> Array:
        return ways.across(turn, angle, beside)

    power, free = np.abs(ways.way) ** 2, {turn: ways.angle(turn) for turn in (1, -1)}
    numbers = {turn: round(angle / (0.5 * np.pi)) for turn, angle in free.items()}
    levels: list[list[tuple[int, float, int | None]]] = [
        [(1, 0.0, 0)],
        [(turn, 0.5 * np.pi * number, number % 4) for turn, number in numbers.items()],
        [(turn, angle, None) for turn, angle in free.items() if _holds(ways, turn, angle)],
    ]
    as_is = across(1, 0.0, 0)
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
    return turn, 1, angle, quarters, float(told.sum() / power.sum()), size_of(as_is, told, 0.5 * power, block)


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
    joined = _Ways(*(np.concatenate([getattr(one, part.name) for one in found]) for part in fields(_Ways)))
    return replace(joined, piece=numbered_on([one.piece for one in found]))


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
    mixed = mixed_up(course, opposed)
    if mixed is None:
        return None
    if course.turn == 1 and course.quarters == 2:
        why = f"the bow is taken for the stern, or the commands are turned round, for {mixed.sentence}"
        mixed = replace(mixed, sentence=why, remedy=f"{mixed.remedy}; if it is the commands, turn these round there")
    if course.turn == 1 or surveyed or course.quarters is None:
        return mixed
    others = _PLACES[course.quarters]
    return replace(
        mixed,
        channels=(*mixed.channels, "x", "y"),
        sentence=f"{mixed.sentence}; or {others.sentence}",
        remedy=f"{mixed.remedy}; or, if it is the positions, {others.remedy}",
    )
