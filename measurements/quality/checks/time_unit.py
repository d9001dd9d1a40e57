"""Check of the unit of time: heading and way must change as much as their rates say over the same stamps."""

from collections.abc import Sequence
from dataclasses import replace

from ...canonical import Channel
from ...channels.channel_map import TIME, Entry, map_text
from ...formats.base import PER_SECOND
from ...log import Log
from ..axes import track_of
from ..faults import Fault, Kind
from ..record import Channels, Check, Finding, Fix, Found, Record
from .units import FINE, turning_of


def _time_unit(records: Sequence[Record]) -> Found:
    """Find stamps in another unit, where heading and yaw rate, and way and speed, both say so.

    A finding where the time is in another unit, else none.
    """
    return [found for record in records if (found := _sentence(record.log)) is not None][:1]


def _sentence(log: Log) -> Finding | None:
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
