"""Parquet: a long or a wide table in columns."""

from ...physics.errors import LogError
from .base import EXPECTED, Format, Head, Recording, Request
from .tables import is_long, is_wide, long_recording, wide_recording


def _matches(head: Head) -> bool:
    return head.start.startswith(b"PAR1") and not head.gzipped


def _read(head: Head, request: Request) -> Recording:
    import pyarrow.parquet

    frame = pyarrow.parquet.read_table(head.path).to_pandas()
    frame.columns = [str(name).strip() for name in frame.columns]
    columns = tuple(frame.columns)
    if frame.empty or not (is_long(columns) or is_wide(columns)):
        raise LogError(f"{head.path}: {EXPECTED}; got {len(frame)} rows of {', '.join(columns) or 'no columns'}.")
    return long_recording(frame, head.path) if is_long(columns) else wide_recording(frame, head.path)


PARQUET = Format("Parquet", _matches, _read, (".parquet",), library="pyarrow")
