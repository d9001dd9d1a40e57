"""Check of the unit of time: heading and way must change as much as their rates say over the same stamps."""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, final

import numpy as np

from ....physics.motion import Array
from ...canonical import Channel
from ...channels.channel_map import TIME, Entry, map_text
from ...formats.time_columns import PER_SECOND
from ...log import Log
from ..finding import Channels, Check, Finding, Fix, Reach
from ..record import Record

_UNITS = ("ms", "us", "ns")
"""Units of time that are told from each other and from a second by a factor of a thousand, which nothing else makes."""
_APART = 1.5
"""Factor within which both ratios must meet a unit: their neighbours are a thousand away, so that a gyro or a speed may
be wrong by half. In between nothing is done; the checks of units tell such factors."""
_STEPS = (20, 5, 1)
"""Samples over which changes are taken: as many as keep noise small, and no more than the boat goes straight, whatever
its rate."""
_PARTS = 10
"""Changes from which a ratio is formed: of fewer, one gust may be most."""


@final
class TimeUnit(Check):
    """Finds stamps in milliseconds and below, where heading and yaw rate, and way and speed, both say so."""

    name: ClassVar[str] = "time unit"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: a finding where the time is in another unit, else none."""
        found = [told for record in records if (unit := _unit(record.log)) for told in [_told(record.log, unit)]]
        return found[:1]


def _unit(log: Log) -> str | None:
    if not {"x", "y", "psi", "u", "r"} <= set(log.channels):
        return None
    x, y, psi, u, r = (log.channels[name] for name in ("x", "y", "psi", "u", "r"))
    east = np.interp(x.time, y.time, y.value)
    turned, heading = _integral(r, psi.time), np.unwrap(psi.value)
    ahead = _integral(u, x.time)
    for step in _STEPS:
        ratios = (
            _ratio(np.abs(np.diff(heading[::step])), np.abs(np.diff(turned[::step]))),
            _ratio(np.hypot(np.diff(x.value[::step]), np.diff(east[::step])), np.abs(np.diff(ahead[::step]))),
        )
        for unit in _UNITS:
            if all(1.0 / _APART <= ratio * PER_SECOND[unit] <= _APART for ratio in ratios):
                return unit
    return None


def _integral(rate: Channel, time: Array) -> Array:
    steps = 0.5 * (rate.value[1:] + rate.value[:-1]) * np.diff(rate.time)
    total: Array = np.interp(time, rate.time, np.concatenate([[0.0], np.cumsum(steps)]))
    return total


def _ratio(change: Array, by_rate: Array) -> float:
    """Change over what its rate says, by the sums of both; 1 where there is too little of either."""
    total = float(by_rate.sum())
    return float(change.sum()) / total if change.size >= _PARTS and total > 0.0 else 1.0


def _told(log: Log, unit: str) -> Finding:
    factor = 1.0 / PER_SECOND[unit]
    mends = {TIME: Entry(log.clock, factor)} if log.clock else {}
    line = map_text(mends).strip() or f"time: {{from: ..., unit: {unit}}}"

    def apply(channels: Channels) -> dict[str, Channel]:
        return {name: replace(channel, time=factor * channel.time) for name, channel in channels.items()}

    return Finding(
        check="time unit",
        verdict="defect",
        sentence=f"the stamps are in {unit}: the boat turns and moves {factor:g} times as much as its rates say",
        value=factor,
        unit="1",
        channels=("t",),
        consequence="every rate and acceleration is wrong",
        remedy=f"say so in a channel map: '{line}'",
        fix=Fix(f"time turned from {unit} into seconds", apply),
        reach=Reach.LOG,
        mends=mends,
    )
