"""Course over ground against heading: the direction of the axes where no speed was measured.

A boat under way goes where its bow points, but for some drift: course minus heading keeps to zero (its concentration is
the mean resultant length; Mardia and Jupp, Directional Statistics, 2000, section 2.3). With a mirrored heading or
position, course plus heading does; with the bow taken for the stern, course minus heading keeps to half a turn. Doubled
angles (section 9.4) count a boat that goes astern as one that goes ahead.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array
from ..canonical import command_kind
from ..log import Log
from ..statistics.blocks import CI, robust_fit
from ..statistics.signals import noise_level
from .axes import Mixed, mixed_axes, other_places
from .lags import courses

_LEAST = 8
"""Pieces under way that are needed: eight agree by chance in 1 of 128 cases."""
_FAST = 0.5
"""Share of its usual top speed from which a boat is under way, and its drift small beside its speed."""
_NOISE = 6.0
"""Standard errors of a way between two fixes from which its direction is known to ten degrees."""
_BETTER = 4.0
"""Times less that the mirrored reading must leave, as in `axes`."""
_SLACK = 0.02
"""What a concentration leaves by drift of eight degrees [1]: less tells nothing of the axes."""
_KEEPS, _CONTRADICTS = 0.8, 0.3
"""Concentration of doubled angles from which course and heading go together (drift of 19 degrees leaves it), and below
which, either way round, they do not; real logs and simulated ones have 0.85 and more, drawn angles of 20 pieces up to
0.4 in one of a hundred."""
_MANY = 20
"""Pieces under way that are needed to say that heading and track have nothing to do with each other."""
_STRAIGHT = 0.9
"""Concentration of the doubled heading from which a log holds one course: there, a current or a wind may be what turns
the track."""
_TURNED, _ACROSS = np.radians(20.0), np.radians(60.0)
"""Angle between bow and track up to which a boat drifts that does not turn, as in `axes`, and one that holds one course
in a current or a wind [rad]."""
_QUARTER = np.radians(15.0)
"""Distance from a quarter turn up to which that is what is meant, as in `axes` [rad]."""
_ASTERN = np.radians(120.0)
"""Angle from which a boat goes astern [rad]."""


@dataclass(frozen=True, slots=True)
class Course:
    """How the course over ground goes with the heading.

    Attributes
    ----------
    turn : -1 where course plus heading keeps to one angle, else 1
    angle, error : that angle, from bow to track, clockwise, where the boat does not turn, and its standard error [rad]:
        outward drift grows with the turning, and is taken off
    kept : concentration of the doubled angle, in the better reading
    other : the same in the other one
    one_sided : whether the log holds one course, or turns to one side alone: it does not show what drift is left
        without a current, or without a turn
    driven : share of the way that is made while the commands push ahead, less that while they push astern; None where
        no command is known
    pieces : under way
    """

    turn: int
    angle: float
    error: float
    kept: float
    other: float
    one_sided: bool
    driven: float | None
    pieces: int


def course_of(logs: Sequence[Log]) -> Course | None:
    """Compare course and heading of logs with positions; None where the boats are hardly under way."""
    found = [piece for log in logs if {"x", "y", "psi"} <= set(log.channels) for piece in [_under_way(log)] if piece]
    if not found:
        return None
    way, heading, turning, push = map(np.concatenate, zip(*found, strict=True))
    if way.size < _LEAST:
        return None
    size = np.abs(way)
    ahead = way * np.exp(-1j * heading)
    mirrored = way * np.exp(1j * heading)
    kept = {turn: _kept(one, size) for turn, one in ((1, ahead), (-1, mirrored))}
    left = {turn: max(1.0 - one, _SLACK) for turn, one in kept.items()}
    turn = -1 if left[1] > _BETTER * left[-1] and kept[-1] > _KEEPS else 1
    angle, error = _angle(ahead if turn == 1 else mirrored, turning)
    low, high = np.quantile(turning, [0.1, 0.9])
    one_sided = _kept(size * np.exp(1j * heading), size) > _STRAIGHT or not low < 0.0 < high
    known = np.isfinite(push).all()
    driven = float((size * np.sign(push)).sum() / size.sum()) if known else None
    return Course(turn, angle, error, kept[turn], kept[-turn], bool(one_sided), driven, way.size)


def _angle(angles: NDArray[np.complex128], turning: Array) -> tuple[float, float]:
    """Angle of complex numbers (n,) where the turning (n,) is zero, on a line over it, and its standard error [rad].

    What goes the other way round is turned about: the boat goes astern there, or ahead if it mostly goes astern.
    """
    axis = 0.5 * float(np.angle((np.abs(angles) * np.exp(2j * np.angle(angles))).sum()))
    axis += np.pi * float((angles * np.exp(-1j * axis)).sum().real < 0.0)
    left = np.angle(angles * np.exp(-1j * axis))
    left = (left + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    fit = robust_fit(np.column_stack([np.ones(left.size), turning]), left, np.arange(left.size))
    return float(np.angle(np.exp(1j * (axis + fit.values[0])))), float(fit.errors[0])


def _kept(angles: NDArray[np.complex128], weight: Array) -> float:
    """Concentration of doubled angles (n,) of complex numbers, by weight."""
    return float(np.abs((weight * np.exp(2j * np.angle(angles))).sum()) / weight.sum())


def _under_way(log: Log) -> tuple[NDArray[np.complex128], Array, Array, Array] | None:
    """Ways (m,) [m], north and east as one complex number, headings and turning [rad], and the push of each."""
    cut = courses(log)
    if cut is None:
        return None
    way, heading, turning, begins, ends = cut
    north, east = (noise_level(log.channels[name].value) or 0.0 for name in ("x", "y"))
    usual = float(np.quantile(np.abs(way), 0.9))
    fast = np.abs(way) > max(_FAST * usual, _NOISE * float(np.hypot(north, east)), 1e-9)
    return way[fast], heading[fast], turning[fast], _push(log, begins[fast], ends[fast])


def _push(log: Log, begins: Array, ends: Array) -> Array:
    """Sum of all commands, counted from what is usually their neutral, in pieces (m,); NaN where none is known."""
    total = np.full(begins.size, np.nan)
    for name, channel in log.channels.items():
        if command_kind(name) is None or channel.time.size < 2:
            continue
        value = channel.value - (1500.0 if name.startswith("pwm") else 0.0)
        reach = float(np.abs(value).max())
        sums = np.concatenate(([0.0], np.cumsum(value[:-1] * np.diff(channel.time))))
        over = np.interp(ends, channel.time, sums) - np.interp(begins, channel.time, sums)
        total = np.where(np.isnan(total), 0.0, total) + (over / reach if reach else 0.0)
    return total


def contradicts(course: Course) -> bool:
    """True when heading and track have nothing to do with each other."""
    return course.pieces >= _MANY and max(course.kept, course.other) < _CONTRADICTS


def off_course(course: Course, opposed: bool | None, surveyed: bool) -> tuple[Mixed, bool] | None:
    """What is mixed up in a log whose course and heading go together so, and whether that is sure.

    Parameters
    ----------
    opposed : whether heading and yaw rate have opposite signs; None where that is not known
    surveyed : whether positions are made of latitudes and longitudes, whose axes are sure

    Returns
    -------
    (Mixed, bool) or None
        None where nothing is. What one straight course shows is not sure: a current may do as much.
    """
    if course.kept < _KEEPS:
        return None
    number = round(course.angle / (0.5 * np.pi))
    near = abs(course.angle - 0.5 * np.pi * number) <= _QUARTER
    angle, quarters = (0.5 * np.pi * number, number % 4) if near else (course.angle, None)
    if course.turn == 1:
        least = _ACROSS if course.one_sided else _TURNED
        if not abs(angle) - CI * course.error > least:
            return None
        if abs(angle) > _ASTERN and (course.driven is None or course.driven < 0.0):
            return None  # it is driven astern, or may be
    mixed = mixed_axes(course.turn, 1, angle, quarters, opposed)
    if course.turn == 1 and abs(angle) > _ASTERN:
        mixed = replace(mixed, sentence=f"the bow is taken for the stern, for {mixed.sentence}")
    others = None if course.turn == 1 or surveyed else other_places(quarters)
    if others is not None:
        mixed = replace(
            mixed,
            channels=(*mixed.channels, "x", "y"),
            sentence=f"{mixed.sentence}; or {others.sentence}",
            remedy=f"{mixed.remedy}; or, if it is the positions, {others.remedy}",
        )
    known = f"course and heading go together to {course.kept:.2f}, as they are to {course.other:.2f}"
    if course.turn == 1:
        known = f"course and heading keep to this angle, to {course.kept:.2f}"
    return replace(mixed, sentence=f"{mixed.sentence} ({known})"), not course.one_sided
