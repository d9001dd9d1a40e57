"""Checks of the sampling: time stamps, rates and gaps of the channels, and the unit of time.

Stamps may repeat or go back. Heading and way must change as much as their rates say over the same stamps.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...canonical import MOTION, Channel, command_kind
from ...channels.channel_map import TIME, Entry, map_text
from ...channels.conversion import APART
from ...formats.base import PER_SECOND
from ...log import Log
from ...preparation.resampling import gap_limit, gaps, is_logged_on_change
from ..axes import track_of
from ..faults import Fault, Kind
from ..record import Channels, Check, Finding, Fix, Record, Verdict
from .units import FINE, turning_of

_MANY = 0.01
"""Share of stamps that are wrong from which a derivative suffers; fewer are told, no more."""
_TOLD = 3
"""Settings of the clock that a sentence tells before it counts the rest."""


def _stamps(records: Sequence[Record]) -> list[Finding]:
    """Count what reading had to drop or sort, see `conversion.Cleaner`: a fix has nothing left to do.

    A finding for repeated stamps, one for backward stamps, or one that says that all is well.
    """
    found = list(_wrong_stamps([channel for record in records for channel in record.log.channels.values()]))
    text = "every time stamp is later than the one before"
    return found or [Finding(check="stamps", verdict="ok", sentence=text, value=0.0, unit="1")]


def _wrong_stamps(channels: Sequence[Channel]) -> Iterator[Finding]:
    """What is wrong with the stamps of channels: a clock that was set, and rows that were dropped or sorted."""

    def names(part: str) -> tuple[str, ...]:
        return tuple(dict.fromkeys(channel.name for channel in channels if getattr(channel.lost, part)))

    rows = sum(channel.time.size for channel in channels)
    astray, backward, repeated = (
        sum(getattr(channel.lost, part) for channel in channels) for part in ("astray", "backward", "repeated")
    )
    if sets := tuple(dict.fromkeys(each for channel in channels for each in channel.lost.sets)):
        back = any(by < 0.0 for _, by in sets)
        text = ", ".join(
            f"{'back' if by < 0.0 else 'forward'} by {abs(by):.6g} s at t = {at:.2f} s" for at, by in sets[:_TOLD]
        )
        more = f" and {len(sets) - _TOLD} times more" if len(sets) > _TOLD else ""
        yield Finding(
            check="stamps",
            verdict="defect" if back else "warning",
            sentence=f"the clock was set {text}{more}",
            value=sets[0][1],
            unit="s",
            channels=names("sets"),
            consequence=f"the pieces are put {APART:g} s apart, each a stretch of its own"
            + ("; other verbs refuse the log until that is written" if back else ""),
            remedy="keep the clock as it is while logging, or stamp by a clock that is never set",
            fix=Fix(f"pieces between which the clock was set put {APART:g} s apart"),
            short="the clock was set back" if back else "the clock was set",
        )
    finding = partial(Finding, check="stamps", unit="1")
    if astray:
        share = astray / (rows + astray)
        yield finding(
            verdict="warning" if share > _MANY else "note",
            sentence=f"{astray} values have a stamp that is astray, far from those around it ({100.0 * share:.2g} %)",
            value=share,
            channels=names("astray"),
            consequence="their rows are left out",
            remedy="find out what wrote these stamps",
            fix=Fix(f"{astray} values with a stamp that is astray dropped"),
        )
    if backward:
        share = backward / rows
        listed = ", ".join(names("backward"))
        yield finding(
            verdict="defect",
            sentence=f"time runs backwards: {backward} values stand after later ones ({100.0 * share:.2g} %)",
            value=share,
            channels=names("backward"),
            consequence="derivatives change sign there; other verbs refuse the log",
            remedy="sort the rows by time",
            fix=Fix(f"rows of {listed} sorted by time ({backward} were out of order)"),
        )
    if repeated:
        share = repeated / (rows + repeated)
        yield finding(
            verdict="warning" if share > _MANY else "note",
            sentence=f"{100.0 * share:.2g} % of the values repeat the stamp of another ({repeated} values)",
            value=share,
            channels=names("repeated"),
            consequence="two values at one instant have no derivative; the last of them is taken",
            remedy="find out why the logger wrote them, or whether its stamps are rounded",
            fix=Fix(f"{repeated} values with a repeated stamp dropped, the last of each kept"),
        )


STAMPS = Check("stamps", _stamps)


_SLOW, _TOO_SLOW = 4.5, 1.0
"""Rates below which motion is coarse, and below which it is not seen [Hz]."""
_JITTER = 0.3
"""Share of its period by which a channel's stamps may stray before it matters."""
_MUCH = 0.05
"""Share of the time without data from which gaps are a loss."""


def _rates(records: Sequence[Record]) -> list[Finding]:
    """Say how often the motion is sampled."""
    rates: dict[str, float] = {}
    jitter: dict[str, float] = {}
    for channel in _motion(records):
        if channel.period > 0.0:
            rates[channel.name] = min(rates.get(channel.name, np.inf), 1.0 / channel.period)
            jitter[channel.name] = max(jitter.get(channel.name, 0.0), _strays(channel))
    if not rates:
        text = "no channel of motion has two samples"
        return [Finding(check="rates", verdict="cannot tell", sentence=text, unit="Hz")]
    slowest, fastest = min(rates, key=lambda n: rates[n]), max(rates, key=lambda n: rates[n])
    value = float(rates[slowest])
    told = f"motion is sampled at {value:.3g} Hz"
    if rates[fastest] > 1.05 * value:
        told += f" ({slowest}) to {rates[fastest]:.3g} Hz ({fastest})"
    shaky = max(jitter, key=lambda n: jitter[n])
    verdict: Verdict = "ok"
    channels, wrong, remedy = tuple(rates), "", ""
    if value < _SLOW:
        verdict, channels = "defect" if value < _TOO_SLOW else "warning", (slowest,)
        wrong = f"turns and onsets of thrust that last less than {2.0 / value:.2g} s are not seen"
        remedy = "record at 10 Hz or more"
    elif jitter[shaky] > _JITTER:
        verdict, channels = "note", (shaky,)
        told = f"{told}, but stamps of {shaky} stray by {100.0 * jitter[shaky]:.0f} % of their step"
        wrong = "speeds derived from positions, and accelerations, are noisier than the sensor"
        remedy = "log the stamp of the measurement and not that of its arrival"
    return [
        Finding(
            check="rates",
            verdict=verdict,
            sentence=told,
            value=value,
            unit="Hz",
            channels=channels,
            consequence=wrong,
            remedy=remedy,
            parts={name: float(rate) for name, rate in rates.items()},
        )
    ]


def _gaps(records: Sequence[Record]) -> list[Finding]:
    """Count the stretches without data."""
    holes: dict[str, list[tuple[float, float]]] = {}
    lost = whole = 0.0
    for record in records:
        here: list[tuple[float, float]] = []
        for channel in record.log.channels.values():
            if command_kind(channel.name) and is_logged_on_change(channel):
                continue
            found = gaps(channel, gap_limit(channel, None))
            holes.setdefault(channel.name, []).extend(found)
            here += found
        lost += _union(here)
        whole += max((c.time[-1] - c.time[0] for c in record.log.channels.values()), default=0.0)
    finding = partial(Finding, check="gaps", unit="1")
    names = tuple(name for name, found in holes.items() if found)
    if not names:
        return [finding(verdict="ok", sentence="no gaps", value=0.0)]
    share = lost / whole if whole > 0.0 else 1.0
    longest = max(high - low for found in holes.values() for low, high in found)
    count = max(len(found) for found in holes.values())
    text = f"{count} gaps in {', '.join(names)}, the longest {longest:.2g} s: {100.0 * share:.2g} % of the time"
    return [
        finding(
            verdict="warning" if share > _MUCH else "note",
            sentence=text,
            value=share,
            channels=names,
            consequence="the log falls into stretches there; those under 5 s are lost",
            remedy="find out what stopped the logger; nothing is interpolated across a gap",
            parts={"longest": longest},
        )
    ]


def _motion(records: Sequence[Record]) -> list[Channel]:
    return [r.log.channels[name] for r in records for name in MOTION if name in r.log.channels]


def _strays(channel: Channel) -> float:
    """How far the usual step strays from the period, as a share of it; dropped samples do not count."""
    steps = np.diff(channel.time)
    usual = steps[(steps < 1.5 * channel.period) & (steps > 0.0)]
    return float(np.std(usual) / channel.period) if usual.size else 0.0


def _union(spans: list[tuple[float, float]]) -> float:
    """Length of the union of spans [s]."""
    total, end = 0.0, -np.inf
    for low, high in sorted(spans):
        total += max(0.0, high - max(low, end))
        end = max(end, high)
    return total


RATES = Check("rates", _rates)


GAPS = Check("gaps", _gaps)


def _time_unit(records: Sequence[Record]) -> list[Finding]:
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
