"""What every log reader gives: streams of stamped numbers, named as the file names them."""

import gzip
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...physics.errors import LogError
from ...physics.frames import Array

TIME_COLUMNS = ("t", "time", "timestamp_ns")
EXPECTED = (
    "expected a CSV or Parquet table with the header 'time,topic,field,value' (or timestamp_ns for time), "
    "or one row per time stamp with a column 't' or 'time' [s] or 'timestamp_ns'"
)

_HEAD_BYTES = 65536


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """One field of one topic (long tables) or one column (wide tables), as written in the file.

    Attributes
    ----------
    topic : empty in a wide table
    field : the field or column name
    time : (n,) [s]
    value : (n,) in the file's own unit; NaN where the file holds no number
    row : (n,) line in the file, for messages
    """

    topic: str
    field: str
    time: Array
    value: Array
    row: NDArray[np.int64]

    @property
    def name(self) -> str:
        """The name that a channel map uses: `topic:field`, or the column."""
        return f"{self.topic}:{self.field}" if self.topic else self.field


@dataclass(frozen=True, slots=True)
class Recording:
    """Everything that a reader found in a file, in the order of the file, and what it had to assume."""

    streams: tuple[Stream, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Head:
    """The first look at a file, from which the format is told.

    Attributes
    ----------
    path : the file
    magic : its first four bytes
    gzipped : whether the content is gzip, whatever the file's name
    separator : the column separator of a text table
    columns : the stripped column names of a text table, empty when the file is not text
    """

    path: Path
    magic: bytes
    gzipped: bool
    separator: str
    columns: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Format:
    """One log format: its name, how it is recognised, and how it is read."""

    name: str
    matches: Callable[[Head], bool]
    read: Callable[[Head], Recording]


def read_head(path: Path) -> Head:
    """Look at the first bytes of `path`.

    Raises
    ------
    LogError
        when the file is missing, empty, or a broken gzip file.
    """
    if not path.exists():
        raise LogError(f"{path}: no such file; expected a log (CSV, CSV.gz or Parquet). Check the path.")
    if not path.is_file():
        raise LogError(f"{path}: expected a log file, got a folder. Name the file inside it.")
    with path.open("rb") as file:
        raw = file.read(_HEAD_BYTES)
    gzipped = raw[:2] == b"\x1f\x8b"
    content = raw
    if gzipped:
        try:
            with gzip.open(path, "rb") as file:
                content = file.read(_HEAD_BYTES)
        except (OSError, EOFError, zlib.error) as error:
            raise LogError(f"{path}: a broken gzip file ({error}). Copy the log again.") from error
    if not content.strip():
        raise LogError(f"{path}: the file is empty; {EXPECTED}.")
    separator, columns = _header(content)
    return Head(path, raw[:4], gzipped, separator, columns)


def _header(content: bytes) -> tuple[str, tuple[str, ...]]:
    line = content.split(b"\n", 1)[0]
    try:
        text = line.decode("utf-8-sig").strip("\r")
    except UnicodeDecodeError:
        return ",", ()
    if not text.replace("\t", " ").isprintable():
        return ",", ()
    separator = max((",", ";", "\t"), key=text.count)
    return separator, tuple(name.strip().strip('"').strip() for name in text.split(separator))
