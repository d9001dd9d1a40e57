"""The table of all log formats; a new format is one reader file and one entry here."""

from pathlib import Path

from ...physics.errors import LogError
from .autopilots.dataflash import DATAFLASH
from .autopilots.dataflash_text import DATAFLASH_TEXT
from .autopilots.telemetry import TELEMETRY
from .autopilots.ulog import ULOG
from .base import EXPECTED, Format, Head, Recording, Request, read_head
from .ros.mcap import MCAP
from .ros.ros1_bag import ROS1_BAG
from .ros.ros2_bag import ROS2_BAG
from .tables.long_csv import LONG_CSV
from .tables.matlab import MATLAB
from .tables.parquet import PARQUET
from .tables.wide_csv import WIDE_CSV

FORMATS: tuple[Format, ...] = (
    PARQUET,
    ROS1_BAG,
    ROS2_BAG,
    MCAP,
    DATAFLASH,
    DATAFLASH_TEXT,
    ULOG,
    MATLAB,
    TELEMETRY,
    LONG_CSV,
    WIDE_CSV,
)
"""Asked in this order; those with a mark of their own first, tables last."""

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
    head = read_head(path)
    if head.entries is None and not head.start.strip():
        raise LogError(f"{path}: the file is empty; {expected()}.")
    form = format_of(head)
    if form is None and head.entries is not None:
        there = f", one of {', '.join(head.entries[:8])}" if head.entries else ""
        raise LogError(f"{path}: expected a log file, got a folder. Name the file inside it{there}.")
    if form is None:
        came = f"the header '{head.separator.join(head.columns)[:120]}'" if head.columns else "binary content"
        raise LogError(f"{path}: got {came}; {expected()}.")
    try:
        return form.read(head, request or Request())
    except LogError:
        raise
    except ImportError as error:
        if not form.library:
            raise
        raise LogError(f"{path}: {form.name} needs {form.library}; run pip install 'undertow[logs]'.") from error
    except Exception as error:
        # Libraries that parse binary files meet a broken one with whatever the first wrong byte leads to:
        # struct.error, IndexError, AssertionError, MemoryError, and errors of their own.
        if not form.library:
            raise
        told = str(error).strip() or type(error).__name__
        raise LogError(f"{path}: a broken {form.name} file ({told[:300]}). Copy the log again.") from error


def expected() -> str:
    """All that a log may be, for messages."""
    others = [f"{form.name} ({', '.join(form.suffixes)})" for form in FORMATS if form.library and form is not PARQUET]
    return f"{EXPECTED}; or one of: {', '.join(others)}" if others else EXPECTED
