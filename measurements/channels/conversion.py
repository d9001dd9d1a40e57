"""Conversion of streams to canonical channels: cleaned, scaled, turned into NED/FRD axes.

Cleaning comes first: stray stamps are dropped, pieces joined between which the clock was set; no row without a number,
no time that runs backwards, one value per stamp. Fixes and quaternions are resolved on the way.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...physics.errors import LogError
from ...physics.motion import Array, earth_to_body, heading_from_enu, heading_from_quaternion
from ...physics.presentation import listing
from ...physics.thrusters import side_named
from ..canonical import PLACE, QUATERNION, RATES, TRACK, UNITS, Channel, Lost, check_limits, command_kind, local_metres
from ..formats.base import Stream
from .channel_map import Entry, mixed

DAY = 86400.0
"""A step forward from which the clock was set, and the logger did not pause [s]."""
APART = 10.0
"""Gap that is left between pieces when they are joined [s]; nothing is interpolated across so much."""
_FAR = 1.0
"""Time by which a stamp is out of order from which it was not overtaken by another, but is wrong [s]."""
_PERIODS = 10.0
"""The same in steps of a slow channel: a row that was overtaken is out of order by some of them."""
_WIDEST = 3
"""Rows of wrong stamps in a row, at most; more of them are a piece of their own."""
_FEW = 0.02
"""Share of rows whose stamps may be wrong one by one; of more, the clock was set or the rows were shuffled."""
_ROWS = 20
"""Rows that pieces have on average, at least, where the clock was set and the rows were not shuffled."""
_LATEST = 1e11
"""The largest time that a clock may show, either way [s]: three thousand years."""

Rows = NDArray[np.bool_]


class Clock:
    """The clock of the streams of one file, put right as far as can be.

    Stamps that are alone in their disorder are astray, and dropped. Where the clock was set, by a day or more forward
    or by more than rows overtake each other back, what follows is put 10 s behind what was before.

    Parameters
    ----------
    streams : all that become channels
    mend : join pieces of a clock that was set back, too, where the order of the file alone tells what came first

    Attributes
    ----------
    sets : (when, by how much) the clock was set [s], on the joined time
    """

    def __init__(self, streams: Sequence[Stream], mend: bool) -> None:
        self.sets: tuple[tuple[float, float], ...] = ()
        shared = {id(stream.time): stream.time for stream in streams}
        self._keep = {key: ~_astray(time) for key, time in shared.items()}
        self._time = dict(shared)
        runs = {key: _runs(time, np.flatnonzero(self._keep[key])) for key, time in shared.items()}
        most = max(shared, key=lambda key: (len(runs[key]), int(self._keep[key].sum())), default=None)
        if most is None or len(runs[most]) < 2:
            return
        pieces = [(float(shared[most][rows].min()), float(shared[most][rows].max())) for rows in runs[most]]
        if not mend and any(start < end for (_, end), (start, _) in pairwise(pieces)):
            return
        shifts = self._joined(pieces, _step(shared[most][self._keep[most]]))
        for key, time in shared.items():
            moved = time.copy()
            for place, rows in zip(_matched(time, runs[key], pieces), runs[key], strict=True):
                moved[rows] += shifts[place]
            self._time[key] = moved

    def read(self, stream: Stream) -> tuple[Array, Rows]:
        """The stamps of a stream on the joined time [s], and which rows have one that is not astray."""
        return self._time[id(stream.time)], self._keep[id(stream.time)]

    def _joined(self, pieces: Sequence[tuple[float, float]], step: float) -> list[float]:
        shifts, sets, end = [0.0], [], pieces[0][1]
        for (_, before), (start, stop) in pairwise(pieces):
            sets.append((end, start - before - step))
            shifts.append(end + APART - start)
            end += APART + stop - start
        self.sets = tuple(sets)
        return shifts


def _step(time: Array) -> float:
    """Usual time from row to row [s]."""
    return float(np.median(np.abs(np.diff(time))))


def _astray(time: Array) -> Rows:
    """Rows whose stamp is no number, or that one to three in a row are out of order with those around them."""
    result = ~np.isfinite(time) | (np.abs(time) > _LATEST)
    for width in range(1, _WIDEST + 1):
        rows = np.flatnonzero(~result)
        t = time[rows]
        if t.size <= 2 * (_WIDEST + 1):
            break
        far = max(_FAR, _PERIODS * _step(t))
        before, after = t[: -width - 1], t[width + 1 :]
        inner = np.lib.stride_tricks.sliding_window_view(t[1:-1], width)
        out = ((inner > after[:, None] + far) | (inner < before[:, None] - far)).all(axis=1) & (after >= before)
        places = np.flatnonzero(out)
        wrong = {int(place) + 1 + k for place in places[: t.size] for k in range(width)}
        if len(wrong) > max(_WIDEST, _FEW * t.size):
            continue
        # A step into the log or out of it that no pause explains: what is beyond is no piece to work with.
        if not -far <= t[width] - t[width - 1] < DAY:
            wrong |= set(range(width))
        if not -far <= t[-width] - t[-width - 1] < DAY:
            wrong |= set(range(t.size - width, t.size))
        result[rows[sorted(wrong)]] = True
    return result


def _runs(time: Array, rows: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """The rows of each piece between two settings of the clock, in the order of the file."""
    t = time[rows]
    if t.size < 2:
        return [rows]
    steps = np.diff(t)
    far = max(_FAR, _PERIODS * _step(t))
    falls = np.flatnonzero(steps < -far) + 1
    shuffled = falls.size * _ROWS > t.size or (falls.size > 1 and _apart(np.split(t, falls)))
    if shuffled or (falls.size == 0 and np.any(steps < 0.0)):
        rows = rows[np.argsort(t, kind="stable")]
        falls, steps = np.zeros(0, dtype=np.int64), np.diff(time[rows])
    leaps = np.flatnonzero(steps >= DAY) + 1
    return np.split(rows, np.union1d(falls, leaps))


def _apart(pieces: Sequence[Array]) -> bool:
    """True when no two pieces share any time: they are of one clock, and in disorder."""
    spans = sorted((float(piece.min()), float(piece.max())) for piece in pieces)
    return all(end < start for (_, end), (start, _) in pairwise(spans))


def _matched(time: Array, runs: Sequence[NDArray[np.int64]], pieces: Sequence[tuple[float, float]]) -> list[int]:
    """The piece that each run of a stream lies in; each a later one than the run before."""
    result: list[int] = []
    for place, rows in enumerate(runs):
        low, high = (float(bound) for bound in (time[rows].min(), time[rows].max())) if rows.size else (0.0, 0.0)
        least = result[-1] + 1 if result else 0
        rest = range(least, len(pieces) - (len(runs) - 1 - place))
        result.append(min(rest, key=lambda p: max(pieces[p][0] - low, high - pieces[p][1], 0.0)))
    return result


class Cleaner:
    """Makes channels of the streams of one file and remembers what it dropped.

    Parameters
    ----------
    where : the file, for messages
    streams : all that become channels, whose clock is put right together; see `Clock`
    mend : put up with time that runs backwards: sort rows that were shuffled, and join the pieces of a log whose clock
        was set back. Only for looking a log over; whoever computes with it must know.
    """

    def __init__(self, where: str, streams: Sequence[Stream], mend: bool = False) -> None:
        self._where = where
        self._mend = mend
        self._clock = Clock(streams, mend)
        self._dropped: dict[tuple[int, str], list[str]] = defaultdict(list)  # channels by rank and words of a note

    def channel(self, name: str, stream: Stream, value: Array) -> Channel:
        """Make the channel `name` of the values `value` (n,) at the stamps of `stream`.

        Raises
        ------
        LogError
            when no value is a number, or when time runs backwards and is not, or cannot, be mended.
        """
        time, stamped = self._clock.read(stream)
        known = np.isfinite(value) & np.isfinite(stream.time)
        keep = known & stamped
        if not keep.any():
            raise LogError(
                f"{self._where}: {name} ({stream.name}) holds no number in any of its {value.size} rows. Was the "
                f"sensor connected? Remove the column, or leave it out with '{name}: null' in a channel map."
            )
        rows = stream.row
        empty, astray = int(keep.size - known.sum()), int(known.sum() - keep.sum())
        if astray:
            self._dropped[0, f"{astray} rows whose stamp is far out of order dropped"].append(name)
        if not keep.all():
            time, rows, value = time[keep], rows[keep], value[keep]
        steps = np.diff(time)
        backward = 0
        if steps.size and steps.min() < 0:
            if not self._mend:
                at = int(np.flatnonzero(steps < 0)[0]) + 1
                raise LogError(
                    f"{self._where}: time runs backwards in {name} ({stream.name}) at row {rows[at]}: {time[at]:.6f} s "
                    f"after {time[at - 1]:.6f} s. Sort the log by time, or cut it where the clock was set; "
                    "--fix does so, and 'undertow inspect LOG --fix OUT.csv' writes it."
                )
            backward = int(np.sum(time < np.maximum.accumulate(time)))
            order = np.argsort(time, kind="stable")
            time, value = time[order], value[order]
            steps = np.diff(time)
            self._dropped[0, f"{backward} values sorted by time"].append(name)
        last = np.append(steps > 0, True)
        lost = Lost(empty, int(last.size - last.sum()), backward, astray, self._clock.sets)
        if lost.empty:
            self._dropped[1, f"{lost.empty} rows without a number dropped"].append(name)
        if lost.repeated:  # else nothing is copied: the channels of a large log share one array of stamps
            self._dropped[2, f"{lost.repeated} repeated time stamps, the last value of each kept"].append(name)
            time, value = time[last], value[last]
        return Channel(name, time, value, stream.name, lost)

    def notes(self) -> tuple[str, ...]:
        """Say what was dropped, one sentence for the channels that lost the same number of rows."""
        ranked = sorted(self._dropped.items(), key=lambda item: item[0][0])
        sets = [
            f"the clock was set at t = {at:.3f} s by {by:+.6g} s; what follows is put {APART:g} s after it, as a "
            "stretch of its own"
            for at, by in self._clock.sets
        ]
        return (*sets, *(f"{' '.join(names)}: {what}" for (_, what), names in ranked))


_FROM_ENU = {"x": ("y", 1.0), "y": ("x", 1.0), "x_dot": ("y_dot", 1.0), "y_dot": ("x_dot", 1.0)} | {
    name: (name, -1.0) for name in ("v", "r", "ay", "wind_v")
}
"""ENU/FLU channel -> its NED/FRD channel and sign; the others but the angles stay as they are."""
_AXES = {"x": "north", "y": "east"}
_FEWEST = 50
"""Rows of a heading from which its usual step can be told."""
_SPINS, _ALL_ROUND = 5.0, 0.75
"""Times the step that 95 % of rows stay below, and share of a full turn, that a line through the wrap has."""
_FULL_TURN = 6.3
"""No course in radians is larger; one in degrees is, as soon as it is not within 6 degrees of north [rad]."""
_WHOLE = 1e4
"""No angle in degrees is as large as this; a latitude in 1e-7 degrees is, unless it is within 110 m of the equator."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A stream with its role, the frame of that role, and what is done to its values.

    Attributes
    ----------
    role : the canonical channel, in the axes of `frame`
    stream : where the values come from
    frame : "ned" or "enu"
    scale, offset : applied to the values first
    how : for the notes; empty when there is nothing to say
    within : values outside mean "nothing"
    steering : stream and entry of the steering that the command of a side is mixed of; else None
    """

    role: str
    stream: Stream
    frame: str
    scale: float = 1.0
    offset: float = 0.0
    how: str = ""
    within: tuple[float, float] | None = None
    steering: tuple[Stream, Entry] | None = None

    @property
    def target(self) -> str:
        """The channel that it becomes."""
        return _FROM_ENU.get(self.role, (self.role, 1.0))[0] if self.frame == "enu" else self.role

    @property
    def entry(self) -> Entry:
        """The line of a channel map that says the same; commands and places have no frame."""
        framed = command_kind(self.role) is None and self.role not in (*PLACE, *TRACK)
        steering = self.steering and replace(self.steering[1], source=self.steering[0].name)
        return Entry(self.stream.name, self.scale, self.offset, self.frame if framed else None, steering)

    @property
    def streams(self) -> tuple[Stream, ...]:
        """All streams that it takes."""
        return (self.stream, *(self.steering[:1] if self.steering else ()))


def channels_of(sources: Mapping[str, Source], where: str, mend: bool = False) -> tuple[dict[str, Channel], list[str]]:
    """Make the channels of sources by target, and notes on what was converted or dropped.

    Parameters
    ----------
    sources : streams with their roles, by channel
    where : the file, for messages
    mend : repair time that runs backwards

    Raises
    ------
    LogError
        see `read_log`.
    """
    notes = _frame_notes(sources)
    sources = {name: _in_degrees(source, notes) if name in PLACE else source for name, source in sources.items()}
    cleaner = Cleaner(where, [source.stream for source in sources.values()], mend)
    channels = {name: _channel(name, source, cleaner) for name, source in sources.items()}
    for channel in channels.values():
        check_limits(channel, where)
    _heading(channels, sources, where, notes)
    if "psi" in channels:
        channels["psi"] = _wrapped(channels["psi"], "psi" in sources, notes)
    _position(channels, where, notes)
    _track(channels, sources, notes)
    _velocity(channels, notes)
    for name in ("x", "y"):
        if name in channels:
            check_limits(channels[name], where)
    order = {name: place for place, name in enumerate(UNITS)}
    ordered = dict(sorted(channels.items(), key=lambda item: (order.get(item[0], len(order)), item[0])))
    return ordered, [*notes, *cleaner.notes()]


def _frame_notes(sources: Mapping[str, Source]) -> list[str]:
    """Say which channels were converted and how, each by what was done to it."""
    turned = {"psi" if name in QUATERNION else name: None for name, source in sources.items() if source.frame == "enu"}
    if not turned:
        return []
    names = sorted(turned, key=list(UNITS).index)
    exchanged = [name for name in names if name in ("x", "y", *RATES)]
    done = [f"{_AXES.get(name, name)} = world {_FROM_ENU[name][0]}" for name in exchanged]
    done += ["psi = pi/2 - yaw"] * ("psi" in turned)
    negative = [name for name in names if _FROM_ENU.get(name, ("", 1.0))[1] < 0.0]
    if negative:
        done.append(f"{listing(negative)} change{'s' * (len(negative) == 1)} sign")
    how = ", ".join(done) or "the same in both"
    return [f"{' '.join(names)}: converted from ENU/FLU (REP-103) to NED/FRD: {how}"]


def _in_degrees(source: Source, notes: list[str]) -> Source:
    """A place as autopilots send it, in whole 1e-7 degrees, with the scale that this asks for."""
    finite = source.stream.value[np.isfinite(source.stream.value)]
    if source.scale != 1.0 or not finite.size or np.abs(finite).max() < _WHOLE:
        return source
    notes.append(f"{source.role}: {source.stream.name} taken in 1e-7 degrees, because it is above {_WHOLE:g}")
    return replace(source, scale=1e-7)


def _channel(name: str, source: Source, cleaner: Cleaner) -> Channel:
    value = source.stream.value
    if source.within is not None:
        value = np.where((value >= source.within[0]) & (value <= source.within[1]), value, np.nan)
    # A broken file holds numbers that overflow here; the channel's limits refuse them.
    with np.errstate(over="ignore", invalid="ignore"):
        if (source.scale, source.offset) != (1.0, 0.0):
            value = source.scale * value + source.offset
        if source.frame == "enu" and name not in QUATERNION:
            sign = _FROM_ENU.get(source.role, (name, 1.0))[1]
            value = heading_from_enu(value) if name == "psi" else value if sign == 1.0 else sign * value
        if source.steering is not None:
            stream, entry = source.steering
            value = mixed(name, (source.stream.time, value), (stream.time, entry.scale * stream.value + entry.offset))
    channel, output = cleaner.channel(name, source.stream, value), source.stream.output
    if source.steering is not None:
        sign = "+" if side_named((command_kind(name) or ("", ""))[1]) == "port" else "-"
        channel = replace(channel, origin=f"{source.stream.name} {sign} {source.steering[0].name}")
    return channel if output is None else replace(channel, output=output.mapped(source.scale, source.offset))


def _heading(channels: dict[str, Channel], sources: Mapping[str, Source], where: str, notes: list[str]) -> None:
    """Replace a quaternion by the heading; an unset (all zero) quaternion is no heading."""
    parts = [channels.pop(name) for name in QUATERNION if name in channels]
    if not parts:
        return
    if len(parts) < 4:
        notes.append(f"an incomplete quaternion ({' '.join(part.name for part in parts)}) is not used")
        return
    time, (x, y, z, w) = _together(parts)
    known = x * x + y * y + z * z + w * w > 1e-12
    origin = f"quaternion {parts[0].origin} ... {parts[3].origin}"
    if not known.any():
        raise LogError(f"{where}: the {origin} is zero in all {known.size} rows: no heading. Map psi instead.")
    if not known.all():
        notes.append(f"psi: {np.count_nonzero(~known)} rows with an all-zero quaternion dropped")
    heading = heading_from_quaternion(x[known], y[known], z[known], w[known])
    if sources["qw"].frame == "enu":
        heading = heading_from_enu(heading)
    channels["psi"] = Channel("psi", time[known], heading, origin, parts[0].lost)
    notes.append(f"psi: heading of the {origin}")


def _wrapped(heading: Channel, recorded: bool, notes: list[str]) -> Channel:
    """A heading without the rows that straight lines drew through its wrap, from one end of its range to the other.

    Who resamples an angle without unwrapping it makes such rows: for a moment the boat spins once round, backwards. Of
    a heading that was not `recorded` as an angle but in a quaternion, the angle may have wrapped at any quarter.
    """
    value = heading.value
    wraps = [value] if recorded else [(value - low) % (2.0 * np.pi) + low for low in 0.5 * np.pi * np.arange(-2.0, 2.0)]
    drawn = next((rows for rows in map(_drawn, wraps) if rows.any()), np.zeros(value.size, dtype=bool))
    if not drawn.any():
        return heading
    times = int(np.count_nonzero(np.diff(drawn, prepend=False) & drawn))
    notes.append(
        f"psi: {np.count_nonzero(drawn)} rows left out that lines drew through the wrap of the heading, {times} times: "
        "it was resampled without being unwrapped"
    )
    return replace(heading, time=heading.time[~drawn], value=value[~drawn])


def _drawn(value: Array) -> NDArray[np.bool_]:
    """The rows (n,) of an angle that lines drew from one end of its range to the other."""
    drawn = np.zeros(value.size, dtype=bool)
    turn = next((full for full in (2.0 * np.pi, 360.0) if 0.9 * full < np.ptp(value) <= 1.001 * full), None)
    if turn is None or value.size < _FEWEST:
        return drawn
    steps = np.diff(value)
    usual = float(np.quantile(np.abs((steps + 0.5 * turn) % turn - 0.5 * turn), 0.95))
    quick = (np.abs(steps) > _SPINS * usual) & (np.abs(steps) < 0.75 * turn)
    for begin, end in np.flatnonzero(np.diff(quick, prepend=False, append=False)).reshape(-1, 2).tolist():
        total, one_way = value[end] - value[begin], np.ptp(np.sign(steps[begin:end])) == 0.0
        if one_way and _ALL_ROUND * turn < abs(total):
            drawn[begin + 1 : end] = True
    return drawn


def _position(channels: dict[str, Channel], where: str, notes: list[str]) -> None:
    """Replace latitude and longitude by metres north and east; 0 degrees both is what a receiver without a fix says."""
    parts = [channels.pop(name) for name in PLACE if name in channels]
    if not parts:
        return
    if len(parts) < 2:
        notes.append(f"{parts[0].name} alone ({parts[0].origin}) is no position and is not used")
        return
    time, (latitude, longitude) = _together(parts)
    known = (latitude != 0.0) | (longitude != 0.0)
    origin = f"{parts[0].origin}, {parts[1].origin}"
    if not known.any():
        raise LogError(
            f"{where}: {origin} are zero in all {known.size} rows: no fix. Map x and y, or u and v, instead."
        )
    if not known.all():
        notes.append(f"x y: {np.count_nonzero(~known)} rows without a fix (0 degrees both) dropped")
    north, east, (first, across) = local_metres(latitude[known], longitude[known])
    notes.append(
        f"x y: metres north and east of the first fix, latitude {first:.7f}, longitude {across:.7f} [deg] (tangent "
        f"plane of WGS 84), from {origin}"
    )
    channels["x"] = Channel("x", time[known], north, parts[0].origin, parts[0].lost)
    channels["y"] = Channel("y", time[known], east, parts[1].origin, parts[1].lost)


def _track(channels: dict[str, Channel], sources: Mapping[str, Source], notes: list[str]) -> None:
    """Replace speed and course over ground by the velocity north and east."""
    parts = {name: channels.pop(name) for name in TRACK if name in channels}
    if len(parts) < 2:
        notes += [f"{name} alone ({part.origin}) is no velocity and is not used" for name, part in parts.items()]
        return
    speed, course = parts["sog"], parts["cog"]
    time, (along, towards) = _together([speed, course])
    said = sources["cog"].scale != 1.0 or sources["cog"].stream.field.lower().endswith("rad")
    if towards.size and not said and np.abs(towards).max() > _FULL_TURN:
        notes.append(f"cog: {course.origin} taken in degrees, because it is above {_FULL_TURN:g}")
        towards = np.radians(towards)
    for name, turn in zip(RATES, (np.cos, np.sin), strict=True):
        channels[name] = Channel(name, time, along * turn(towards), f"{speed.origin} along {course.origin}", speed.lost)


def _velocity(channels: dict[str, Channel], notes: list[str]) -> None:
    """Turn a velocity in earth axes by the heading into surge and sway, where the log does not tell these itself."""
    parts = [channels.pop(name) for name in RATES if name in channels]
    if not parts:
        return
    if len(parts) < 2 or "psi" not in channels:
        lacks = "one part of it" if len(parts) < 2 else "without a heading"
        notes.append(f"a velocity in earth axes ({' '.join(part.origin for part in parts)}) is not used: {lacks}")
        return
    time, (north, east) = _together(parts)
    heading = channels["psi"]
    inside = (time >= heading.time[0]) & (time <= heading.time[-1])
    if not inside.any():
        notes.append(f"a velocity in earth axes ({parts[0].origin}) is not used: no heading at its stamps")
        return
    time, north, east = time[inside], north[inside], east[inside]
    psi = np.interp(time, heading.time, np.unwrap(heading.value))
    origin = f"{parts[0].origin}, {parts[1].origin}"
    made = [name for name in ("u", "v") if name not in channels]
    for name, value in zip(("u", "v"), earth_to_body(psi, north, east), strict=True):
        if name in made:
            channels[name] = Channel(name, time, value, origin, parts[0].lost)
    notes.append(
        f"{' '.join(made)}: velocity in earth axes ({origin}), turned by the heading ({heading.origin}); right as "
        "far as both are of one frame"
    )


def _together(parts: list[Channel]) -> tuple[Array, list[Array]]:
    """The stamps that all channels have, and the values at them."""
    time = parts[0].time
    if all(part.time is time for part in parts):
        return time, [part.value for part in parts]
    for part in parts[1:]:
        time = np.intersect1d(time, part.time, assume_unique=True)
    return time, [part.value[np.searchsorted(part.time, time)] for part in parts]
