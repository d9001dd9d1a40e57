"""Which stream becomes which channel, and how it is turned into NED/FRD axes."""

import difflib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..physics.errors import LogError
from ..physics.frames import Array, heading_from_enu, heading_from_quaternion
from .channel_map import Entry
from .channels import UNITS, Channel, check_limits, command_kind, unit_of
from .cleaning import Cleaner
from .formats.base import Stream
from .recognition import Guess, is_vertical_acceleration, recognise

_FROM_ENU = {"x": ("y", 1.0), "y": ("x", 1.0), "v": ("v", -1.0), "r": ("r", -1.0), "ay": ("ay", -1.0)} | {
    "wind_v": ("wind_v", -1.0)
}
"""ENU/FLU channel -> its NED/FRD channel and sign; the others but the angles stay as they are."""
_GROUPS = (("x", "y"), ("psi",), ("qx", "qy", "qz", "qw"), ("u", "v"), ("r",), ("ax", "ay"), ("wind_u", "wind_v"))
_QUATERNION = ("qx", "qy", "qz", "qw")


@dataclass(frozen=True, slots=True, eq=False)
class _Source:
    """A stream with its role, the frame of that role, and the user's scale and offset."""

    role: str
    stream: Stream
    frame: str
    scale: float = 1.0
    offset: float = 0.0
    how: str = ""

    @property
    def target(self) -> str:
        return _FROM_ENU.get(self.role, (self.role, 1.0))[0] if self.frame == "enu" else self.role


def map_channels(
    streams: Sequence[Stream], frame: str | None, entries: Mapping[str, Entry | None], where: str
) -> tuple[dict[str, Channel], tuple[str, ...], tuple[str, ...]]:
    """Turn streams into canonical channels.

    Parameters
    ----------
    streams : what the reader found
    frame : "ned", "enu" or None, see `read_log`
    entries : the channel map, empty for none
    where : the file, for messages

    Returns
    -------
    (channels by name, names of unused streams, notes)

    Raises
    ------
    LogError
        see `read_log`.
    """
    notes: list[str] = []
    sources = _mapped(streams, frame, entries, where)
    mapped = tuple(sources)
    for source in _guessed(streams, frame, notes):
        taken = source.target in sources or _says_heading(source.target) & _says_heading(*mapped)
        if not taken and not (source.target in entries and entries[source.target] is None):
            sources[source.target] = source
    if not sources:
        raise LogError(
            f"{where}: no channel is recognised among {_some([stream.name for stream in streams])}; expected names "
            "like x y psi u v r pwm_port newton_stbd, ROS odometry fields, or a channel map (--map channels.yaml)."
        )
    if "psi" in sources:
        spare = [name for name in _QUATERNION if sources.pop(name, None)]
        if spare:
            notes.append("psi is a channel of its own; the quaternion is not used")
    notes += [f"{name}: {source.how}" for name, source in sources.items() if source.how]
    notes += _frame_notes(sources)
    cleaner = Cleaner(where)
    channels = {name: _channel(name, source, cleaner) for name, source in sources.items()}
    _heading(channels, sources, where, notes)
    for channel in channels.values():
        check_limits(channel, where)
    order = {name: place for place, name in enumerate(UNITS)}
    ordered = dict(sorted(channels.items(), key=lambda item: (order.get(item[0], len(order)), item[0])))
    used = {id(source.stream) for source in sources.values()}
    unused = tuple(stream.name for stream in streams if id(stream) not in used)
    return ordered, unused, (*notes, *cleaner.notes())


def _says_heading(*names: str) -> bool:
    return any(name == "psi" or name in _QUATERNION for name in names)


def _mapped(
    streams: Sequence[Stream], frame: str | None, entries: Mapping[str, Entry | None], where: str
) -> dict[str, _Source]:
    sources: dict[str, _Source] = {}
    for name, entry in entries.items():
        if entry is None:
            continue
        stream = _find(streams, entry.source, name, where)
        guess = recognise(stream)
        ros = guess is not None and guess.ros and guess.role == name and frame is None
        axes = "ned" if command_kind(name) else entry.frame or ("enu" if ros else frame or "ned")
        source = _Source(name, stream, axes, entry.scale, entry.offset, f"from {stream.name} by the channel map")
        if source.target in sources:
            raise LogError(f"{where}: the channel map gives {source.target} twice; give x and y the same frame.")
        sources[source.target] = source
    return sources


def _find(streams: Sequence[Stream], wanted: str, name: str, where: str) -> Stream:
    exact = [stream for stream in streams if stream.name == wanted]
    found = exact or [stream for stream in streams if stream.field == wanted]
    if len(found) == 1:
        return found[0]
    if found:
        raise LogError(
            f"{where}: the channel map takes {name} from '{wanted}', which several topics have: "
            f"{_some([stream.name for stream in found])}. Write topic:field."
        )
    names = [stream.name for stream in streams]
    near = difflib.get_close_matches(wanted, names, n=1, cutoff=0.3)
    hint = f"did you mean '{near[0]}'?" if near else f"there are {_some(names)}."
    raise LogError(f"{where}: the channel map takes {name} from '{wanted}', which is not in the log; {hint}")


def _guessed(streams: Sequence[Stream], frame: str | None, notes: list[str]) -> list[_Source]:
    found: dict[str, list[tuple[Guess, Stream]]] = defaultdict(list)
    for stream in streams:
        guess = recognise(stream)
        if guess is not None:
            found[guess.role].append((guess, stream))
    upside_down = {
        stream.topic for stream in streams if is_vertical_acceleration(stream) and np.nanmean(_finite(stream)) < 0
    }
    sources = []
    for roles in (*_GROUPS, *((role,) for role in sorted(found) if command_kind(role))):
        group = _best_group(roles, found)
        for role in roles:
            candidates = sorted(
                ((guess, stream) for guess, stream in found.get(role, []) if guess.group == group),
                key=lambda item: item[1].name,
            )
            if not candidates:
                continue
            guess, stream = candidates[0]
            others = [other.name for _, other in found[role] if other is not stream]
            if others:
                notes.append(f"{role}: taken from {stream.name}, not from {_some(others)}")
            sources.append(_placed(guess, stream, frame, stream.topic in upside_down, notes))
    return sources


def _finite(stream: Stream) -> Array:
    finite = stream.value[np.isfinite(stream.value)]
    return finite if finite.size else np.zeros(1)


def _best_group(roles: tuple[str, ...], found: Mapping[str, list[tuple[Guess, Stream]]]) -> str:
    """Choose the message that has most of the roles, then the best rank, then odometry, then the first by name."""
    has: dict[str, set[str]] = defaultdict(set)
    rank: dict[str, int] = {}
    for role in roles:
        for guess, _ in found.get(role, []):
            has[guess.group].add(role)
            rank[guess.group] = guess.rank
    return min(rank, key=lambda group: (-len(has[group]), rank[group], "odom" not in group, group), default="")


def _placed(guess: Guess, stream: Stream, frame: str | None, upside_down: bool, notes: list[str]) -> _Source:
    if command_kind(guess.role):
        how = "" if guess.rank == 0 else f"guessed from the name {stream.name}, taken in [{unit_of(guess.role)}]"
        return _Source(guess.role, stream, "ned", how=how)
    if not guess.ros:
        return _Source(guess.role, stream, frame or "ned")
    if guess.rank == 2 and upside_down and frame is None and guess.role in ("r", "ax", "ay"):
        how = f"from {stream.name}, axes taken as FRD because its vertical acceleration is negative at rest"
        return _Source(guess.role, stream, "ned", how=how)
    return _Source(guess.role, stream, frame or "enu")


def _frame_notes(sources: Mapping[str, _Source]) -> list[str]:
    turned = {"psi" if name in _QUATERNION else name: None for name, source in sources.items() if source.frame == "enu"}
    if not turned:
        return []
    return [
        f"{' '.join(sorted(turned, key=list(UNITS).index))}: converted from ENU/FLU (REP-103) to NED/FRD: "
        "north = world y, east = world x, psi = pi/2 - yaw, v and r change sign"
    ]


def _channel(name: str, source: _Source, cleaner: Cleaner) -> Channel:
    value = source.scale * source.stream.value + source.offset
    if source.frame == "enu" and name not in _QUATERNION:
        value = heading_from_enu(value) if name == "psi" else _FROM_ENU.get(source.role, (name, 1.0))[1] * value
    return cleaner.channel(name, source.stream, value)


def _heading(channels: dict[str, Channel], sources: Mapping[str, _Source], where: str, notes: list[str]) -> None:
    """Replace a quaternion by the heading; an unset (all zero) quaternion is no heading."""
    parts = [channels.pop(name) for name in _QUATERNION if name in channels]
    if not parts:
        return
    if len(parts) < 4:
        notes.append(f"an incomplete quaternion ({' '.join(part.name for part in parts)}) is not used")
        return
    time = parts[0].time
    for part in parts[1:]:
        time = np.intersect1d(time, part.time, assume_unique=True)
    x, y, z, w = (part.value[np.searchsorted(part.time, time)] for part in parts)
    known = x * x + y * y + z * z + w * w > 1e-12
    origin = f"quaternion {parts[0].origin} ... {parts[3].origin}"
    if not known.any():
        raise LogError(f"{where}: the {origin} is zero in all {known.size} rows: no heading. Map psi instead.")
    if not known.all():
        notes.append(f"psi: {np.count_nonzero(~known)} rows with an all-zero quaternion dropped")
    heading = heading_from_quaternion(x[known], y[known], z[known], w[known])
    if sources["qw"].frame == "enu":
        heading = heading_from_enu(heading)
    channels["psi"] = Channel("psi", time[known], heading, origin)
    notes.append(f"psi: heading of the {origin}")


def _some(names: Sequence[str], most: int = 12) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return (", ".join(names[:most]) or "nothing") + more
