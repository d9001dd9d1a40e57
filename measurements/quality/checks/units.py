"""Checks of units and signs between two records of one quantity: degrees for radians, knots for m/s, axes, and time.

Each pair is read in every way in which it may have been recorded. The simplest reading is taken on which no other is
much better; another than the log's own is a fault, weighed by its size; see `faults`. Where stamps are in another unit
than seconds, heading and way change by one factor faster than their rates say.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ....physics.motion import Array
from ...canonical import Channel
from ...channels.channel_map import TIME, Entry, map_text
from ...formats.base import PER_SECOND
from ...log import Log
from ...statistics.blocks import numbered_on, robust_fit
from ..axes import LENGTHS, SPEEDS, Mixed, Track, course_of, mixed_up, off_course, surveyed, track_of
from ..faults import BLOCK, FEWEST, OVERWHELMING, Fault, Kind, Size, size_of
from ..lags import Pieces, turns, unexplained_turning
from ..quick_motion import pushes_of
from ..record import RATE, About, Channels, Check, Finding, Fix, Found, Record, Stretch, altered

FINE = 0.1
"""Share by which two records of one quantity may differ in size, and a factor from a unit: sensors are calibrated to
some per cent, thrust and mass are known to ten."""
_PIECE = 2.0
"""Length of a piece over which changes of speed are compared [s]: a boat's answer to its thrusters."""
_DEGREE = float(np.pi / 180.0)
"""Radians in a degree: no number that decides."""


def _examine(records: Sequence[Record]) -> Found:
    """Compare the turning of the heading with the yaw rate, and the way made good with heading and speeds.

    One finding for the angles, one for the speeds.
    """
    logs = [record.log for record in records]
    turned = any({"psi", "r"} <= set(log.channels) for log in logs)
    turning = turning_of(logs)
    degrees = None if turning is None else _in_degrees(records, turning)
    cured = logs
    if degrees is not None and degrees.fix is not None:
        cured = [replace(log, channels=degrees.fix.apply(log.channels)) for log in logs]
    track = track_of(cured)
    found: list[Finding] = []
    if degrees is not None:
        found.append(degrees)
    elif turning is not None:
        found.append(_turns(turning, track))
    elif turned:
        found.append(_unlike(unexplained_turning(logs)))
    opposed = None if turning is None else turning.sign < 0
    speeds = _speeds(cured, track, opposed)
    if speeds is None or (speeds.verdict == "ok" and all(_turned_by_heading(log) for log in cured)):
        found += _course(cured, opposed)
    found += [speeds] if speeds is not None else speed_unit(records)
    return found or [About("units").untold("nothing was measured twice; no unit can be checked")]


class Turning(NamedTuple):
    """How heading and yaw rate are read: factors to radians, the sign of the rate, and what that explains.

    Attributes
    ----------
    heading, rate : radians in what each is recorded in; the rate's is any number where it is in no unit
    sign : -1 where the rate runs the other way round
    ratio, ends : turning of the heading as it is recorded over that of the yaw rate [1], and its interval
    size : what this reading explains beside that of the log as it is recorded
    """

    heading: float
    rate: float
    sign: int
    ratio: float
    ends: tuple[float, float] | None
    size: Size


def turning_of(every_log: Sequence[Log]) -> Turning | None:
    """The simplest reading of heading and yaw rate; None where no reading makes them agree."""
    logs = [log for log in every_log if {"psi", "r"} <= set(log.channels)]
    every = {scale: found for scale in (1.0, _DEGREE) if (found := turns(logs, scale)) is not None}
    if len(every) < 2 or every[1.0].span.size < FEWEST:
        return None
    wraps = _wraps(logs)
    scales = tuple(every) if wraps is None else (_DEGREE,)
    fits = {s: robust_fit(np.column_stack([t.implied, t.span]), t.measured, t.piece) for s, t in every.items()}
    block = every[1.0].block
    as_is, power = _errors(every[1.0], 1.0), np.ones(block.size)
    left = {scale: _errors(every[scale], float(fits[scale].values[0])) for scale in scales}
    free = scales[-1] if size_of(left[scales[0]], left[scales[-1]], power, block).likely else scales[0]
    least = left[free]
    units = [(s, q) for q in (1.0, _DEGREE, -1.0, -_DEGREE) for s in scales]
    levels: list[list[tuple[float, float]]] = [[(1.0, 1.0)]] if wraps is None else []
    for level in (*levels, units, [(free, float(fits[free].values[0]))]):  # the last is the least itself
        scale, rate = min(level, key=lambda one: float(_errors(every[one[0]], one[1]).sum()))
        if not size_of(told := _errors(every[scale], rate), least, power, block).likely:
            break
    if size_of(power, least, power, block).share.value < 0.5:  # most of the turning has another cause
        return None
    # A heading that wraps by 360 is in degrees, however steadily the boat turns.
    size, fit = wraps or size_of(as_is, told, power, block), fits[scale]
    ends = fit.interval(0)
    ends = None if ends is None else (ends[0] / scale, ends[1] / scale)
    return Turning(scale, abs(rate), 1 if rate > 0.0 else -1, float(fit.values[0]) / scale, ends, size)


def _errors(found: Pieces, rate: float) -> Array:
    """Squared errors by piece of turning, over its power, where the yaw rate is times a factor; with its bias."""
    return found.errors(rate) / max(float((found.measured**2).mean()), 1e-300)


def _wraps(logs: Sequence[Log]) -> Size | None:
    """How much of the steps of headings is explained by turns of 360, beside turns of 2 pi: a record wraps by one.

    None where it is too little to be likely.
    """
    columns, blocks = [], []
    for log in logs:
        heading = log.channels["psi"]
        step = np.abs(np.diff(heading.value))
        radians, degrees = (np.minimum(step, np.abs(step - turn)) for turn in (2.0 * np.pi, 360.0))
        columns.append(np.column_stack([radians, degrees, step]) ** 2)
        blocks.append(((heading.time[1:] - heading.time[0]) // BLOCK).astype(np.int64))
    as_is, turned, power = np.concatenate(columns).T
    size = size_of(as_is, turned, power, numbered_on(blocks))
    return size if size.likely else None


def _in_degrees(records: Sequence[Record], turning: Turning) -> Finding | None:
    """The finding that heading or yaw rate is in degrees, None where neither is."""
    told = f"the heading psi turns {abs(turning.ratio):.3g} times as fast as the yaw rate r says"
    names = tuple(n for n, unit in (("psi", turning.heading), ("r", turning.rate)) if unit == _DEGREE)
    if not names:
        return None
    units = {"psi": "degrees", "r": "degrees per second"}
    if len(names) > 1:
        done, text = "psi and r turned from degrees into radians", "psi is in degrees and r in degrees per second"
        cure = "map both with 'scale: 0.017453292519943'"
    else:
        name = next(iter(names))
        done, text = f"{name} turned from {units[name]} into radians", f"{told}: {name} is in {units[name]}"
        cure = f"map it with '{name}: {{from: ..., scale: 0.017453292519943}}'"
    facts = {"told": text, "cure": cure}
    fix = _scale(names, _DEGREE, done)
    mends = records[0].scaled(names, _DEGREE)
    return Fault(Kind.ANGLE_UNIT, names, turning.size, facts, turning.ratio, turning.ends, fix, mends=mends).ruled()


def _turns(turning: Turning, track: Track | None) -> Finding:
    """How heading and yaw rate compare where both are in radians; the track says which of the two is at fault."""
    ratio, ends, channels = turning.ratio, turning.ends, ("psi", "r")
    told = f"the heading psi turns {ratio:.3g} times as fast as the yaw rate r says"
    cure = f"check the gyro's scale ('r: {{from: ..., scale: {ratio:.3g}}}' would agree); a compass deviation changes "
    cure += "the ratio with the heading, too"
    kind = Kind.ANGLE_UNIT
    if turning.sign < 0:
        kind, told = Kind.OPPOSED, f"psi and r have opposite signs (ratio {ratio:.3g})"
        cure = "say --frame enu if the log is ENU/FLU, or turn one of them with 'scale: -1' in a channel map"
        if track is not None and track.certain and track.turn == 1:
            told = f"{told}; the track follows psi, so r has the opposite sign"
            cure = "turn it with 'r: {from: ..., scale: -1}' in a channel map; or say --frame enu if the log is ENU/FLU"
    fault = Fault(kind, channels, turning.size, {"told": told, "cure": cure}, ratio, ends)
    if (result := fault.ruled()) is not None:
        return result
    if abs(ratio - 1.0) > FINE:
        return fault.in_words("note")
    return About("units", channels, ratio, "1", ends).ok(f"heading and yaw rate agree in size (ratio {ratio:.3f})")


def _unlike(left: Size | None) -> Finding:
    """Heading and yaw rate that do not agree: nothing to do with each other, whichever is late, or too little seen."""
    names, cure = ("psi", "r"), "'psi: null' or 'r: null'"
    found = left and _unrelated(names, "heading and yaw rate", cure, left, left.weight.value)
    return found or About("units", names).untold(_TURNS_LITTLE)


def _speeds(logs: Sequence[Log], track: Track | None, opposed: bool | None) -> Finding | None:
    """How the track compares with the speeds; None where it cannot be compared at all."""
    both = [log for log in logs if {"x", "y", "psi", "u"} <= set(log.channels)]
    if not both:
        return None
    channels = ("u", "v", "x", "y") if all("v" in log.channels for log in both) else ("u", "x", "y")
    if track is None or not track.certain:
        cure = "'u: null' (and v) or 'x: null' (and y)"
        found = track and _unrelated(channels, "positions and speeds", cure, track.unrelated, track.unexplained)
        return found or About("units", channels).untold(_MOVES_LITTLE)
    mixed, ratio, ends = mixed_up(track, opposed), track.scale, track.interval
    if mixed is not None:
        facts = _facts(mixed, track.unexplained, "heading and speeds")
        angle = float(np.degrees(track.angle))
        parts = {"angle": angle, "heading": float(track.turn), "sway": float(track.side)}
        found = Fault(Kind.AXES, mixed.channels, track.size, facts, ratio, ends, mixed.fix, parts).ruled()
        if found is not None:
            return found
    names, told, cure, fix = channels, f"the way made good is {ratio:.3g} times what the speeds say", _EITHER, None
    speeds = tuple(name for name in ("u", "v") if name in channels)
    unit = next((one for one in (*SPEEDS, *LENGTHS) if abs(ratio / one - 1.0) <= FINE and track.unit == one), None)
    if unit in SPEEDS:
        names, told = speeds, f"{told}: they are in {SPEEDS[unit]}"
        cure = f"map them with 'scale: {unit:g}'"
        fix = _scale(speeds, unit, f"{' and '.join(speeds)} turned from {SPEEDS[unit]} into m/s")
    elif unit is not None:
        other = " (or the speeds in mm/s)" if LENGTHS[unit] == "km" else ""
        names, told = ("x", "y"), f"{told}: the positions look like {LENGTHS[unit]}{other}"
        cure = f"map x and y with 'scale: {1.0 / unit:g}' if that is so"
    fault = Fault(Kind.SPEED_UNIT, names, track.size, {"told": told, "cure": cure}, ratio, ends, fix)
    if track.unit != 1.0 and (found := fault.ruled()) is not None:
        return found
    if abs(ratio - 1.0) > FINE:
        return fault.in_words("note")
    return About("units", channels, ratio, "1", ends).ok(f"position and speed agree in size (ratio {ratio:.3f})")


def _course(logs: Sequence[Log], opposed: bool | None) -> list[Finding]:
    """How the course over ground goes with the heading, where no speed was measured; nothing where it is sound."""
    course = course_of(logs)
    if course is None:
        return []
    size, cure = course.unrelated, "'psi: null' or 'x: null' (and y)"
    unrelated = _unrelated(("psi", "x", "y"), "heading and track", cure, size, size.weight.value)
    if unrelated is not None:
        return [unrelated]
    rated = any("r" in log.channels for log in logs)  # else the heading alone can be turned
    mixed = off_course(course, opposed if rated else True, surveyed(logs))
    if mixed is None:
        return []
    facts = _facts(mixed, course.unexplained, "the heading")
    angle = float(np.degrees(course.angle))
    fault = Fault(Kind.AXES, mixed.channels, course.size, facts, angle, unit="deg")
    if not course.drifts:
        return [found] if (found := fault.ruled()) is not None else []
    text = f"{mixed.sentence}, on one course or in turns to one side: a current or much drift does so, too"
    return [fault.in_words("warning").model_copy(update={"sentence": text})]


def _unrelated(names: tuple[str, ...], told: str, cure: str, size: Size, value: float) -> Finding | None:
    """The finding that two records have nothing to do with each other; None where they have."""
    return Fault(Kind.UNRELATED, names, size, {"told": told, "cure": cure}, value).ruled()


def _facts(mixed: Mixed, unexplained: float, by: str) -> dict[str, object]:
    """What is told of axes that are mixed up, of which so much of the track is not explained by other records."""
    return {"told": mixed.sentence, "cure": mixed.remedy, "follows": 100.0 * (1.0 - unexplained), "by": by}


def _turned_by_heading(log: Log) -> bool:
    """Whether the speeds of a log were made of velocities in earth axes and of its heading, which they cannot check."""
    return "u" in log.channels and ", " in log.channels["u"].origin


def speed_unit(records: Sequence[Record]) -> list[Finding]:
    """Tell the unit of speeds that are measured once; one finding, none where the logs have no speeds of their own.

    Parameters
    ----------
    records : logs without positions
    """
    having = [record for record in records if "u" in record.log.channels and record.stretches]
    if not having:
        return []
    channels = ("u", "v") if all("v" in record.log.channels for record in having) else ("u",)
    for witness, asked in (
        ("the accelerometer", _by_accelerometer),
        ("the vehicle's mass, as its thrusters push it,", _by_mass),
    ):
        found = asked(having)
        if found is None:
            continue
        factor, size = found
        unit = next((one for one in SPEEDS if abs(factor / one - 1.0) <= FINE), None)
        if unit is not None and size.share.low > 1.0 - OVERWHELMING:  # it explains the log, and does not only better it
            told = f"{' and '.join(channels)} are in {SPEEDS[unit]}: {witness} moves {factor:.3g} times as fast as said"
            cure = f"map them with 'scale: {unit:g}', or mend the vehicle's mass or thrust if speeds are right"
            fault = Fault(Kind.SPEED_UNIT, channels, size, {"told": told, "cure": cure}, factor)
            if (one := fault.ruled()) is not None:
                return [one]
        if abs(factor - 1.0) <= FINE:
            text = f"{witness} agrees with speeds in m/s"
            return [About("units", channels, factor, "1").ok(text)]
    top = max(float(np.abs(stretch.motion.velocity[:, 0]).max()) for record in having for stretch in record.stretches)
    return [
        About("units", channels, top, "m/s").untold(
            f"the unit of speed cannot be told: speed was measured once (no positions), and its top is "
            f"{top:.2g} m/s, or {0.514444 * top:.2g} m/s if it is in knots",
            consequence="drag and thrust come out wrong by powers of the unit",
            remedy="make sure that speeds are in m/s, or log positions, too",
            short="the unit of speed, which was measured once",
        )
    ]


def _by_accelerometer(records: Sequence[Record]) -> tuple[float, Size] | None:
    """How many times as fast as the speeds say the accelerometer moves; a tilt by speed is a part of its own."""
    rows = []
    for record, stretch in _stretches(records):
        channel = record.log.channels.get("ax")
        if channel is None:
            continue
        surge, sway, rate = stretch.motion.velocity.T
        felt = np.interp(stretch.motion.time, channel.time, channel.value)
        total = _summed([felt, -sway * rate, np.ones_like(surge), surge * np.abs(surge)])
        rows.append((total[:, :1], _changed(surge) + total[:, 1], total[:, 2:]))
    return _factor(rows, inverse=False)


def _by_mass(records: Sequence[Record]) -> tuple[float, Size] | None:
    """How many times as fast as the speeds say thrust moves the vehicle's mass, whatever its drag may be."""
    rows = []
    for record, stretch in _stretches(records):
        motion, vehicle = record.driven(stretch), record.vehicle
        if motion is None or vehicle is None:
            continue
        still = replace(motion, velocity=np.zeros_like(motion.velocity))
        weather, pushes = pushes_of(vehicle, still, [thruster.channel for thruster in vehicle.thrusters])
        push, count = pushes[:, :, 0].T, len(vehicle.thrusters)
        surge, sway, rate = motion.velocity.T
        total = _summed([*push, surge, surge * np.abs(surge), sway * rate, weather[:, 0]])
        rows.append((total[:, :count], _changed(surge), total[:, count:]))
    return _factor(rows, inverse=True)


def _factor(rows: Sequence[tuple[Array, Array, Array]], inverse: bool) -> tuple[float, Size] | None:
    """The factor of the speeds, and what it explains beside none; None where it is not known.

    Parameters
    ----------
    rows : of each stretch, what moves the boat (pieces, k), what the speeds say (pieces,), and what is there besides
    inverse : one of several causes may be weak, and the strongest that can tell is heard; else there is but one
    """
    if not rows:
        return None
    cause, change, besides = (np.concatenate([row[k] for row in rows]) for k in range(3))
    piece = np.arange(change.size)
    table = np.column_stack([cause if inverse else change[:, None], besides])
    target = change if inverse else cause[:, 0]
    fit = robust_fit(table, target, piece)
    values = fit.values[: table.shape[1] - besides.shape[1]]
    known = np.array([value > 0.0 and fit.certain(place, FEWEST) for place, value in enumerate(values)])
    if not known.any():
        return None
    strongest = int(np.argmax(np.where(known, values, -np.inf)))
    best, said, left = float(values[strongest]), table[:, strongest], target - table @ fit.values
    series = np.column_stack([left + (best - 1.0) * said, left, said])
    as_is, factored, power = ((series - besides @ np.linalg.lstsq(besides, series, rcond=1e-9)[0]) ** 2).T
    return 1.0 / best if inverse else best, size_of(as_is, factored, power, piece * round(_PIECE) // round(BLOCK))


def _stretches(records: Sequence[Record]) -> list[tuple[Record, Stretch]]:
    """Stretches of records that hold four rows of a speed in a piece: with fewer, its changes are hardly seen."""
    known = [record for record in records if 4.0 * record.log.channels["u"].period <= _PIECE]
    return [(record, stretch) for record in known for stretch in record.stretches]


def _changed(series: Array) -> Array:
    """Changes of a series over pieces."""
    return np.diff(series[:: round(_PIECE * RATE)])


def _summed(columns: Sequence[Array]) -> Array:
    """Integrals of columns over pieces, (pieces, columns)."""
    total = np.cumsum(np.column_stack(columns), axis=0) / RATE
    return np.diff(np.concatenate([np.zeros((1, total.shape[1])), total])[:-1][:: round(_PIECE * RATE)], axis=0)


_TURNS_LITTLE = "the boat turns too little to compare the units of heading and yaw rate"
_MOVES_LITTLE = "the boat moves too little to compare the units of position and speed"
_EITHER = "find out which of the two is in another unit, and map it with a scale"


def _scale(names: Sequence[str], factor: float, sentence: str) -> Fix:
    return Fix(sentence, partial(altered, names=names, change=lambda c: replace(c, value=factor * c.value)))


UNITS = Check("units", _examine)


def _time_unit(records: Sequence[Record]) -> Found:
    """Find stamps in another unit, where heading and yaw rate, and way and speed, both say so.

    A finding where the time is in another unit, else none.
    """
    return [found for record in records if (found := _in_other_time(record.log)) is not None][:1]


def _in_other_time(log: Log) -> Finding | None:
    """Heading and track both move as much faster, or slower, than their rates say, by one factor."""
    turning = turning_of([log])
    if turning is None or turning.heading != 1.0 or turning.sign < 0 or not turning.size.likely:
        return None
    track, slow = track_of([log]), turning.ratio
    if track is None or not track.certain or abs(track.scale / slow - 1.0) > FINE:
        return None
    unit = next((name for name, per in PER_SECOND.items() if abs(slow * per - 1.0) <= FINE), None)
    if unit is None:
        facts = {"told": f"the stamps run {1.0 / slow:.3g} times as fast as the motion"}
        facts["cure"] = f"give the time in seconds (times {slow:.3g})"
        return Fault(Kind.TIME_UNIT, ("t",), turning.size, facts, slow, turning.ends).ruled()
    factor = 1.0 / PER_SECOND[unit]
    mends: dict[str, Entry | None] = {TIME: Entry(log.clock, factor)} if log.clock else {}
    line = map_text(mends).strip() or f"time: {{from: ..., unit: {unit}}}"

    def apply(channels: Channels) -> dict[str, Channel]:
        return {name: replace(channel, time=factor * channel.time) for name, channel in channels.items()}

    facts = {"told": f"the stamps are in {unit}", "cure": f"say so in a channel map: '{line}'"}
    fix = Fix(f"time turned from {unit} into seconds", apply)
    return Fault(Kind.TIME_UNIT, ("t",), turning.size, facts, factor, None, fix, mends=mends).ruled()


TIME_UNIT = Check("time unit", _time_unit)
