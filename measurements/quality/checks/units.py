"""Whether two records of one quantity agree in size and sign: degrees for radians, knots for metres a second, axes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np

from ...canonical import Channel
from ...log import Log
from ...statistics.robust import Fit
from ..axes import Mixed, Track, mixed_up, surveyed, track_of
from ..course import contradicts, course_of, off_course
from ..finding import Channels, Check, Finding, Fix, Reach, Verdict
from ..pieces import apart, fit_pieces, turns
from ..record import Record
from ..speed_unit import speed_unit

_NEAR = 0.12
"""Relative distance to a known ratio up to which it is that one."""
_FINE = 0.05
"""Share by which two records of one quantity may differ in size: sensors are calibrated to some per cent."""
_LARGE = 0.15
"""Share by which one of two records must be too large, over all of its interval, to make what is found false: compass
deviation makes up to that of the ratio of heading and yaw rate in a log of few headings."""
_TIMES = 12.0
"""Standard errors that a ratio must reach to be spoken of: a sixth of itself either way is the widest interval."""
_CLEARLY = 0.02
"""Share of the turning by which the heading must follow better in degrees than in radians to be in degrees."""
_CONTRADICTS = 0.3
"""Share of the track that speeds leave unexplained from which they are of another motion; real logs have 0.004."""
_DEGREE = float(np.pi / 180.0)
SPEEDS = {
    0.514444: "knots",
    0.277778: "km/h",
    0.3048: "feet per second",
    0.44704: "miles per hour",
    0.01: "cm/s",
}
"""Metres a second in one of the other units of speed."""
_LENGTHS = {3.28084: "feet", 100.0: "cm", 1000.0: "mm", 0.001: "km"}
"""The other units of length in a metre, which positions can be in."""


@dataclass(frozen=True, slots=True)
class _Turning:
    """How heading and yaw rate compare.

    Attributes
    ----------
    ratio, ends : turning of the heading over that of the yaw rate [1], and its interval
    degrees : whether the heading is to be read in degrees
    """

    ratio: float
    ends: tuple[float, float] | None
    degrees: bool


@final
class Units(Check):
    """Compares the turning of the heading with the yaw rate, and the way made good with heading and speeds."""

    name: ClassVar[str] = "units"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: one finding for the angles, one for the speeds."""
        logs = [record.log for record in records]
        turned = any({"psi", "r"} <= set(log.channels) for log in logs)
        turning = _turning(logs)
        degrees = None if turning is None else _in_degrees(turning)
        cured = [_with(log, degrees.fix.apply) for log in logs] if degrees and degrees.fix else logs
        track = track_of(cured)
        clock = _clock(turning, track)
        if clock is not None:
            return [clock]
        found: list[Finding] = []
        if degrees is not None:
            found.append(degrees)
        elif turning is not None:
            found.append(_turns(turning, track))
        elif turned and (left := apart(logs)) is not None:
            found.append(_unlike(left))
        elif turned:
            found.append(Finding(check=self.name, verdict="cannot tell", sentence=_TURNS_LITTLE, channels=("psi", "r")))
        opposed = None if turning is None else turning.ratio < 0.0
        speeds = _speeds(cured, track, opposed)
        if speeds is None or (speeds.verdict == "ok" and all(_turned_by_heading(log) for log in cured)):
            found += _course(cured, opposed)
        found += [speeds] if speeds is not None else speed_unit(records, SPEEDS)
        return found or [
            Finding(
                check=self.name, verdict="cannot tell", sentence="nothing was measured twice; no unit can be checked"
            )
        ]


def _turning(logs: Sequence[Log]) -> _Turning | None:
    both = [log for log in logs if {"psi", "r"} <= set(log.channels)]
    if not both:
        return None
    fits = {scale: fit_pieces([turns(log, scale) for log in both]) for scale in (1.0, _DEGREE)}
    radians, degrees = fits[1.0], fits[_DEGREE]
    # Where the heading never wraps, both readings of it fit alike, and the ratio alone speaks.
    wraps = degrees is not None and (radians is None or degrees.explained > radians.explained + _CLEARLY)
    best = _DEGREE if wraps else 1.0
    fit = fits[best]
    if fit is None or not _known(fit):
        return None
    interval = fit.interval(0)
    ends = None if interval is None else (interval[0] / best, interval[1] / best)
    return _Turning(float(fit.values[0]) / best, ends, wraps)


def _in_degrees(turning: _Turning) -> Finding | None:
    """The finding that heading or yaw rate is in degrees, None where neither is."""
    ratio, channels = turning.ratio, ("psi", "r")
    told = f"the heading psi turns {abs(ratio):.3g} times as fast as the yaw rate r says"
    wrong = "turns, yaw damping and every yaw moment come out wrong by this factor"
    for factor, name, unit in ((1.0 / _DEGREE, "psi", "degrees"), (_DEGREE, "r", "degrees per second")):
        if abs(abs(ratio) / factor - 1.0) <= _NEAR:
            fix = _scale((name,), _DEGREE, f"{name} turned from {unit} into radians")
            remedy = f"map it with '{name}: {{from: ..., scale: 0.017453292519943}}'"
            return _off("defect", f"{told}: {name} is in {unit}", ratio, turning.ends, (name,), wrong, remedy, fix)
    if turning.degrees and abs(abs(ratio) * _DEGREE - _DEGREE) <= _NEAR * _DEGREE:
        fix = _scale(channels, _DEGREE, "psi and r turned from degrees into radians")
        text = "psi is in degrees and r in degrees per second"
        remedy = "map both with 'scale: 0.017453292519943'"
        return _off("defect", text, ratio, turning.ends, channels, wrong, remedy, fix)
    return None


def _turns(turning: _Turning, track: Track | None) -> Finding:
    """How heading and yaw rate compare where both are in radians; the track says which of the two is at fault."""
    ratio, ends, channels = turning.ratio, turning.ends, ("psi", "r")
    if abs(ratio - 1.0) <= _FINE:
        text = f"heading and yaw rate agree in size (ratio {ratio:.3f})"
        return Finding(check="units", verdict="ok", sentence=text, value=ratio, unit="1", ci95=ends, channels=channels)
    if ratio < 0.0:
        remedy = "say --frame enu if the log is ENU/FLU, or turn one of them with 'scale: -1' in a channel map"
        text = f"psi and r have opposite signs (ratio {ratio:.3g})"
        if track is not None and track.certain and track.turn == 1:
            text = f"{text}; the track follows psi, so r has the opposite sign"
            remedy = (
                "turn it with 'r: {from: ..., scale: -1}' in a channel map; or say --frame enu if the log is ENU/FLU"
            )
        return _off("defect", text, ratio, ends, channels, "which side is port is lost", remedy)
    told = f"the heading psi turns {ratio:.3g} times as fast as the yaw rate r says"
    wrong = "turns, yaw damping and every yaw moment come out wrong by this factor"
    remedy = (
        f"check the gyro's scale ('r: {{from: ..., scale: {ratio:.3g}}}' would agree); a compass deviation changes "
    )
    remedy += "the ratio with the heading, too"
    return _off(_verdict(ratio, ends), told, ratio, ends, channels, wrong, remedy)


def _unlike(left: float) -> Finding:
    """Heading and yaw rate that have nothing to do with each other, whichever of them is late."""
    text = (
        f"heading and yaw rate contradict each other: {100.0 * left:.0f} % of the turning of psi does not follow from r"
    )
    wrong = "one of them is of another thing, or was never measured"
    remedy = "find out which, and leave it out with 'psi: null' or 'r: null' in a channel map, or map the boat's own"
    return _off("defect", text, left, None, ("psi", "r"), wrong, remedy)


def _clock(turning: _Turning | None, track: Track | None) -> Finding | None:
    """Stamps in another unit: heading and track both move as much faster, or slower, than their rates say."""
    if turning is None or track is None or not track.certain or turning.degrees or turning.ratio <= 0.0:
        return None
    ratio = turning.ratio
    if abs(ratio - 1.0) <= _LARGE or abs(track.scale / ratio - 1.0) > _FINE:
        return None
    text = f"the stamps run {1.0 / ratio:.3g} times as fast as the motion: heading and track both say so"
    remedy = f"give the time in seconds (times {ratio:.3g})"
    return _off("defect", text, ratio, turning.ends, tuple("t"), "every acceleration is wrong", remedy)


def _speeds(logs: Sequence[Log], track: Track | None, opposed: bool | None) -> Finding | None:
    """How the track compares with the speeds; None where it cannot be compared at all."""
    both = [log for log in logs if {"x", "y", "psi", "u"} <= set(log.channels)]
    if not both:
        return None
    channels = ("u", "v", "x", "y") if all("v" in log.channels for log in both) else ("u", "x", "y")
    if track is None or not track.certain:
        return _unrelated(both, track, channels)
    mixed = mixed_up(track, opposed)
    if mixed is not None:
        return _axes(mixed, track)
    ratio, ends = track.scale, track.interval
    if abs(ratio - 1.0) <= _FINE:
        text = f"position and speed agree in size (ratio {ratio:.3f})"
        return Finding(check="units", verdict="ok", sentence=text, value=ratio, unit="1", ci95=ends, channels=channels)
    told = f"the way made good is {ratio:.3g} times what the speeds say"
    wrong = "drag and thrust come out wrong by powers of this factor"
    speeds = tuple(name for name in ("u", "v") if name in channels)
    for factor, unit in SPEEDS.items():
        if abs(ratio / factor - 1.0) <= _FINE:
            fix = _scale(speeds, factor, f"{' and '.join(speeds)} turned from {unit} into m/s")
            remedy = f"map them with 'scale: {factor:g}'"
            return _off("defect", f"{told}: they are in {unit}", ratio, ends, speeds, wrong, remedy, fix)
    for factor, unit in _LENGTHS.items():
        if abs(ratio / factor - 1.0) <= _FINE:
            other = " (or the speeds in mm/s)" if unit == "km" else ""
            remedy = f"map x and y with 'scale: {1.0 / factor:g}' if that is so"
            text = f"{told}: the positions look like {unit}{other}"
            return _off("defect", text, ratio, ends, ("x", "y"), wrong, remedy)
    remedy = "find out which of the two is in another unit, and map it with a scale"
    return _off(_verdict(ratio, ends), told, ratio, ends, channels, wrong, remedy)


def _course(logs: Sequence[Log], opposed: bool | None) -> list[Finding]:
    """How the course over ground goes with the heading, where no speed was measured; nothing where it is sound."""
    course = course_of(logs)
    if course is None:
        return []
    channels, wrong = ("psi", "x", "y"), "forces act along other axes than the boat's; nothing can be learned"
    if contradicts(course):
        text = (
            f"heading and track contradict each other: over {course.pieces} pieces under way the course has nothing to "
            f"do with psi, nor with its mirror image (concentrations {course.kept:.2f} and {course.other:.2f})"
        )
        remedy = "one of them is of another thing or another run: find out which, and map the boat's own (--map)"
        return [_off("defect", text, course.kept, None, channels, wrong, remedy)]
    rated = any("r" in log.channels for log in logs)  # else the heading alone can be turned
    off = off_course(course, opposed if rated else True, surveyed(logs))
    if off is None:
        return []
    mixed, sure = off
    return [
        Finding(
            check="units",
            verdict="defect" if sure else "warning",
            sentence=mixed.sentence
            if sure
            else f"{mixed.sentence}, on one course or in turns to one side: a current or much drift does so, too",
            value=float(np.degrees(course.angle)),
            unit="deg",
            channels=mixed.channels,
            consequence=wrong,
            remedy=mixed.remedy,
            reach=Reach.LOG,
        )
    ]


def _turned_by_heading(log: Log) -> bool:
    """Whether the speeds of a log were made of velocities in earth axes and of its heading, which they cannot check."""
    return "u" in log.channels and ", " in log.channels["u"].origin


def _axes(mixed: Mixed, track: Track) -> Finding:
    text = f"{mixed.sentence} (so {100.0 * (1.0 - track.left):.1f} % of the track follows from heading and speeds)"
    angle = float(np.degrees(track.angle))
    wrong = "forces act along other axes than the boat's; nothing can be learned"
    parts = {"angle": angle, "heading": float(track.turn), "sway": float(track.side)}
    return Finding(
        check="units",
        verdict="defect",
        sentence=text,
        value=track.scale,
        unit="1",
        ci95=track.interval,
        channels=mixed.channels,
        consequence=wrong,
        remedy=mixed.remedy,
        fix=mixed.fix,
        parts=parts,
        short=mixed.sentence,
        reach=Reach.LOG,
    )


def _unrelated(logs: Sequence[Log], track: Track | None, channels: tuple[str, ...]) -> Finding:
    """Positions and speeds that have nothing to do with each other, or too little of both to tell."""
    moves = [_moves(log) for log in logs]
    if track is None or track.left < _CONTRADICTS or not all(moves):
        return Finding(check="units", verdict="cannot tell", sentence=_MOVES_LITTLE, channels=channels)
    text = f"positions and speeds contradict each other: {100.0 * track.left:.0f} % of the track follows from neither"
    wrong = "one of them is of another motion, or was never measured"
    remedy = "find out which, and leave it out with 'u: null' (and v) or 'x: null' (and y) in a channel map"
    return _off("defect", text, track.left, None, channels, wrong, remedy)


def _moves(log: Log) -> bool:
    """Whether positions and speed both move, far beyond their noise."""
    x, y, u = (log.channels[name] for name in ("x", "y", "u"))
    if min(channel.time.size for channel in (x, y, u)) < 3:
        return False
    way = np.hypot(np.ptp(x.value), np.ptp(y.value))
    steps = np.hypot(np.median(np.abs(np.diff(x.value))), np.median(np.abs(np.diff(y.value))))
    ahead = float(np.abs(u.value).mean()) * float(u.time[-1] - u.time[0])
    return bool(way > 100.0 * steps and ahead > 0.3 * way)


def _known(fit: Fit) -> bool:
    return bool(fit.explained >= 0.5 and fit.certain(0, _TIMES))


def _verdict(ratio: float, ends: tuple[float, float] | None) -> Verdict:
    """A defect where all of the interval is off; a warning where the ratio is, by a fifth; else a note."""
    if ends is not None and (ends[0] > 1.0 + _LARGE or ends[1] < 1.0 - _LARGE):
        return "defect"
    return "warning" if abs(ratio - 1.0) > 0.2 else "note"


_TURNS_LITTLE = "the boat turns too little to compare the units of heading and yaw rate"
_MOVES_LITTLE = "the boat moves too little to compare the units of position and speed"


def _off(
    verdict: Verdict,
    sentence: str,
    ratio: float,
    ends: tuple[float, float] | None,
    channels: tuple[str, ...],
    wrong: str,
    remedy: str,
    fix: Fix | None = None,
) -> Finding:
    """Two records that do not agree; a defect of this kind spoils the whole log."""
    return Finding(
        check="units",
        verdict=verdict,
        sentence=sentence,
        value=ratio,
        unit="1",
        ci95=ends,
        channels=channels,
        consequence=wrong,
        remedy=remedy,
        fix=fix,
        reach=Reach.LOG,
    )


def _scale(names: Sequence[str], factor: float, sentence: str) -> Fix:
    def apply(channels: Channels) -> dict[str, Channel]:
        return {
            name: replace(channel, value=factor * channel.value) if name in names else channel
            for name, channel in channels.items()
        }

    return Fix(sentence, apply)


def _with(log: Log, change: Callable[[Channels], dict[str, Channel]]) -> Log:
    return replace(log, channels=change(log.channels))
