"""Parquet: a long or a wide table in columns."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....physics.errors import LogError, listed
from ....physics.motion import Array
from ..base import EXPECTED, Format, Head, Name, Recording, Request, begins_with, find_time, in_file
from ..unpacking import check_unpacked, most_held
from . import tables

_NUMBER = 8
"""Bytes of a number in memory."""
_USUAL_TIMES = 4
"""How many times its size any file may hold in memory: numbers pack 2 to 1 without being a bomb."""


def _read_parquet(head: Head, request: Request) -> Recording:
    import pyarrow.parquet

    # The library opens no file whose name is not UTF-8.
    with head.path.open("rb") as file, in_file(head.path):
        footer = pyarrow.parquet.ParquetFile(file)
        given = [str(name) for name in footer.schema_arrow.names]
        columns, rows = columns_of(footer.schema_arrow), footer.metadata.num_rows
        tables.check_columns(columns, head.path)
        clock = find_time(columns, head.time)
        if rows > 0 and clock is None and (told := tables.not_called_time(_first_rows(footer, given, columns))):
            raise told
        if rows <= 0 or clock is None or not (tables.is_long(columns, clock) or tables.is_wide(columns, clock)):
            raise LogError(f"{EXPECTED}; got {rows} rows of {listed(columns) or 'no columns'}.")
        long, time = tables.is_long(columns, clock), {clock.name, clock.date or clock.name}
        flat = {name for name, field in zip(columns, footer.schema_arrow, strict=True) if not field.type.num_fields}
        names = [] if long else [Name("", column) for column in columns if column not in time]
        chosen = request.choose(names) if names else frozenset()
        # Lists and structs are no numbers, and a few bytes of them may be a million values a row.
        wanted = flat & (time | (set(tables.LONG) if long else {name.field for name in chosen}))
        read = [name for name, column in zip(given, columns, strict=True) if column in wanted]
        packed = head.path.stat().st_size
        numbers = rows * (tables.LONG_ROW if long else len(wanted))
        most = max(most_held(packed), _USUAL_TIMES * packed)
        check_unpacked(_NUMBER * numbers, packed, most)
        check_unpacked(_claimed(footer.metadata, read), packed, most)
        # A word that stands in every row is held once.
        words = [name for name in read if _is_text(footer.schema_arrow.field(name).type)]
        table = pyarrow.parquet.ParquetFile(file, read_dictionary=words)
        # An index is a column like any other in the file; only pandas' remarks set it apart.
        frame = table.read(columns=read).to_pandas(ignore_metadata=True, split_blocks=True, self_destruct=True)
    named = dict(zip(given, columns, strict=True))
    frame.columns = [named[str(name)] for name in frame.columns]
    if long:
        return tables.long_recording([frame], head.path, clock)
    unread = tuple(name for name in names if name.field not in wanted)
    return tables.wide_recording([frame], head.path, clock, unread)


def _first_rows(footer: Any, given: Sequence[str], columns: Sequence[str]) -> dict[str, Array]:
    """The first rows of the columns of numbers; nothing of others."""
    import pyarrow

    kinds = (footer.schema_arrow.field(k).type for k in range(len(given)))
    numbers = [pyarrow.types.is_integer(kind) or pyarrow.types.is_floating(kind) for kind in kinds]
    wanted = [name for name, number in zip(given, numbers, strict=True) if number]
    batch = next(footer.iter_batches(batch_size=200, columns=wanted), None) if wanted else None
    own = dict(zip(given, columns, strict=True))
    found = {} if batch is None else {own[name]: np.asarray(batch.column(name), float) for name in wanted}
    return found | {name: np.zeros(0) for name in columns if name not in found}


def _claimed(metadata: Any, columns: Sequence[str]) -> int:
    """Bytes of the pages of some columns, unpacked, as the end of the file says."""
    wanted = [k for k in range(metadata.num_columns) if metadata.schema.column(k).path.split(".")[0] in columns]
    groups = (metadata.row_group(k) for k in range(metadata.num_row_groups))
    return sum(max(group.column(k).total_uncompressed_size, 0) for group in groups for k in wanted)


def _is_text(kind: Any) -> bool:
    import pyarrow

    return any(check(kind) for check in (pyarrow.types.is_string, pyarrow.types.is_binary))


def columns_of(schema: Any) -> tuple[str, ...]:
    """Names of the columns (of a `pyarrow.Schema`), stripped; an index of instants, whatever its name, is the time."""
    names = tuple(str(name).strip() for name in schema.names)
    if find_time(names) is not None:
        return names
    index = (schema.pandas_metadata or {}).get("index_columns", [])
    stamps = [k for k, one in enumerate(schema) if one.name in index and str(one.type).startswith(("time", "duration"))]
    return tuple("time" if stamps[:1] == [k] else name for k, name in enumerate(names))


PARQUET = Format("Parquet", begins_with(b"PAR1"), _read_parquet, (".parquet",), library="pyarrow", table=True)
