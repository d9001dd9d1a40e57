"""Checks of the sampling: time stamps, rates and gaps of the channels, the unit of time, and rows that were made.

Stamps may repeat or go back. Heading and way must change as much as their rates say over the same stamps. On a finer
grid than it was measured on, a log has rows that repeat, or lie on lines between others.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ....physics.motion import Array
from ...canonical import MOTION, Channel, command_kind
from ...channels.channel_map import TIME, Entry, map_text
from ...channels.conversion import APART
from ...formats.base import PER_SECOND
from ...log import Log
from ...preparation.resampling import gap_limit, gaps, is_logged_on_change
from ..axes import track_of
from ..faults import Fault, Kind
from ..record import Channels, Check, Finding, Fix, Found, Record, Verdict, altered
from .units import FINE, turning_of

_MANY = 0.01
"""Share of stamps that are wrong from which a derivative suffers; fewer are told, no more."""
_TOLD = 3
"""Settings of the clock that a sentence tells before it counts the rest."""


def _stamps(records: Sequence[Record]) -> Found:
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


def _rates(records: Sequence[Record]) -> Found:
    """Say how often the motion is sampled."""
    rates: dict[str, float] = {}
    jitter: dict[str, float] = {}
    for channel in _motion(records):
        if channel.period > 0.0:
            rates[channel.name] = min(rates.get(channel.name, np.inf), 1.0 / channel.period)
            jitter[channel.name] = max(jitter.get(channel.name, 0.0), _strays(channel))
    if not rates:
        return Finding(check="rates", verdict="cannot tell", sentence="no channel of motion has two samples", unit="Hz")
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
    return Finding(
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


def _gaps(records: Sequence[Record]) -> Found:
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
        return finding(verdict="ok", sentence="no gaps", value=0.0)
    share = lost / whole if whole > 0.0 else 1.0
    longest = max(high - low for found in holes.values() for low, high in found)
    count = max(len(found) for found in holes.values())
    text = f"{count} gaps in {', '.join(names)}, the longest {longest:.2g} s: {100.0 * share:.2g} % of the time"
    return finding(
        verdict="warning" if share > _MUCH else "note",
        sentence=text,
        value=share,
        channels=names,
        consequence="the log falls into stretches there; those under 5 s are lost",
        remedy="find out what stopped the logger; nothing is interpolated across a gap",
        parts={"longest": longest},
    )


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


_OF_MOTION = (*MOTION, "ax", "ay")
_LEAST_ROWS = 200
"""Rows that are needed, and a tenth of it of measured ones, for a median and quantiles to mean something."""
_FLAT = 0.01
"""Bend of a record, beside its largest ones, up to which a row lies on the line between its neighbours; of rows that
are measured, one in fifty does."""
_SHARE = 0.6
"""Share of such rows from which a log is interpolated: to three times its rate or more."""
_EVEN = 0.8
"""Share of spans between measured rows that are of one length, but for rounding: a logger loses some."""
_ENDS = 0.5
"""Time for which the ends of a log repeat one row from which it was filled up there [s]."""


def _resampled(records: Sequence[Record]) -> Found:
    """Tell held, interpolated and filled-up rows from measured ones; a log of such rows is sound at its own rate.

    A note for each way in which the rows are not measured; none where they are.
    """
    found = [finding for record in records for finding in _unmeasured(record.log.channels)]
    # Several logs of one boat are told of once.
    return list({finding.sentence: finding for finding in found}.values())


def _unmeasured(channels: Channels) -> list[Finding]:
    table = _table(channels)
    if table is None:
        return []
    time, values, names = table
    fresh = _new(values)
    note, result = partial(Finding, check="resampled", verdict="note", channels=names), []
    padded = _padding(time, values, fresh)
    if padded:
        text = f"the log repeats one row for {padded:.2g} s at its end or start: it was filled up there"
        fix = Fix(
            f"{padded:.2g} s of one repeated row at the ends of the log dropped",
            partial(_thinned, keep=_between_padding),
        )
        result.append(note(sentence=text, value=padded, unit="s", fix=fix))
    rate = float((time.size - 1) / (time[-1] - time[0]))
    rows = _held_over(fresh)
    if rows > 1:
        text = f"all channels of motion are held: measured {rate / rows:.3g} times a second, written {rate:.3g} times"
        fix = Fix(
            f"rows that repeat the one before dropped: {rate / rows:.3g} rows a second kept",
            partial(_thinned, keep=_measured),
        )
        wrong = "rows that repeat hold no new measurement"
        result.append(note(sentence=text, value=rate / rows, unit="Hz", consequence=wrong, fix=fix))
    elif rows := _interpolated(values):
        text = f"the log is interpolated to {rate:.3g} Hz from about {rate / rows:.3g} Hz"
        result.append(note(sentence=text, value=rate / rows, unit="Hz"))
    return result


def _table(channels: Channels) -> tuple[Array, list[Array], tuple[str, ...]] | None:
    """Stamps and records of the motion where all of it is one table; None otherwise."""
    parts = [channels[name] for name in _OF_MOTION if name in channels]
    if len(parts) < 3 or parts[0].time.size < _LEAST_ROWS:
        return None
    time = parts[0].time
    if not all(part.time is time or np.array_equal(part.time, time) for part in parts):
        return None
    values = [part.unwrapped for part in parts]
    return time, values, tuple(part.name for part in parts)


def _new(values: Sequence[Array]) -> NDArray[np.bool_]:
    """Whether a record changes from the row before to each row; records one by one, since a long log has many rows."""
    fresh = np.zeros(values[0].size, dtype=bool)
    fresh[0] = True
    for record in values:
        fresh[1:] |= record[1:] != record[:-1]
    return fresh


def _padding(time: Array, values: Sequence[Array], fresh: NDArray[np.bool_]) -> float:
    """Time for which a log of a moving boat repeats its first or its last row [s]."""
    first, last = _inner(fresh)
    if last <= first:
        return 0.0
    # A boat that lies still shows the same row, too: beside what is filled up, it moves as it does elsewhere.
    near = max(3, int(np.searchsorted(time, time[first] + _ENDS)) - first)
    ends = (
        (float(time[first] - time[0]), slice(first, first + near)),
        (float(time[-1] - time[last]), slice(max(first, last - near), last)),
    )
    if not any(length > _ENDS for length, _ in ends):
        return 0.0
    usual = np.array([np.median(np.abs(np.diff(record[first : last + 1]))) for record in values])
    return sum(length for length, rows in ends if length > _ENDS and _moves(values, rows, usual))


def _moves(values: Sequence[Array], rows: slice, usual: Array) -> bool:
    """True when most records move at least a tenth as fast in some rows as they usually do."""
    steps = np.array([np.median(np.abs(np.diff(record[rows.start : rows.stop + 1]))) for record in values])
    moving = usual > 0.0
    return bool(np.count_nonzero(steps[moving] > 0.1 * usual[moving]) > 0.5 * moving.sum())


def _inner(fresh: NDArray[np.bool_]) -> tuple[int, int]:
    """The last row of what may be filled up at the start, and the first of what may be at the end."""
    rows = np.flatnonzero(fresh[1:]) + 1
    return (int(rows[0]) - 1, int(rows[-1])) if rows.size else (0, 0)


def _between_padding(fresh: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The rows without what may be filled up at either end."""
    first, last = _inner(fresh)
    keep = np.zeros(fresh.size, dtype=bool)
    keep[first : last + 1] = True
    return keep


def _held_over(fresh: NDArray[np.bool_]) -> int:
    """Rows over which every record is held, in the median of those that are new; 1 where none is."""
    spans = np.diff(np.flatnonzero(fresh))
    if spans.size < _LEAST_ROWS // 10:
        return 1
    rows = round(float(np.median(spans)))
    return rows if np.mean(np.abs(spans - rows) <= 1) >= _EVEN and float(np.mean(spans)) > 1.5 else 1


def _measured(fresh: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The rows that are new; of a boat at rest, which shows nothing new, one wherever one was measured."""
    rows = np.flatnonzero(fresh)
    since = np.arange(fresh.size) - rows[np.cumsum(fresh) - 1]
    return fresh | (since % _held_over(fresh) == 0)


def _thinned(channels: Channels, keep: Callable[[NDArray[np.bool_]], NDArray[np.bool_]]) -> dict[str, Channel]:
    """The channels of motion with some of their rows; commands stay, since what is held is what was commanded."""
    table = _table(channels)
    if table is None:
        return dict(channels)
    _, values, names = table
    rows = keep(_new(values))
    return altered(channels, names, lambda channel: channel.rows(rows))


def _interpolated(values: Sequence[Array]) -> int:
    """Rows from one measured row to the next where those between lie on lines; 0 where all are measured."""
    worst = np.zeros(values[0].size - 2)
    for record in values:
        bend = np.abs(np.diff(record, n=2))
        size = float(np.quantile(bend, 0.95))
        if size > 0.0:
            np.maximum(worst, bend / size, out=worst)
    if not worst.any():
        return 0
    knots = np.flatnonzero(worst > _FLAT)
    if knots.size < _LEAST_ROWS // 10 or 1.0 - knots.size / worst.size < _SHARE:
        return 0
    spans = np.diff(knots)
    spans = spans[spans > 1]
    rows = float(np.median(spans)) if spans.size else 0.0
    # A measured row between two of the grid bends the line in both: steps of one, and of one less.
    even = bool(spans.size and np.mean(np.abs(spans - rows) <= 1.0) >= _EVEN)
    return round(rows) if even and rows >= 3.0 else 0


RESAMPLED = Check("resampled", _resampled)
