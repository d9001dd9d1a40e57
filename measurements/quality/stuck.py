"""Does a sensor repeat itself? A value that stays exactly the same while it should move."""

from collections.abc import Sequence
from typing import ClassVar, final

import numpy as np

from ...physics.frames import Array
from ..channels import Channel
from .finding import Check, Finding
from .fixes import fixes_of
from .record import Record

_SENSORS = ("x", "y", "psi", "u", "v", "r", "ax", "ay", "wind_u", "wind_v")
_LEAST = 1.0
"""A value that stays for less than this is not called stuck [s]."""
_BEFORE = 10
"""Steps before a stay that tell whether the value was on the move."""
_DIGITS = 3.0
"""Steps on the move are at least this many times the last digit of the channel."""
_MUCH = 0.05


@final
class Stuck(Check):
    """Looks for values that stop dead in the middle of a motion."""

    name: ClassVar[str] = "stuck"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: one finding for each channel that is stuck, or one that says that none is."""
        spans: dict[str, list[float]] = {}
        times: dict[str, float] = {}
        for record in records:
            held = fixes_of(record.log.channels)
            for name in _SENSORS:
                channel = record.log.channels.get(name)
                if channel is None or channel.time.size < 3:
                    continue
                usual = held.rows if held is not None and name in ("x", "y") else 1
                stays = _stays(channel, usual)
                spans.setdefault(name, []).extend(high - low for low, high in stays)
                times[name] = times.get(name, 0.0) + float(channel.time[-1] - channel.time[0])
        found = []
        for name, lengths in spans.items():
            if not lengths:
                continue
            share, longest = sum(lengths) / times[name], max(lengths)
            found.append(
                Finding(
                    self.name,
                    "defect" if share > _MUCH else "warning",
                    f"{name} is stuck {len(lengths)} times in mid-motion, for up to {longest:.2g} s",
                    longest,
                    "s",
                    None,
                    (name,),
                    "the boat seems to stop, and to jump when the sensor wakes up",
                    "drop those rows, so that they are a gap; look at the sensor's own status",
                    parts={"share": share},
                )
            )
        return found or [Finding(self.name, "ok", "no sensor repeats a value in mid-motion", 0.0, "s")]


def _stays(channel: Channel, usual: int) -> list[tuple[float, float]]:
    """Stays that begin in mid-motion, as (start, end) [s].

    A boat comes to rest little by little, so that the steps before an honest stay are near the last digit.
    """
    value = np.unwrap(channel.value) if channel.name == "psi" else channel.value
    steps = np.abs(np.diff(value))
    digit = _last_digit(steps)
    if digit is None:
        return []
    same = np.concatenate(([False], steps == 0.0, [False]))
    starts, ends = np.flatnonzero(same[1:] & ~same[:-1]), np.flatnonzero(same[:-1] & ~same[1:])
    found = []
    for start, end in zip(starts, ends, strict=True):
        length = float(channel.time[end] - channel.time[start])
        if length < max(_LEAST, 5.0 * usual * channel.period) or start < _BEFORE * usual:
            continue
        before = steps[start - _BEFORE * usual : start]
        moving = before[before > 0.0]
        enough = moving.size >= 0.6 * before.size / usual
        if enough and np.median(moving) >= _DIGITS * digit and moving[-1] >= _DIGITS * digit:
            found.append((float(channel.time[start]), float(channel.time[end])))
    return found


def _last_digit(steps: Array) -> float | None:
    """The smallest step that the channel shows more than by chance, None where it never moves."""
    moved = steps[steps > 0.0]
    return float(np.quantile(moved, 0.01)) if moved.size else None
