"""Tables in memory as streams: a data frame of any library, with a row for each stamp or for each value."""

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..physics.errors import LogError
from ..physics.motion import Array
from .formats.base import Stream
from .formats.time_columns import TimeColumn, find_time

if TYPE_CHECKING:
    import pandas as pd

_VALUES = ("value", "_value", "val")
"""Columns of a long table that hold its numbers, in lower letters."""
_NAMES = ("field", "_field", "name", "channel", "signal", "variable", "metric", "key", "tag")
"""Columns that say of which channel a number is; the first that is there."""
_TOPICS = ("topic", "_measurement", "measurement")
"""Columns that may stand beside these, and name the message or the sensor."""


def streams_of(table: Any, time: str | None, where: str) -> list[Stream]:
    """The streams of a data frame; see `Log.from_dataframe`.

    A table with a column of names and one of values is long, as telemetry is exported: every name is a stream with its
    own stamps. Every other table has a row for each stamp, and a column for each stream.

    Raises
    ------
    LogError
        for what is no data frame, has no time, or has names and nothing that is called their value.
    """
    import pandas as pd

    if not isinstance(table, pd.DataFrame):
        table = _as_pandas(table, where)
    clock = find_time([str(column) for column in table.columns]) if time is None else None
    found = time or next((column for column in table.columns if clock is not None and str(column) == clock.name), None)
    if found is not None and found not in table.columns:
        raise LogError(f"{where}: no column {found!r}; expected one of {', '.join(map(str, table.columns))}")
    if found is None and isinstance(table.index, pd.RangeIndex):
        raise LogError(f"{where}: no column holds the time; say time='...', or make the time the index")
    stamps = _seconds(table.index.to_series() if found is None else table[found], str(found))
    rows = np.arange(1, stamps.size + 1, dtype=np.int64)
    name, value = (_one_of(table, known, words) for known, words in ((_NAMES, True), (_VALUES, False)))
    if name is None:
        kept = {str(column): _numbers(table[column]) for column in table.columns if column != found}
        return [Stream("", key, stamps, column, rows) for key, column in kept.items()]
    if value is None:
        raise LogError(
            f"{where}: the column {name!r} holds names, so this is a long table, but no column is called 'value'; "
            f"rename the column of the numbers, or pivot: table.pivot_table(index={found!r}, columns={name!r}, "
            "values=...)"
        )
    topic = _one_of(table, _TOPICS, True)
    labels = [name] if topic is None else [topic, name]
    numbers, streams = _numbers(table[value]), []
    for label, places in table.groupby(labels, sort=True, observed=True).indices.items():
        *before, field = label if isinstance(label, tuple) else (label,)
        order = places[np.argsort(stamps[places], kind="stable")]
        streams.append(Stream("".join(map(str, before)), str(field), stamps[order], numbers[order], rows[order]))
    return streams


def _one_of(table: "pd.DataFrame", known: Sequence[str], words: bool | None = None) -> str | None:
    """The first of some columns that a table has; with `words`, only one that holds them, or only one that does not."""
    from pandas.api.types import is_numeric_dtype

    by_name = {str(column).lower(): column for column in table.columns}
    found = [by_name[name] for name in known if name in by_name]
    return next((c for c in found if words is None or is_numeric_dtype(table[c]) is not words), None)


def _seconds(stamps: "pd.Series", name: str) -> Array:
    import pandas as pd

    if not pd.api.types.is_numeric_dtype(stamps) and pd.api.types.is_string_dtype(stamps):
        numbers = pd.to_numeric(stamps, errors="coerce")
        stamps = numbers if numbers.notna().any() else pd.to_datetime(stamps, errors="coerce", utc=True)
    if pd.api.types.is_datetime64_any_dtype(stamps):
        seconds = (stamps - stamps.min()).dt.total_seconds()
    elif pd.api.types.is_timedelta64_dtype(stamps):
        seconds = stamps.dt.total_seconds()
    else:
        numbers = pd.to_numeric(stamps, errors="coerce")
        seconds = numbers / (find_time((name,)) or TimeColumn(name)).ticks(float(numbers.min()))
    return seconds.to_numpy(dtype=float)


def _numbers(column: "pd.Series") -> Array:
    import pandas as pd

    return np.asarray(pd.to_numeric(column, errors="coerce"), dtype=float)


def _as_pandas(table: Any, where: str) -> Any:
    """A data frame of another library as one of pandas: by its own conversion, by protocol, or by columns."""
    import pandas as pd

    if hasattr(table, "to_pandas"):
        try:
            return table.to_pandas()
        except ImportError:  # polars asks for pyarrow, and offers the protocol up to its version 1
            if not hasattr(table, "__dataframe__"):
                return pd.DataFrame({name: list(table[name]) for name in table.columns})
    if not hasattr(table, "__dataframe__"):
        raise LogError(f"{where}: expected a data frame, got {type(table).__name__}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # pandas prefers Arrow's protocol, which needs pyarrow
        return pd.api.interchange.from_dataframe(table)
