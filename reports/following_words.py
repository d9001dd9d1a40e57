"""Words for a boat that is followed: a row an update, a sentence an alarm, and the same as JSON."""

from collections.abc import Sequence
from typing import ClassVar

from ..discovery.calibration.change_watch import Alarm
from ..discovery.calibration.following import Update
from ..measurements.statistics.blocks import CI
from ..physics.file_records import Flag, Number, Record
from ..physics.presentation import listing, number, unit_text
from .hull_diary import plain

_WIDE, _TIME = 13, 9
"""Widths of a column and of the time: a value of three digits and its interval of two, eight of them in 120 columns."""


def heading(symbols: Sequence[str], units: Sequence[str]) -> tuple[str, str]:
    """The lines above the rows: what is followed, and its units."""
    told = [unit_text(unit) for unit in units]
    return f"{'t':>{_TIME}}" + _cells(symbols), f"{'s':>{_TIME}}" + _cells(told)


def row(update: Update) -> str:
    """The values of an update, each with half of its 95 % interval; a mark where the row told nothing."""
    pairs = zip(update.values.tolist(), update.deviation.tolist(), strict=True)
    cells = _cells([f"{number(value)}±{number(CI * wide, 2)}" for value, wide in pairs])
    return f"{update.time:>{_TIME}.1f}{cells}" + ("" if update.excited else "  at rest")


def _cells(texts: Sequence[str]) -> str:
    return "".join(f" {text:>{_WIDE - 1}}" for text in texts)


def alarm_sentence(alarm: Alarm, unit: str) -> str:
    """Which parameter changed, since when, by how much, and what else may have been it."""
    unit = f" {unit_text(unit)}".rstrip()
    when = f"t = {alarm.since:.1f} s"
    if alarm.earliest < alarm.latest:
        when += f" ({alarm.earliest:.1f} to {alarm.latest:.1f} s)"
    text = (
        f"{plain(alarm.symbol)} ({alarm.symbol}) went from {number(alarm.before)} to {number(alarm.after)}{unit} "
        f"(± {number(alarm.half, 2)}), since {when}; known at t = {alarm.time:.1f} s"
    )
    if alarm.alike:
        others = listing([f"{plain(symbol)} ({symbol})" for symbol in alarm.alike])
        text += f". The rows so far tell no less of {others}"
    return f"{text}."


def table_row(update: Update) -> str:
    """A row of the CSV of values: time, then value and ends of the 95 % interval of each, and whether it counted."""
    pairs = zip(update.values.tolist(), update.deviation.tolist(), strict=True)
    cells = [f"{x:.9g},{x - CI * d:.9g},{x + CI * d:.9g}" for x, d in pairs]
    return ",".join([f"{update.time:.3f}", *cells, str(int(update.excited))])


def table_heading(symbols: Sequence[str]) -> str:
    """The header of that CSV."""
    return ",".join(["t", *(f"{s},{s}_low,{s}_high" for s in symbols), "excited"])


class FollowedValue(Record):
    """A parameter now, with its 95 % interval."""

    value: Number
    ci95: tuple[Number, Number]


class AlarmRecord(Record):
    """A change that was noticed, as `change_watch.Alarm` has it."""

    parameter: str
    alike: tuple[str, ...]
    known: Number
    since: Number
    between: tuple[Number, Number]
    before: Number
    after: Number
    half_width: Number


class FollowedRow(Record):
    """A line of the output: time in the log [s], whether the row told something, values by symbol, and an alarm."""

    SCHEMA: ClassVar[str] = "undertow.following/1"

    time: Number
    excited: Flag
    values: dict[str, FollowedValue]
    alarm: AlarmRecord | None = None


def followed_row(update: Update, symbols: tuple[str, ...]) -> FollowedRow:
    """The record of an update."""
    pairs = zip(symbols, update.values.tolist(), (CI * update.deviation).tolist(), strict=True)
    return FollowedRow(
        time=update.time,
        excited=update.excited,
        values={symbol: FollowedValue(value=x, ci95=(x - half, x + half)) for symbol, x, half in pairs},
        alarm=None if update.alarm is None else _record(update.alarm),
    )


def _record(alarm: Alarm) -> AlarmRecord:
    return AlarmRecord(
        parameter=alarm.symbol,
        alike=alarm.alike,
        known=alarm.time,
        since=alarm.since,
        between=(alarm.earliest, alarm.latest),
        before=alarm.before,
        after=alarm.after,
        half_width=alarm.half,
    )
