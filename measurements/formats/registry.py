"""All log formats: every `Format` that a file of this folder or of its folders holds; and the one door to a log."""

from pathlib import Path

from ...physics.errors import LogError, listed
from ...physics.registry_members import how_to_install, objects_in
from .. import formats
from .base import EXPECTED, Format, Head, Recording, Request, in_file, read_head
from .headers import first_numbers
from .tables.tables import not_called_time, without_names

FORMATS: tuple[Format, ...] = tuple(sorted(objects_in(formats, Format), key=lambda form: not form.marked))
"""Asked in this order: those with a mark of their own first."""

SUFFIXES = tuple(dict.fromkeys(suffix for form in FORMATS for suffix in form.suffixes))
"""Usual endings of a log's name."""


def format_of(head: Head) -> Format | None:
    """Find the first format that recognises a file or folder, None when none does."""
    return next((form for form in FORMATS if form.matches(head)), None)


def read_recording(path: Path, request: Request | None = None) -> Recording:
    """Read `path` with the first format that recognises it.

    Raises
    ------
    LogError
        when it is missing, empty, broken, of no known format, or needs a library that is not installed.
    """
    request = request or Request()
    head = read_head(path, request.time)
    if head.entries is None and not head.start.strip():
        raise LogError(f"{path}: the file is empty; {expected()}.")
    form = format_of(head)
    if form is None and head.entries is not None:
        there = f", one of {', '.join(head.entries[:8])}" if head.entries else ""
        raise LogError(f"{path}: expected a log file, got a folder. Name the file inside it{there}.")
    if form is None:
        with in_file(path):
            raise _unknown(head)
    if request.time is not None and not form.table:
        raise LogError(
            f"{path}: the channel map names a column for the time, '{request.time.name}', but {form.name} has the time "
            "in its messages. Leave that line out."
        )
    try:
        return form.read(head, request)
    except LogError:
        raise
    except ImportError as error:
        if not form.library:
            raise
        raise LogError(f"{path}: {form.name} needs {form.library}: {how_to_install('logs')}.") from error
    except Exception as error:
        # Libraries that parse binary files meet a broken one with whatever the first wrong byte leads to:
        # struct.error, IndexError, AssertionError, MemoryError, and errors of their own.
        if not form.library:
            raise
        told = str(error).strip() or type(error).__name__
        raise LogError(f"{path}: a broken {form.name} file ({told[:300]}). Copy the log again.") from error


def _unknown(head: Head) -> LogError:
    """Say what a file without a known format holds, and how a table among them can be read."""
    columns = head.text.columns
    if not columns:
        return LogError(f"got binary content; {expected()}.")
    if head.time is not None:
        return LogError(f"the channel map takes time from '{head.time.name}', which is not among {listed(columns)}.")
    values = first_numbers(head.start, head.text) if len(columns) > 1 else {}
    if not head.text.named:
        return without_names("a table", values)
    told = not_called_time(values)
    if told is not None:
        return told
    return LogError(f"got the header '{head.text.separator.join(columns)[:120]}'; {expected()}.")


def expected() -> str:
    """All that a log may be, for messages."""
    others = [
        f"{form.name} ({', '.join(form.suffixes)})" for form in FORMATS if form.library and form.name not in EXPECTED
    ]
    return f"{EXPECTED}; or one of: {', '.join(others)}" if others else EXPECTED
