"""Channel maps: the user's word on which stream is which channel; throttle and steering mixed into two sides."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...physics.errors import LogError, shown
from ...physics.files import yaml_text
from ...physics.motion import GRAVITY, Array
from ...physics.reading import read_yaml, reason
from ...physics.thrusters import side_named
from ..canonical import COMMAND_UNITS, UNITS, command_kind, is_canonical, unit_of
from ..formats.base import PER_SECOND, TimeColumn

_RANGES = {"pwm": (1500.0, 500.0), "normalized": (0.0, 1.0)}
"""Neutral and reach of commands whose limits are known, as `physics.thrusters` has them for curves."""


def mixed(name: str, throttle: tuple[Array, Array], steering: tuple[Array, Array]) -> Array:
    """Mix throttle and steering into the command of one side, at the stamps of the throttle.

    With t and s in -1..1, port = (t + s) / k and starboard = (t - s) / k, k = max(1, |t| + |s|): where both do not fit,
    both give way alike. So does ArduPilot for thrusters that push astern as hard as ahead and `MOT_STR_THR_MIX` 0.5,
    its default (AP_MotorsUGV.cpp, output_skid_steering). Newtons and rad/s have no limit that is known: k = 1.

    Parameters
    ----------
    name : of the command, which tells the side
    throttle, steering : stamps [s] and values, in the unit of the command; a steering holds until its next value

    Examples
    --------
    >>> now = np.zeros(1)
    >>> [float(mixed(f"normalized_{side}", (now, now + 0.9), (now, now + 0.6))[0]) for side in ("port", "stbd")]
    [1.0, 0.20000000000000004]
    """
    kind, thruster = command_kind(name) or ("", "")
    neutral, reach = _RANGES.get(kind, (0.0, 1.0))
    known = np.isfinite(steering[1])
    time, value = steering[0][known], steering[1][known]
    if not time.size:
        return np.full(throttle[0].size, np.nan)
    row = np.searchsorted(time, throttle[0], side="right") - 1
    share = (throttle[1] - neutral) / reach
    turn = np.where(row >= 0, (value[np.maximum(row, 0)] - neutral) / reach, np.nan)
    size = np.maximum(1.0, np.abs(share) + np.abs(turn)) if kind in _RANGES else 1.0
    sign = 1.0 if side_named(thruster) == "port" else -1.0
    return neutral + reach * (share + sign * turn) / size


TIME = "time"
"""What a map calls the column of a table that holds its time; it is no channel."""
_USUAL = {"scale": 1.0, "offset": 0.0, "frame": None}
"""What a line of a channel map need not say."""
_KEYS = {"from", "scale", "offset", "frame", "unit", "mix", "steering"}
_UNITS = {
    "deg": {"rad": math.pi / 180.0, "deg": 1.0},
    "deg/s": {"rad/s": math.pi / 180.0},
    "1e-7 deg": {"rad": 1e-7 * math.pi / 180.0, "deg": 1e-7},
    "knots": {"m/s": 1852.0 / 3600.0},
    "km/h": {"m/s": 1.0 / 3.6},
    "cm/s": {"m/s": 0.01},
    "cm": {"m": 0.01},
    "g": {"m/s^2": GRAVITY},
    "rpm": {"rad/s": math.pi / 30.0},
    "percent": {"1": 0.01},
    **{unit: {"s": 1.0 / ticks} for unit, ticks in PER_SECOND.items()},
}
"""Units that a stream may be in -> units of the channels that they fit, and what one of them is in these."""
_SAME: dict[str, str] = dict.fromkeys(("kn", "kt", "kts"), "knots")
"""Other names of these units: ISO 80000 has kn, pilots and most receivers have kt."""
Parts = dict[str, str | float | dict[str, str | float]]
"""What a line of a channel map says, as plain values; a steering that is mixed in has its own."""
_MOST_UNUSED = 40
"""Names that a remark lists: a bag has hundreds, and whoever maps channels asks `inspect --json`."""
_LONGEST = 300
"""Letters of a name that stands in a remark."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of a channel map: the channel is `scale` times the stream plus `offset`.

    Attributes
    ----------
    source : `topic:field`, or a column (or a field that only one topic has)
    scale, offset : applied to the file's values, before any change of axes
    frame : "ned", "enu", or None for the frame of the log
    steering : of the command of a side that is mixed of throttle and steering (`mix: skid`), the steering; else None
    """

    source: str
    scale: float = 1.0
    offset: float = 0.0
    frame: str | None = None
    steering: "Entry | None" = None

    @property
    def sources(self) -> tuple[str, ...]:
        """All streams that it takes."""
        return (self.source, *(self.steering.sources if self.steering else ()))

    def times(self, factor: float, zero: float = 0.0) -> "Entry":
        """The entry of the same channel times a factor, about a value that stays."""
        return replace(self, scale=factor * self.scale, offset=factor * self.offset + zero * (1.0 - factor))


def read_channel_map(path: Path) -> dict[str, Entry | None]:
    """Read a channel map, a YAML mapping from canonical name to stream.

    .. code-block:: yaml

        u: "/dvl:velocity.ahead"                            # topic:field of a long table
        psi: {from: heading_deg, unit: deg}                 # a column, degrees to radians
        v: {from: sway_to_port, frame: enu}                 # body FLU instead of FRD
        newton_port: "/thrusters/1:data"
        normalized_port: {from: throttle, mix: skid, steering: steering}   # of a boat steered by its two sides
        pwm_port: null                                      # leave this channel out
        time: {from: clock, unit: ms}                       # of a table whose time has no usual name, or another unit
        r: 3                                                # of a table without names: the third column

    The channel is `scale * stream + offset` (1 and 0 when absent); with a `unit` (deg, deg/s, 1e-7 deg, knots or kn or
    kt, km/h, cm/s, cm, g, rpm, percent) that fits the channel, both are turned into the channel's own. `frame: enu`
    says that the entry is the ENU/FLU channel of that name (x east, y north, psi counter-clockwise from east, v and r
    to port); without it a ROS-style field mapped to its own channel (`x` from `pose.position.x`) is ENU/FLU, and
    everything else is in the frame of the log. `mix: skid` makes the command of a side of throttle and steering as
    ArduPilot does, see `mixing`; the steering is a stream, or has a scale and an offset of its own.

    Raises
    ------
    LogError
        when the file is missing, is not such a mapping, names an unknown channel or key, or a unit that cannot be the
        channel's.
    """
    if not path.exists():
        raise LogError(f"{path}: no such channel map; expected a YAML file of 'channel: topic:field' lines.")
    try:
        content = read_yaml(path)
    except (OSError, ValueError) as error:
        text = f"the channel map is not YAML ({reason(error)}). Quote names that hold a colon."
        raise LogError(f"{path}: {text}") from error
    if not content:
        raise LogError(f"{path}: the channel map has no line; write some, such as 'psi: heading', or leave it out.")
    if not isinstance(content, dict):
        raise LogError(f"{path}: expected lines of 'channel: topic:field' in the channel map, got {shown(content)}.")
    return entries_of(path, content)


def entries_of(path: Path, content: Mapping[Any, Any]) -> dict[str, Entry | None]:
    """The channel map that plain values say, as its file has them; what is an `Entry` already is one.

    Raises
    ------
    LogError
        see `read_channel_map`; `path` stands in messages.
    """
    return {
        _name(path, key): value if value is None or isinstance(value, Entry) else entry_of(path, key, value)
        for key, value in content.items()
    }


def _name(path: Path, key: Any) -> str:
    if not isinstance(key, str) or not (key == TIME or is_canonical(key)):
        kinds = ", ".join(f"{kind}_<thruster>" for kind in COMMAND_UNITS)
        raise LogError(
            f"{path}: unknown channel {shown(key)} in the channel map; expected time, {' '.join(UNITS)}, {kinds}."
        )
    return key


def entry_of(path: Path, key: str, value: Any) -> Entry:
    """Check a line of a channel map, whose file is named in messages.

    Raises
    ------
    LogError
        see `read_channel_map`.
    """
    value = value if isinstance(value, dict) else {"from": value}
    number = value.get("from")
    if isinstance(number, int) and not isinstance(number, bool) and number > 0:
        value = {**value, "from": f"column {number}"}
    if not isinstance(value.get("from"), str) or set(value) - _KEYS:
        raise LogError(
            f"{path}: channel map entry '{key}' must be 'topic:field', a column or its number, null, or a mapping with "
            f"'from' and optionally scale, offset, unit, frame; got {shown(value)}."
        )
    numbers = []
    for part in ("scale", "offset"):
        number = value.get(part, _USUAL[part])
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise LogError(f"{path}: channel map entry '{key}' needs a number as {part}, got {shown(number)}.")
        numbers.append(float(number))
    frame = value.get("frame")
    if frame not in (None, "ned", "enu"):
        raise LogError(f"{path}: channel map entry '{key}' needs frame ned or enu, got {shown(frame)}.")
    unit = value.get("unit")
    unit = _SAME.get(unit, unit) if isinstance(unit, str) else unit
    if unit is not None and (not isinstance(unit, str) or unit not in _UNITS):
        raise LogError(
            f"{path}: channel map entry '{key}' needs a unit among {', '.join(_UNITS)}, or a scale; got {shown(unit)}."
        )
    own = "s" if key == TIME else unit_of(key)
    factor = 1.0 if unit is None else _UNITS[unit].get(own)
    if factor is None:
        fitting = [name for name, factors in _UNITS.items() if own in factors]
        raise LogError(
            f"{path}: channel map entry '{key}' is a channel in {own}; expected a unit that fits it "
            f"({', '.join(fitting) or 'there is none here'}), or a scale; got {shown(unit)}."
        )
    if key == TIME and (numbers[0] <= 0.0 or numbers[1] != 0.0 or frame is not None):
        raise LogError(f"{path}: channel map entry 'time' needs a scale above 0 [s], and no offset or frame.")
    steering = _steering(path, key, value.get("mix"), value.get("steering"))
    return Entry(value["from"], factor * numbers[0], factor * numbers[1], frame, steering)


def _steering(path: Path, key: str, mix: object, steering: object) -> Entry | None:
    """The steering of an entry that is mixed."""
    if mix is None and steering is None:
        return None
    if mix != "skid" or steering is None:
        raise LogError(
            f"{path}: channel map entry '{key}' needs both 'mix: skid' and 'steering: STREAM' to make a side's command "
            f"of throttle ('from') and steering; got mix {shown(mix)} and steering {shown(steering)}."
        )
    if not side_named((command_kind(key) or ("", ""))[1]):
        raise LogError(
            f"{path}: channel map entry '{key}' is mixed of throttle and steering, but its name tells no side; "
            "expected a command such as pwm_port and pwm_stbd."
        )
    return entry_of(path, key, steering)


def time_of(entries: Mapping[str, Entry | None]) -> TimeColumn | None:
    """The column of the time that a map names, None where it names none.

    Where it says no unit, the name of the column or the size of its stamps tells it.
    """
    entry = entries.get(TIME)
    if entry is None:
        return None
    return TimeColumn(entry.source, None if entry.scale == 1.0 else float(f"{1.0 / entry.scale:.12g}"))


def map_dict(entries: Mapping[str, Entry | None]) -> dict[str, Parts]:
    """The channels of the same map as plain values, without what is usual (scale 1, offset 0, the frame of the log)."""
    result = {}
    for name, entry in entries.items():
        if entry is None:
            continue
        parts: Parts = {**_plain(entry)}
        if entry.steering is not None:
            parts |= {"mix": "skid", "steering": _plain(entry.steering)}
        result[name] = parts
    return result


def _plain(entry: Entry) -> dict[str, str | float]:
    parts = {"scale": entry.scale, "offset": entry.offset, "frame": entry.frame}
    return {"from": entry.source, **{key: part for key, part in parts.items() if part not in (_USUAL[key], None)}}


def map_text(entries: Mapping[str, Entry | None], unused: Sequence[str] = ()) -> str:
    """Write a channel map that `read_channel_map` reads back to the same entries.

    Parameters
    ----------
    entries : by channel, as `Log.entries`; None for a channel that is left out
    unused : streams that became no channel, named in comments, so that they are at hand for an edit

    Examples
    --------
    >>> print(map_text({"u": Entry("/odom:speed", frame="enu"), "pwm_port": Entry("left"), "r": None}), end="")
    u: {from: '/odom:speed', frame: enu}
    pwm_port: {from: left}
    r: null
    """
    lines = []
    for name, entry in entries.items():
        parts = None if entry is None else map_dict({name: entry})[name]
        told = "null\n" if parts is None else yaml_text(parts, default_flow_style=True, width=math.inf)
        lines.append(f"{name}: {told}")
    if unused:
        lines.append("# Not used:\n" + "".join(f"#   {shown(name, _LONGEST)}\n" for name in unused[:_MOST_UNUSED]))
    if len(unused) > _MOST_UNUSED:
        lines.append(f"#   and {len(unused) - _MOST_UNUSED} more\n")
    return "".join(lines)
