"""Whether two records of one quantity agree in size: degrees for radians, knots for metres a second, and the like."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np

from ...physics.frames import Array, body_to_earth
from ..channels import Channel
from ..log import Log
from .finding import Channels, Check, Finding, Fix, Verdict
from .record import Record
from .regression import Fit, robust_fit

_WINDOW = 4.0
"""Length of the pieces over which changes are compared [s]: long beside the noise of a position, short beside drift."""
_LEAST_PIECES = 6
_NEAR = 0.12
"""Relative distance to a known ratio up to which it is that one."""
_FINE = 0.05
_LARGE = 0.2
_TIMES = 12.0
"""Standard errors that a ratio must reach to be spoken of: a sixth of itself either way is the widest interval."""
_CLEARLY = 0.02
_DEGREE = float(np.pi / 180.0)
_SPEEDS = {
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
class _Pair:
    """Changes over pieces by one record (the slope's unit) and by the other, with the number of the piece's stretch."""

    target: Array
    columns: Array
    piece: np.ndarray


@final
class Units(Check):
    """Compares the turning of the heading with the yaw rate, and the way made good with the speeds."""

    name: ClassVar[str] = "units"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: one finding for the angles, one for the speeds."""
        angles, degrees = _angles([record.log for record in records])
        cured = [_with(record.log, degrees.apply) for record in records] if degrees else [r.log for r in records]
        found = [*angles, *_speeds(cured)]
        return found or [Finding(self.name, "cannot tell", "nothing was measured twice; no unit can be checked")]


def _angles(logs: Sequence[Log]) -> tuple[list[Finding], Fix | None]:
    both = [log for log in logs if {"psi", "r"} <= set(log.channels)]
    if not both:
        return [], None
    fits = {scale: _fit([_turns(log, scale) for log in both]) for scale in (1.0, _DEGREE)}
    radians, degrees = fits[1.0], fits[_DEGREE]
    # Where the heading never wraps, both readings of it fit alike, and the ratio alone speaks.
    wraps = degrees is not None and (radians is None or degrees.explained > radians.explained + _CLEARLY)
    best = _DEGREE if wraps else 1.0
    fit = fits[best]
    channels = ("psi", "r")
    if fit is None or not _known(fit):
        return [Finding("units", "cannot tell", _TURNS_LITTLE, channels=channels)], None
    ratio = float(fit.values[0]) / best
    interval = fit.interval(0)
    ends = None if interval is None else (interval[0] / best, interval[1] / best)
    if best == 1.0 and abs(ratio - 1.0) <= _FINE:
        text = f"heading and yaw rate agree in size (ratio {ratio:.3f})"
        return [Finding("units", "ok", text, ratio, "1", ends, channels)], None
    told = f"the heading psi turns {abs(ratio):.3g} times as fast as the yaw rate r says"
    wrong = "turns, yaw damping and every yaw moment come out wrong by this factor"
    for factor, name, unit in ((1.0 / _DEGREE, "psi", "degrees"), (_DEGREE, "r", "degrees per second")):
        if abs(abs(ratio) / factor - 1.0) <= _NEAR:
            fix = _scale((name,), _DEGREE, f"{name} turned from {unit} into radians")
            remedy = f"map it with '{name}: {{from: ..., scale: 0.017453292519943}}'"
            text = f"{told}: {name} is in {unit}"
            return [Finding("units", "defect", text, ratio, "1", ends, (name,), wrong, remedy, fix)], fix
    if best == _DEGREE and abs(abs(ratio) * best - _DEGREE) <= _NEAR * _DEGREE:
        fix = _scale(channels, _DEGREE, "psi and r turned from degrees into radians")
        remedy = "map both with 'scale: 0.017453292519943'"
        text = "psi is in degrees and r in degrees per second"
        return [Finding("units", "defect", text, ratio, "1", ends, channels, wrong, remedy, fix)], fix
    if ratio < 0.0:
        remedy = "say --frame enu if the log is ENU/FLU, or turn one of them with 'scale: -1' in a channel map"
        text = f"psi and r have opposite signs (ratio {ratio:.3g})"
        return [
            Finding("units", "defect", text, ratio, "1", ends, channels, "which side is port is lost", remedy)
        ], None
    remedy = "check the gyro's scale; a compass deviation changes the ratio with the heading, too"
    return [Finding("units", _verdict(ratio), told, ratio, "1", ends, channels, wrong, remedy)], None


def _known(fit: Fit) -> bool:
    return bool(fit.explained >= 0.5 and fit.certain(0, _TIMES))


def _verdict(ratio: float) -> Verdict:
    return "warning" if abs(ratio - 1.0) > _LARGE else "note"


_TURNS_LITTLE = "the boat turns too little to compare the units of heading and yaw rate"
_MOVES_LITTLE = "the boat moves too little to compare the units of position and speed"


def _speeds(logs: Sequence[Log]) -> list[Finding]:
    both = [log for log in logs if {"x", "y", "psi", "u"} <= set(log.channels)]
    if not both:
        return []
    channels = ("u", "v", "x", "y") if all("v" in log.channels for log in both) else ("u", "x", "y")
    fit = _fit([_ways(log) for log in both])
    if fit is None or not _known(fit):
        return [Finding("units", "cannot tell", _MOVES_LITTLE, channels=channels)]
    ratio, ends = float(fit.values[0]), fit.interval(0)
    if abs(ratio - 1.0) <= _FINE:
        text = f"position and speed agree in size (ratio {ratio:.3f})"
        return [Finding("units", "ok", text, ratio, "1", ends, channels)]
    told = f"the way made good is {abs(ratio):.3g} times what the speeds say"
    wrong = "drag and thrust come out wrong by powers of this factor"
    speeds = tuple(name for name in ("u", "v") if name in channels)
    for factor, unit in _SPEEDS.items():
        if abs(ratio / factor - 1.0) <= _FINE:
            fix = _scale(speeds, factor, f"{' and '.join(speeds)} turned from {unit} into m/s")
            remedy = f"map them with 'scale: {factor:g}'"
            return [
                Finding("units", "defect", f"{told}: they are in {unit}", ratio, "1", ends, speeds, wrong, remedy, fix)
            ]
    for factor, unit in _LENGTHS.items():
        if abs(ratio / factor - 1.0) <= _FINE:
            other = " (or the speeds in mm/s)" if unit == "km" else ""
            remedy = f"map x and y with 'scale: {1.0 / factor:g}' if that is so"
            text = f"{told}: the positions look like {unit}{other}"
            return [Finding("units", "defect", text, ratio, "1", ends, ("x", "y"), wrong, remedy)]
    if ratio < 0.0:
        remedy = "check which way the axes point; say --frame enu if the log is ENU/FLU"
        text = f"the boat moves against its own speeds (ratio {ratio:.3g})"
        return [Finding("units", "defect", text, ratio, "1", ends, channels, "forces change sign", remedy)]
    remedy = "find out which of the two is in another unit, and map it with a scale"
    return [Finding("units", _verdict(ratio), told, ratio, "1", ends, channels, wrong, remedy)]


def _turns(log: Log, scale: float) -> _Pair | None:
    heading, rate = log.channels["psi"], log.channels["r"]
    angle = np.unwrap(scale * heading.value)
    total = _integral(rate.time, rate.value)
    return _pieces(heading.time, [(angle, [_at(heading.time, rate, total)])], max(heading.period, rate.period))


def _ways(log: Log) -> _Pair | None:
    """Changes of position by position itself and by the speeds turned into the earth; a current is a constant."""
    x, y, u = (log.channels[name] for name in ("x", "y", "u"))
    if x.time.size != y.time.size:
        return None
    psi = log.channels["psi"]
    heading = np.interp(u.time, psi.time, np.unwrap(psi.value))
    sway = log.channels.get("v")
    starboard = np.interp(u.time, sway.time, sway.value) if sway else np.zeros(u.time.size)
    north, east = body_to_earth(heading, u.value, starboard)
    ways = [_at(x.time, u, _integral(u.time, part)) for part in (north, east)]
    return _pieces(x.time, [(x.value, [ways[0]]), (y.value, [ways[1]])], max(x.period, u.period))


def _integral(time: Array, rate: Array) -> Array:
    return np.concatenate(([0.0], np.cumsum(0.5 * np.diff(time) * (rate[1:] + rate[:-1]))))


def _at(time: Array, channel: Channel, total: Array) -> Array:
    """An integral at other stamps, NaN outside."""
    return np.interp(time, channel.time, total, left=np.nan, right=np.nan)


def _pieces(time: Array, records: list[tuple[Array, list[Array]]], period: float) -> _Pair | None:
    """Cut records into pieces of 4 s (longer where samples are far apart), none across a hole."""
    window = max(_WINDOW, 8.0 * period)
    edges = np.arange(time[0], time[-1], window) if time.size > 2 else np.zeros(0)
    if edges.size < 2:
        return None
    first = np.searchsorted(time, edges)
    start, stop = first[:-1], first[1:]
    span = time[stop] - time[start]
    whole = (span > 0.5 * window) & (span < 1.5 * window)
    parts = []
    for number, (target, columns) in enumerate(records):
        steps = [column[stop] - column[start] for column in columns]
        drift = np.zeros((start.size, len(records)))
        drift[:, number] = span
        parts.append((target[stop] - target[start], np.column_stack([*steps, drift]), np.arange(start.size)))
    target, columns, piece = (np.concatenate([part[k] for part in parts]) for k in range(3))
    keep = np.tile(whole, len(records)) & np.isfinite(columns).all(axis=1) & np.isfinite(target)
    return _Pair(target[keep], columns[keep], piece[keep]) if keep.any() else None


def _fit(pairs: Sequence[_Pair | None]) -> Fit | None:
    known = [pair for pair in pairs if pair is not None]
    if not known or sum(pair.target.size for pair in known) < _LEAST_PIECES:
        return None
    begun, pieces = 0, []
    for pair in known:
        pieces.append(begun + pair.piece)
        begun += int(pair.piece.max()) + 1
    target = np.concatenate([pair.target for pair in known])
    return robust_fit(np.concatenate([pair.columns for pair in known]), target, np.concatenate(pieces))


def _scale(names: Sequence[str], factor: float, sentence: str) -> Fix:
    def apply(channels: Channels) -> dict[str, Channel]:
        return {
            name: replace(channel, value=factor * channel.value) if name in names else channel
            for name, channel in channels.items()
        }

    return Fix(sentence, apply)


def _with(log: Log, change: Callable[[Channels], dict[str, Channel]]) -> Log:
    return replace(log, channels=change(log.channels))
