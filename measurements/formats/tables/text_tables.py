"""Text tables, long and wide: small ones of numbers by Arrow, which is loaded at once, all others by pandas."""

from dataclasses import replace

from ....physics.files import is_mark
from ..base import Head, Recording, Request
from .arrow_part import small_table
from .pandas_part import text_parts
from .tables import check_columns, is_long, long_recording, wide_recording


def read_text(head: Head, request: Request) -> Recording:
    """Read a text table, long or wide, part by part, so that only its numbers are ever in memory together.

    Raises
    ------
    LogError
        when the text cannot be read as a table, has no rows, or is larger than any.
    """
    columns, clock = head.text.columns, head.clock
    assert clock is not None  # else it is no table
    check_columns(columns, head.path)
    cut = long_recording if is_long(columns, clock) else wide_recording
    names = _unique(columns)
    small = small_table(head, names, clock)
    if small is not None:
        request.progress(small.size, small.size)
        return _with_remarks(cut([small], head.path, clock), head)
    with text_parts(head, names, clock, request) as parts:
        return _with_remarks(cut(parts, head.path, clock), head)


def _with_remarks(recording: Recording, head: Head) -> Recording:
    """Put the remarks above a table among its notes, but not the mark of the verb that wrote it."""
    notes = tuple(text for text in head.text.remarks if not is_mark(text))
    return replace(recording, notes=(*notes, *recording.notes)) if notes else recording


def _unique(columns: tuple[str, ...]) -> tuple[str, ...]:
    seen: dict[str, int] = {}
    names = []
    for column in columns:
        count = seen.get(column, 0)
        seen[column] = count + 1
        names.append(f"{column}.{count}" if count else column)
    return tuple(names)
