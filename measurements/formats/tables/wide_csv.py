"""Wide CSV: a row per time stamp, a column per channel."""

from ..base import Format, Head, Recording, Request
from .tables import is_wide, read_text, wide_recording, with_remarks


def _matches(head: Head) -> bool:
    return is_wide(head.columns)


def _read(head: Head, request: Request) -> Recording:
    return with_remarks(wide_recording(read_text(head), head.path), head)


WIDE_CSV = Format("wide CSV", _matches, _read, (".csv", ".gz"), marked=False)
