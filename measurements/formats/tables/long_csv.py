"""Long CSV: a bag flattened to time, topic, field, value."""

from ..base import Format, Head, Recording, Request
from .tables import is_long, long_recording, read_text, with_remarks


def _matches(head: Head) -> bool:
    return is_long(head.columns)


def _read(head: Head, request: Request) -> Recording:
    return with_remarks(long_recording(read_text(head), head.path), head)


LONG_CSV = Format("long CSV", _matches, _read, (".csv", ".gz"), marked=False)
