"""Which way the axes point: the track by position against heading and speeds, under every way of mixing them up.

Position rate = R(psi) [u v] + current. Whatever is reversed, exchanged or turned by an angle in positions, heading or
speeds is one of four rules, each with an angle: the heading runs the right way round or not, and sway to the right side
or not. The rule that explains the track is what the log has.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..canonical import Channel
from ..log import Log
from ..statistics.robust import CI
from .finding import Channels, Fix
from .pieces import fit_pieces, ways

_TIMES = 12.0
"""Standard errors that a ratio must reach to be spoken of: a sixth of itself either way is the widest interval."""
_BETTER = 4.0
"""Times less that another rule must leave of the track: 11 is the least that the right rule has over others in logs of
real boats that turn, 1 what all have where the boat goes straight."""
_LEAST = 2e-4
"""Share of the track that every rule leaves, by rounding and interpolation."""
_TURNED = np.radians(20.0)
"""Angle up to which heading and track differ by a compass or an antenna, and not by axes."""
_QUARTER = np.radians(15.0)
"""Distance from a quarter turn up to which axes are exchanged [rad]: what a compass or an antenna adds to that."""


@dataclass(frozen=True, slots=True)
class Track:
    """What relates the track by position to heading and speeds.

    Attributes
    ----------
    turn, side : -1 where the heading runs the other way round, and where sway points to the other side; else 1
    scale, interval : way by position over way by speeds [1], and its 95 % interval
    angle : from the way by speeds to the way by position, clockwise [rad]
    left : share of the track that this leaves unexplained
    certain : whether scale and angle are known at all
    """

    turn: int
    side: int
    scale: float
    interval: tuple[float, float]
    angle: float
    left: float
    certain: bool

    @property
    def sound(self) -> bool:
        """Whether all axes point where they should."""
        return self.turn == self.side == 1 and abs(self.angle) <= _TURNED


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


def surveyed(logs: Sequence[Log]) -> bool:
    """Whether positions came from latitude and longitude, which fix the handedness of the axes."""
    origins = [log.channels["x"].origin.lower() for log in logs if "x" in log.channels]
    return bool(origins) and all("lat" in origin for origin in origins)


def track_of(logs: Sequence[Log]) -> Track | None:
    """The rule that explains the tracks of logs best; the right one where no other is clearly better.

    None without positions, speed and heading, or where there is too little to compare.
    """
    both = [log for log in logs if {"x", "y", "psi", "u"} <= set(log.channels)]
    rules = [_fitted(both, turn, side) for turn in (1, -1) for side in (1, -1)]
    found = [rule for rule in rules if rule is not None]
    if len(found) < len(rules):
        return None
    best, right = min(found, key=lambda rule: rule.left), found[0]
    clearly = best.certain and max(right.left, _LEAST) > _BETTER * max(best.left, _LEAST)
    return best if clearly else right


def _fitted(logs: Sequence[Log], turn: int, side: int) -> Track | None:
    fit = fit_pieces([ways(log, turn, side) for log in logs])
    if fit is None:
        return None
    (ahead, across), (one, other) = fit.values[:2], fit.errors[:2]
    scale = float(np.hypot(ahead, across))
    # A boat that only ever goes straight ahead says nothing of the way across, whose error is infinite.
    known = scale > 0.0 and np.isfinite([one, other]).all()
    error = float(np.hypot(ahead * one, across * other) / scale) if known else np.inf
    certain = bool(fit.explained >= 0.5 and scale > _TIMES * max(one, other))
    ends = (scale - CI * error, scale + CI * error)
    return Track(turn, side, scale, ends, float(np.arctan2(across, ahead)), 1.0 - fit.explained, certain)


def mixed_up(track: Track, opposed: bool | None) -> Mixed | None:
    """What is mixed up in a log with this track; None where nothing is.

    Parameters
    ----------
    opposed : whether heading and yaw rate have opposite signs; None where that is not known
    """
    if track.sound:
        return None
    quarter = round(track.angle / (0.5 * np.pi))
    degrees = float(np.degrees(track.angle))
    if abs(track.angle - 0.5 * np.pi * quarter) > _QUARTER:
        return _turned(track, degrees, opposed)
    quarter %= 4
    if track.turn == 1:
        return _SPEEDS[quarter] if track.side == -1 else _turned(track, degrees, opposed)
    if track.side == -1:
        return _PLACES[quarter]
    return _turned(track, degrees, opposed)


def other_places(angle: float) -> Mixed | None:
    """What positions may be mixed up where the heading seems mirrored by this angle [rad]; None off a quarter turn."""
    quarter = round(angle / (0.5 * np.pi))
    return _PLACES[quarter % 4] if abs(angle - 0.5 * np.pi * quarter) <= _QUARTER else None


def _turned(track: Track, degrees: float, opposed: bool | None) -> Mixed:
    """The heading off by an angle, and perhaps the wrong way round."""
    names = ("psi",) if track.turn == 1 or opposed else ("psi", "r")
    if track.turn == 1:
        text = f"the boat goes {abs(degrees):.0f} degrees to the {'right' if degrees > 0 else 'left'} of its heading"
        remedy = (
            f"turn the heading with 'psi: {{from: ..., offset: {track.angle:.4f}}}' in a channel map, or x and y, or u "
            "and v, whichever is not in its axes"
        )
        if track.side == -1:
            text = f"{text}, and sway is to the other side"
        return Mixed(("psi", "x", "y", "u", "v"), f"{text}: heading, positions and speeds have other axes", remedy)
    psi = "psi has" if len(names) == 1 else "psi and r have"
    text = f"{psi} the opposite sign: the heading turns against the track"
    if abs(degrees) > np.degrees(_TURNED):
        text = f"{text}, from another north (by {degrees:.0f} degrees)"
    remedy = f"map it with 'psi: {{from: ..., scale: -1, offset: {track.angle:.4f}}}'"
    if len(names) > 1:
        remedy = f"{remedy} and 'r: {{from: ..., scale: -1}}', or say --frame enu if the log is ENU/FLU"
    return Mixed(names, text, remedy)


def _given(rules: Mapping[str, tuple[str, float]]) -> Callable[[Channels], dict[str, Channel]]:
    """Give each channel the stamps and values of another, times a sign."""

    def apply(channels: Channels) -> dict[str, Channel]:
        found = dict(channels)
        for name, (source, sign) in rules.items():
            if source in channels:
                one = channels[source]
                found[name] = Channel(name, one.time, sign * one.value, one.origin, one.lost)
        return found

    return apply


def _pair(first: str, second: str) -> tuple[Mixed, Mixed, Mixed, Mixed]:
    """What is mixed up in a pair of axes whose plane is mirrored, by quarters of a turn."""

    def mixed(names: tuple[str, ...], text: str, rules: dict[str, tuple[str, float]]) -> Mixed:
        lines = ", ".join(f"'{n}: {{from: column of {s}, scale: {sign:g}}}'" for n, (s, sign) in rules.items())
        fix = Fix(f"{text}: put right", _given(rules))
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
