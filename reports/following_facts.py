"""What `adapt --json` prints of a boat that is followed: a record a row."""

from typing import ClassVar

from ..discovery.calibration.change_watch import Alarm
from ..discovery.calibration.following import Update
from ..measurements.statistics.robust import CI
from ..physics.file_records import Flag, Number, Record


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
