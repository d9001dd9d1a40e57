"""The two table shapes, long and wide, cut into streams; shared by all readers of tables."""

import warnings
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....physics.errors import LogError, shown
from ....physics.files import yaml_text
from ....physics.motion import Array
from ..base import EPOCH, Name, Recording, Stream, TimeColumn

if TYPE_CHECKING:
    import pandas as pd

LONG = ("topic", "field", "value")
"""Columns of a long table beside the time."""
LAST = 2**63
"""No clock shows so many nanoseconds: a stamp beyond is broken."""
_MOST_COLUMNS = 10_000
"""Columns, or topics with their fields: a bag with everything in it has some thousand."""
LONG_ROW = 4
"""Numbers that a row of a long table takes in memory: time, value, and what sorts them."""
HEADER = 2
"""Line of the first row, below the header."""
_ROWS, _ALIKE = 200, 20.0
"""Rows at the beginning of a table in which a time is looked for, and how much longer than the usual one its longest
step may be there: one gap of twenty rows."""
_DAY = 86_400_000_000_000
"""Nanoseconds of a day."""


def is_long(columns: Sequence[str], clock: TimeColumn | None) -> bool:
    """True when the columns are those of a flattened bag."""
    return clock is not None and set(LONG) <= set(columns)


def is_wide(columns: Sequence[str], clock: TimeColumn | None) -> bool:
    """True when the columns are one time column and channels."""
    return clock is not None and len(columns) > 1 and not is_long(columns, clock)


def running(columns: Mapping[str, Array]) -> list[str]:
    """The columns that may be the time: numbers that rise from each row to the next, by steps that are much alike."""
    result = []
    for name, values in columns.items():
        steps = np.diff(values[:_ROWS])
        steps = steps[steps != 0.0] if set(LONG) <= set(columns) else steps  # the fields of a message share a stamp
        if (
            steps.size > 1
            and np.isfinite(steps).all()
            and steps.min() > 0.0
            and steps.max() < _ALIKE * np.median(steps)
        ):
            result.append(name)
    return result


def not_called_time(columns: Mapping[str, Array]) -> LogError | None:
    """Say which column of a table without a time is one by its numbers, with the line that names it; None for none."""
    clocks = running(columns)
    if not clocks:
        return None
    line = yaml_text({"time": clocks[0]}).strip()
    return LogError(
        f"no column of this table is called time, but '{clocks[0]}' runs forward as one does. Say so in a channel map "
        f"(--map), '{line}', or with its unit where that is not the second, 'time: {{from: ..., unit: ms}}'; or rename "
        "the column.",
        f"{line}\n",
    )


def without_names(what: str, columns: Mapping[str, Array], matrix: str | None = None) -> LogError:
    """Say how a table without names, and its time, are named by the numbers of its columns, counted from 1.

    Parameters
    ----------
    what : the table, for the sentence
    matrix : its name, where the file has several
    """
    clocks, width = running(columns), len(columns)
    at = int(clocks[0].removeprefix("column ")) if clocks else 1
    text = f" ({' and '.join(clocks[:3])} run{'s' * (len(clocks) == 1)} forward as a time does)" if clocks else ""
    line, other = (
        f"{name}: {number}" if matrix is None else f"{name}: {matrix}[{number - 1}]"
        for name, number in (("time", at), ("psi", 1 + at % width))
    )
    return LogError(
        f"expected a log, got {what} of {width} columns without names{text}. Put a line of names above it, or name the "
        f"columns in a channel map (--map), one line for the time and one for each channel, such as '{line}' and "
        f"'{other}'.",
        f"{line}\n# and a line for each channel (x y psi u v r, the commands), such as\n# {other}\n",
    )


def check_columns(columns: tuple[str, ...], path: object) -> None:
    """Refuse a table with more columns than any log has.

    Raises
    ------
    LogError
        telling how many there are.
    """
    if len(columns) > _MOST_COLUMNS:
        raise LogError(f"{path}: expected a table of at most {_MOST_COLUMNS} columns, got {len(columns)}.")


def long_recording(parts: "Iterable[pd.DataFrame]", path: object, clock: TimeColumn) -> Recording:
    """Cut a long table (time, topic, field, value), given in parts, into one stream per topic and field.

    Fields of one message come at the same instants; their streams share one array of stamps.
    """
    column = _Clock(path, clock)
    found: defaultdict[tuple[str, str], list[tuple[NDArray[Any], ...]]] = defaultdict(list)
    done = 0
    for part in parts:
        stamps, value, earlier = column.take(part), numbers_of(part["value"]), np.zeros(0)
        for label, rows in _by_name(part, path):
            earlier = _shared(earlier, stamps[rows])
            found[label].append((earlier, value[rows], rows + (done + HEADER)))
        _check_fields(len(found), path)
        done += len(part)
    streams: list[Stream] = []
    for topic, name in sorted(found):
        given, value, line = (np.concatenate(pieces) for pieces in zip(*found.pop((topic, name)), strict=True))
        time = column.seconds(given)
        time = _shared(streams[-1].time, time) if streams else time
        streams.append(Stream(topic.strip(), name.strip(), time, value, line))
    return Recording(tuple(streams), column.notes, start_ns=column.start_ns, clock=clock.name)


def _shared(earlier: NDArray[Any], later: NDArray[Any]) -> NDArray[Any]:
    """One array in the place of two that are equal."""
    return earlier if np.array_equal(earlier, later) else later


def _by_name(part: "pd.DataFrame", path: object) -> Iterator[tuple[tuple[str, str], NDArray[np.int64]]]:
    """The rows of each field of a topic in a part of a long table; rows that name no field are none's."""
    topic, name = (part[column].astype("category").cat for column in ("topic", "field"))
    fields = len(name.categories)
    # Numbers of two bytes are sorted ten times as fast.
    most = (len(topic.categories) + 1) * (fields + 1)
    key = (topic.codes.to_numpy(np.int64) + 1) * (fields + 1) + name.codes.to_numpy(np.int64) + 1
    order = np.argsort(key.astype(np.int16) if most < 2**15 else key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    _check_fields(starts.size, path)
    for rows in np.split(order, starts[1:]):
        which_topic, which_field = divmod(int(key[rows[0]]), fields + 1) if rows.size else (0, 0)
        if which_field:
            said = str(topic.categories[which_topic - 1]) if which_topic else ""
            yield (said, str(name.categories[which_field - 1])), rows


def _check_fields(count: int, path: object) -> None:
    if count > _MOST_COLUMNS:
        raise LogError(f"{path}: expected a long table of at most {_MOST_COLUMNS} fields of topics, got {count}.")


def wide_recording(
    parts: "Iterable[pd.DataFrame]", path: object, clock: TimeColumn, unread: tuple[Name, ...] = ()
) -> Recording:
    """Cut a wide table (one row per time stamp), given in parts, into one stream per column.

    Parameters
    ----------
    unread : columns that it lacks
    """
    column = _Clock(path, clock)
    stamps: list[NDArray[Any]] = []
    pieces: dict[str, list[Array]] = {}
    for part in parts:
        stamps.append(column.take(part))
        for name in part.columns:
            if name not in (clock.name, clock.date):
                pieces.setdefault(name, []).append(numbers_of(part[name]))
    time = column.seconds(np.concatenate(stamps))
    row = np.arange(time.size, dtype=np.int64) + HEADER
    streams = [Stream("", name, time, np.concatenate(pieces.pop(name)), row) for name in list(pieces)]
    return Recording(tuple(streams), column.notes, unread, column.start_ns, clock=clock.name)


class _Clock:
    """The time of a table that is read in parts."""

    def __init__(self, path: object, clock: TimeColumn) -> None:
        self._path, self._clock, self._cell = path, clock, ""
        self._firsts: list[Any] = []
        self._nanoseconds = self._daily = False

    def take(self, part: "pd.DataFrame") -> NDArray[Any]:
        """The stamps of a part as the file has them, in whole numbers where it has such; else NaN where none is."""
        import pandas as pd

        column = part[self._clock.name]
        if isinstance(column.dtype, pd.CategoricalDtype):
            column = column.astype(column.cat.categories.dtype)
        self._cell = self._cell or next(map(shown, column.dropna()), "")
        self._daily = False
        words = not pd.api.types.is_numeric_dtype(column) and pd.api.types.is_string_dtype(column)
        if words and not np.isfinite(numbers_of(column)).any():
            column, self._daily = _instants(column, None if self._clock.date is None else part[self._clock.date])
        kind = {"M": "datetime64[ns]", "m": "timedelta64[ns]"}.get(getattr(column.dtype, "kind", ""))
        self._nanoseconds = kind is not None
        if kind is not None:
            stamps: NDArray[Any] = column.to_numpy(kind).astype(np.int64)
            stamps = np.where(column.isna(), np.nan, stamps) if column.hasnans else stamps
        elif pd.api.types.is_integer_dtype(column) and not column.hasnans and column.max() < LAST:
            stamps = column.to_numpy(np.int64, copy=True)
        else:
            stamps = numbers_of(column)
            stamps = np.where(stamps < LAST, stamps, np.nan)
        self._firsts.append(np.fmin.reduce(stamps))
        return stamps

    @property
    def _first(self) -> Any:
        """The smallest stamp of all parts."""
        first = np.fmin.reduce(self._firsts)
        if np.isnan(first):
            raise LogError(
                f"{self._path}: column '{self._clock.name}' holds no numbers and no instants, got "
                f"{self._cell or 'empty cells'}; write seconds, or instants as ISO 8601 has them "
                "(2026-05-01T14:03:07.25Z)."
            )
        return first

    @property
    def _per_second(self) -> float:
        return 1e9 if self._nanoseconds else self._clock.ticks(self._first)

    @property
    def _from_first(self) -> bool:
        """True when the time counts from the first stamp, for it counts from an epoch in the file."""
        return bool(self._first / self._per_second >= EPOCH)

    @property
    def notes(self) -> tuple[str, ...]:
        """A note where the time's zero, or its unit, is not the file's own word."""
        first = self._cell if self._nanoseconds and self._cell else self._first
        text = f"time counts from the first stamp, {self._clock.name} = {first}"
        sized = self._clock.per_second is None and not self._nanoseconds and self._per_second != 1.0
        unit = f" (1/{self._per_second:.0f} s since 1970, by its size)" if sized else ""
        return (text + unit,) if self._from_first else ()

    @property
    def start_ns(self) -> int:
        """The file's stamp of the zero of the time [ns]."""
        if not self._from_first:
            return 0
        first, scale = self._first, round(1e9 / self._per_second)
        start = int(first) * scale + round((first - int(first)) * scale)
        return start if start < LAST else 0

    def seconds(self, stamps: NDArray[Any]) -> Array:
        """The time of stamps [s], known once all parts were taken."""
        if self._daily:
            stamps = np.unwrap(stamps, period=_DAY)
        # Subtracting before the conversion to seconds keeps the nanoseconds of stamps since 1970.
        result: Array = (stamps - self._first if self._from_first else stamps) / self._per_second
        return result


def numbers_of(column: "pd.Series") -> Array:
    """The numbers of a column (n,), NaN where it holds no finite one."""
    import pandas as pd

    if column.dtype == bool:
        return column.to_numpy(float)
    if isinstance(column.dtype, pd.CategoricalDtype):
        numbers = np.append(numbers_of(pd.Series(column.cat.categories)), np.nan)
        return numbers[column.cat.codes.to_numpy()]
    numbers = np.asarray(pd.to_numeric(column, errors="coerce"), dtype=float)
    return np.where(np.isfinite(numbers), numbers, np.nan)


def _instants(time: "pd.Series", date: "pd.Series | None") -> "tuple[pd.Series, bool]":
    """Instants that are written in words, and whether they begin anew at midnight; NaT where a word is none.

    ISO 8601 with or without a zone, and what else pandas knows; a date with points has the day first (DIN 5008). With a
    date in a column of its own, the other one is the time of day; alone, it counts from midnight.
    """
    import pandas as pd

    words = time.astype("string").str.strip().str.replace(",", ".")
    hours = words.str.fullmatch(r"\d{1,2}:\d\d(:\d\d(\.\d*)?)?").fillna(False)
    if date is None and hours.any():
        words = words.where(~words.str.fullmatch(r"\d{1,2}:\d\d").fillna(False), words + ":00")
        return pd.to_timedelta(words.where(hours), errors="coerce"), True
    if date is not None:
        words = date.astype("string").str.strip() + " " + words
    found = pd.to_datetime(words, format="ISO8601", utc=True, errors="coerce")
    if found.isna().all():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what it tells of a form that it had to guess
            points = bool(words.str.match(r"\d{1,2}\.\d").fillna(False).any())
            found = pd.to_datetime(words, dayfirst=points, utc=True, errors="coerce")
    return found, False
