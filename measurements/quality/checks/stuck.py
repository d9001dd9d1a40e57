"""Check for stuck sensors: a value that stays exactly the same while it should move."""

from collections.abc import Sequence

import numpy as np

from ....physics.motion import Array
from ...canonical import Channel
from ...log import Log
from ..axes import track_of
from ..faults import FEWEST, Fault, Kind, Share, Size
from ..record import QUICK_ROW, About, Check, Finding, Found, Reach, Record
from .late import fixes_of

_PLACE = ("x", "y")
_SENSORS: tuple[tuple[str, ...], ...] = (
    _PLACE,
    *((name,) for name in ("psi", "u", "v", "r", "ax", "ay", "wind_u", "wind_v")),
)
_GOES_ON = ("x", "psi")
"""What the motion carries on while the sensor sleeps: it jumps at the end of the stay."""
_PLAINLY = 3.0
"""Times the steps before it that such a jump has at least, and times its last digit that a step on the move has.
Steady, see `benchmarks/steady_limits.py`."""
_MEANWHILE = 0.1
"""Share of its usual range that another speed goes through while a sensor sleeps in mid-motion, or that the heading's
rate is off for a second: less is a steady turn, or a boat at rest whose receiver says 0.
Steady, see `benchmarks/steady_limits.py`."""
_SETTLED = 0.01
"""Share of a record's usual step below which it has settled, however many digits it has.
Steady, see `benchmarks/steady_limits.py`."""
_LEAST = 1.0
"""A value that stays for less than this is not called stuck [s]. Steady, see `benchmarks/steady_limits.py`."""
_BEFORE = 10
"""Steps before a stay that tell whether the value was on the move. Steady, see `benchmarks/steady_limits.py`."""
_BEFORE_SECONDS = 0.5
"""Time that they take at least [s]: a log that was interpolated to a fine grid has ten rows on one line.
Steady, see `benchmarks/steady_limits.py`."""
_TURNS = 0.5
"""Turning from which the rest of the log says that the boat moved [rad]. Steady, see `benchmarks/steady_limits.py`."""
_RUNS = 3.0
"""Way from which it does [m]. Steady, see `benchmarks/steady_limits.py`."""
_NO_DRIFT = 2e-4
"""Share of a track, about that of rounding, that is left by heading and speed where a boat does not drift.
Steady, see `benchmarks/steady_limits.py`."""
_DRIVES = {"psi": "turns", "r": "turns", "v": "turns", "u": "runs", "x": "runs", "ax": "runs", "ay": "turns"}
"""What the boat must do for a record to change: a hull that turns drifts, one that runs straight need not."""


def _examine(records: Sequence[Record]) -> Found:
    """Look for values that stop dead in the middle of a motion.

    One finding for each channel that is stuck, or one that says that none is.
    """
    spans: dict[tuple[str, ...], list[float]] = {}
    times: dict[tuple[str, ...], float] = {}
    for record in records:
        held = fixes_of(record.log.channels)
        for names in _SENSORS:
            if not set(names) <= set(record.log.channels):
                continue
            channels = [record.log.channels[name] for name in names]
            time = channels[0].time
            if time.size < 3 or any(channel.time.size != time.size for channel in channels):
                continue
            usual = held.rows if held is not None and names == _PLACE else 1
            stays = [span for span in _stays(channels, usual) if _rest_moves(record.log, names, span)]
            spans.setdefault(names, []).extend(high - low for low, high in stays)
            times[names] = times.get(names, 0.0) + float(time[-1] - time[0])
    found = [finding for names in _SENSORS if (finding := _never(records, names)) is not None]
    for names, lengths in spans.items():
        if not lengths:
            continue
        share, longest = sum(lengths) / times[names], max(lengths)
        counted = Share(share, 0.0)
        facts = {"seconds": longest, "times": "once" if len(lengths) == 1 else f"{len(lengths)} times"}
        fault = Fault(Kind.STUCK, names, Size(counted, counted), facts, longest, parts={"share": share})
        refused = fault.size.refuses
        told = fault.in_words("defect" if refused else "warning")
        found.append(told.model_copy(update={"reach": Reach.LOG if refused else Reach.SECONDS}))
    return found or [About("stuck", value=0.0, unit="s").ok("no sensor repeats a value in mid-motion")]


def _never(records: Sequence[Record], names: tuple[str, ...]) -> Finding | None:
    """The finding that a record never changes although the rest of the log does."""
    having = [record for record in records if set(names) <= set(record.log.channels)]
    every = [record.log.channels[name] for record in having for name in names]
    if not every or any(channel.time.size < 3 or np.ptp(channel.value) > 0.0 for channel in every):
        return None
    drive = _DRIVES.get(names[0])
    if drive is None or not any(_moves(record, drive, names) for record in having):
        return None
    if names[0] == "v" and _follows([record.log for record in having]):
        return None
    value, first, many = float(every[0].value[0]), every[0].name, len(names) > 1
    facts = {"value": value, "unit": every[0].unit, "does": drive, "first": first}
    facts["change"] = "change" if many else "changes"
    whole = Size(Share(1.0, 0.0), Share(1.0, 0.0))  # in every row
    mends = dict.fromkeys(names)
    told = Fault(Kind.NEVER, names, whole, facts, value, unit=every[0].unit, mends=mends).in_words("defect")
    return told.model_copy(update={"reach": Reach.NUMBERS}) if first in ("ax", "ay") else told


def _follows(logs: Sequence[Log]) -> bool:
    """True when the track is what heading and speed alone make it: then the boat does not drift indeed."""
    track = track_of(logs)
    return track is not None and track.certain and track.unexplained < _NO_DRIFT


def _moves(record: Record, drive: str, but: tuple[str, ...]) -> bool:
    """True when records other than those in question say that the boat turns, or runs unevenly."""
    channels = {name: c for name, c in record.log.channels.items() if name not in but}
    if drive == "turns":
        r, psi = channels.get("r"), channels.get("psi")
        by_rate = r is not None and float(np.ptp(np.cumsum(np.diff(r.time) * r.value[1:]))) > _TURNS
        by_heading = psi is not None and float(np.ptp(np.unwrap(psi.value))) > _TURNS
        return bool(by_rate or by_heading)
    x, y, u = channels.get("x"), channels.get("y"), channels.get("u")
    by_place = x is not None and y is not None and float(np.hypot(np.ptp(x.value), np.ptp(y.value))) > _RUNS
    by_speed = u is not None and float(np.abs(np.diff(u.time) @ u.value[1:])) > _RUNS
    return bool(by_place or by_speed)


def _stays(channels: Sequence[Channel], usual: int) -> list[tuple[float, float]]:
    """Stays of all channels together that begin in mid-motion, as (start, end) [s].

    A boat comes to rest little by little, so that the steps before an honest stay are near the last digit; in rows that
    are longer than its quick answers it does not.
    """
    first, time = channels[0], channels[0].time
    if first.name not in _GOES_ON and first.period > QUICK_ROW:
        return []
    values = [channel.unwrapped for channel in channels]
    steps = np.hypot(*map(np.diff, values)) if len(values) > 1 else np.abs(np.diff(values[0]))
    digit = _last_digit(steps)
    if digit is not None and first.name == "x":
        # Steps of a boat at an even pace are all alike, and tell nothing of the last digit of its position.
        digit = min(digit, _resolution(values))
    if digit is None:
        return []
    same = np.concatenate(([False], steps == 0.0, [False]))
    starts, ends = np.flatnonzero(same[1:] & ~same[:-1]), np.flatnonzero(same[:-1] & ~same[1:])
    result, period = [], first.period
    before_rows = max(_BEFORE * usual, round(_BEFORE_SECONDS / period) if period > 0.0 else 0)
    long = (time[ends] - time[starts] >= max(_LEAST, 5.0 * usual * period)) & (starts >= before_rows)
    for start, end in zip(starts[long], ends[long], strict=True):
        before = steps[start - before_rows : start]
        moving = before[before > 0.0]
        if moving.size < 0.6 * before.size / usual or min(np.median(moving), moving[-1]) < _PLAINLY * digit:
            continue
        if first.name in _GOES_ON and end < steps.size and steps[end] < _PLAINLY * np.median(moving):
            continue
        result.append((float(time[start]), float(time[end])))
    return result


def _rest_moves(log: Log, names: tuple[str, ...], span: tuple[float, float]) -> bool:
    """True when something else tells of a motion meanwhile: another speed changes.

    All of them stand in a steady turn without noise, and at rest. A yaw rate at which the heading turns is measured,
    and a boat that runs straight has no sway, however it speeds up.
    """
    if names == ("r",) and "psi" in log.channels:
        rate, heading = log.channels["r"], log.channels["psi"]
        during = (heading.time >= span[0]) & (heading.time <= span[1])
        said = np.interp(span[0], rate.time, rate.value) * heading.time
        beside = (np.unwrap(heading.value) - said)[during]
        if beside.size >= FEWEST and np.ptp(beside) <= _MEANWHILE * _usual_range(rate) * _LEAST:
            return False
    tells = "r" if names == ("v",) and "r" in log.channels else "uvr"
    others = [log.channels[name] for name in tells if name in log.channels and name not in names]
    if names[0] in _GOES_ON or not others:
        return True
    meanwhile = [(other, other.value[(other.time >= span[0]) & (other.time <= span[1])]) for other in others]
    return any(during.size and np.ptp(during) > _MEANWHILE * _usual_range(other) for other, during in meanwhile)


def _usual_range(channel: Channel) -> float:
    return float(np.ptp(np.quantile(channel.value, [0.02, 0.98])))


def _last_digit(steps: Array) -> float | None:
    """The smallest step that the channel shows more than by chance, or that matters; None where it never moves."""
    moved = steps[steps > 0.0]
    return max(float(np.quantile(moved, 0.01)), _SETTLED * float(np.median(moved))) if moved.size else None


def _resolution(values: Sequence[Array]) -> float:
    """The usual difference between north and east positions (n,) that are next to each other in size."""
    gaps = [np.diff(np.unique(np.asarray(column, dtype=float))) for column in values]
    return float(np.hypot.reduce([float(np.median(gap)) if gap.size else 0.0 for gap in gaps]))


STUCK = Check("stuck", _examine)
