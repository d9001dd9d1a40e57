"""Parquet: a long or a wide table in columns."""

from typing import Any

from ...physics.errors import LogError
from .base import EXPECTED, Format, Head, Name, Recording, Request, check_unpacked, in_file
from .tables import LONG, is_long, is_wide, long_recording, time_column, wide_recording

_NUMBER = 8
"""Bytes of a number in memory."""


def _matches(head: Head) -> bool:
    return head.start.startswith(b"PAR1") and not head.gzipped


def _read(head: Head, request: Request) -> Recording:
    import pyarrow.parquet

    # The library opens no file whose name is not UTF-8.
    with head.path.open("rb") as file, in_file(head.path):
        table = pyarrow.parquet.ParquetFile(file)
        given = [str(name) for name in table.schema_arrow.names]
        columns, rows = columns_of(table.schema_arrow), table.metadata.num_rows
        if rows <= 0 or not (is_long(columns) or is_wide(columns)):
            raise LogError(f"{EXPECTED}; got {rows} rows of {', '.join(columns) or 'no columns'}.")
        time = time_column(columns)
        names = [] if is_long(columns) else [Name("", column) for column in columns if column != time]
        chosen = request.choose(names) if names else frozenset()
        wanted = {time, *LONG} if is_long(columns) else {time, *(name.field for name in chosen)}
        check_unpacked(rows * len(wanted) * _NUMBER, head.path.stat().st_size)
        read = [name for name, column in zip(given, columns, strict=True) if column in wanted]
        # An index is a column like any other in the file; only pandas' remarks set it apart.
        frame = table.read(columns=read).to_pandas(ignore_metadata=True)
    named = dict(zip(given, columns, strict=True))
    frame.columns = [named[str(name)] for name in frame.columns]
    if is_long(columns):
        return long_recording(frame, head.path)
    unread = tuple(name for name in names if name not in chosen)
    return wide_recording(frame, head.path, unread)


def columns_of(schema: Any) -> tuple[str, ...]:
    """Names of the columns (of a `pyarrow.Schema`), stripped; an index of instants, whatever its name, is the time."""
    names = tuple(str(name).strip() for name in schema.names)
    if time_column(names) is not None:
        return names
    index = (schema.pandas_metadata or {}).get("index_columns", [])
    stamps = [k for k, one in enumerate(schema) if one.name in index and str(one.type).startswith(("time", "duration"))]
    return tuple("time" if stamps[:1] == [k] else name for k, name in enumerate(names))


PARQUET = Format("Parquet", _matches, _read, (".parquet",), library="pyarrow")
