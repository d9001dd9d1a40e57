"""Columns that hold the time: how tables call them, in which unit they are, and how a channel map names one."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

EPOCH = 1e8
"""A first stamp above this [s] counts from an epoch (1973), not from the start of the log."""
PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9, "min": 1.0 / 60.0, "h": 1.0 / 3600.0}
"""Units of a time column, and how many of them are a second."""
_UNITS = (*PER_SECOND, "_ms", "_us", "_ns")
_UNIT = (
    r"(?P<s>s|secs?|seconds?)|(?P<ms>ms|msecs?|millis|milliseconds?)|(?P<us>us|[\u00b5\u03bc]s|usecs?|micros|"
    r"microseconds?)|(?P<ns>ns|nsecs?|nanos|nanoseconds?)|(?P<min>mins?|minutes?)|(?P<h>h|hrs?|hours?)"
)
_NAME = re.compile(
    r"(?P<_ns>%time)|[\W_]*(?:(?:unix|utc|gps|ros|rosbag|system|sample|log|elapsed|epoch|relative|header)[ _.]?)*"
    r"(?:ts|(?P<first>t|time)|time[ _]boot|time[ _]?stamp|stamp|elapsed(?:[ _]time)?|epoch|date[ _/-]?time|"
    r"(?P<date>date))"
    rf"[ _.]?[\[(]?(?:{_UNIT})?[\])]?|seconds|secs?|(?P<_ms>milliseconds|millis)|(?P<_us>microseconds|micros)",
    re.IGNORECASE,
)
"""`t`, `time`, `__time` (PlotJuggler), `%time` (rostopic, in ns), `Time (s)`, `timestamp_ms`, `TimeUS`, ..."""


@dataclass(frozen=True, slots=True)
class TimeColumn:
    """Where a table has its time.

    Attributes
    ----------
    name : of the column
    per_second : how many of its units are a second; None where nobody says, so that the size of its stamps tells
    date : column of the date, where the time is that of a day
    """

    name: str
    per_second: float | None = None
    date: str | None = None

    def ticks(self, first: float) -> float:
        """How many units of the column are a second, by its name or by the size of its first stamp.

        Stamps since 1970 tell it: those in milliseconds are a thousand times those in seconds, and so on; the ranges
        from 1973 on follow each other. Stamps that count from the start of a log are seconds.
        """
        if self.per_second is not None:
            return self.per_second
        fitting = [scale for scale in (1e9, 1e6, 1e3) if first >= EPOCH * scale]
        return fitting[0] if fitting else 1.0


def find_time(columns: Sequence[str], given: TimeColumn | None = None) -> TimeColumn | None:
    """Find the column that holds the time; None when there is none.

    Of several, `t` and `time` go before others, and the first before later ones.

    Parameters
    ----------
    given : what a channel map says of it; its unit goes before that in the name

    Examples
    --------
    >>> find_time(("x", "Time (ms)"))
    TimeColumn(name='Time (ms)', per_second=1000.0, date=None)
    >>> find_time(("Date", "Time", "x"))
    TimeColumn(name='Time', per_second=None, date='Date')
    """
    if given is not None:
        own = find_time((given.name,))
        by_name = None if own is None else own.per_second
        return replace(given, per_second=given.per_second or by_name) if given.name in columns else None
    found = {column: match for column in columns if (match := _NAME.fullmatch(column.strip()))}
    stamps = [column for column, match in found.items() if not match["date"]]
    dates = [column for column, match in found.items() if match["date"]]
    if not found:
        return None
    name = min(stamps or dates, key=lambda column: not found[column]["first"])
    unit = next((unit.strip("_") for unit, text in found[name].groupdict().items() if text and unit in _UNITS), None)
    return TimeColumn(name, PER_SECOND.get(unit or ""), dates[0] if stamps and dates else None)
