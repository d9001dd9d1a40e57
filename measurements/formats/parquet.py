"""Parquet: a long or a wide table in columns."""

from typing import Any

from ...physics.errors import LogError
from .base import EXPECTED, Format, Head, Recording, Request
from .tables import is_long, is_wide, long_recording, time_column, wide_recording


def _matches(head: Head) -> bool:
    return head.start.startswith(b"PAR1") and not head.gzipped


def _read(head: Head, request: Request) -> Recording:
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(head.path)
    columns = columns_of(table.schema)
    # An index is a column like any other in the file; only pandas' remarks set it apart.
    frame = table.to_pandas(ignore_metadata=True)
    frame.columns = list(columns)
    if frame.empty or not (is_long(columns) or is_wide(columns)):
        raise LogError(f"{head.path}: {EXPECTED}; got {len(frame)} rows of {', '.join(columns) or 'no columns'}.")
    return long_recording(frame, head.path) if is_long(columns) else wide_recording(frame, head.path)


def columns_of(schema: Any) -> tuple[str, ...]:
    """Names of the columns (of a `pyarrow.Schema`), stripped; an index of instants, whatever its name, is the time."""
    names = tuple(str(name).strip() for name in schema.names)
    if time_column(names) is not None:
        return names
    index = (schema.pandas_metadata or {}).get("index_columns", [])
    stamps = [k for k, one in enumerate(schema) if one.name in index and str(one.type).startswith(("time", "duration"))]
    return tuple("time" if stamps[:1] == [k] else name for k, name in enumerate(names))


PARQUET = Format("Parquet", _matches, _read, (".parquet",), library="pyarrow")
