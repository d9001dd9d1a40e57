"""All log formats: every `Format` that a file of this folder or of its folders holds; and the one door to a log.

Folders and patterns become the logs in them; digests identify a log.
"""

import glob
import hashlib
import os
from collections.abc import Sequence
from pathlib import Path

from ...physics.errors import LogError, listed
from ...physics.reading import BLOCK
from ...physics.registry_members import how_to_install, objects_in
from .. import formats
from .base import EXPECTED, Format, Head, Recording, Request, first_numbers, in_file, read_head, some
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


_PATTERN = frozenset("*?[")
_LISTED = 8
"""Names of files that a message tells: two lines."""


def find_logs(names: Sequence[str | os.PathLike[str]]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Replace folders and patterns by the logs in them, sorted by name.

    A folder that is itself a log (a ROS 2 bag) stays one. Of any other folder, each file or bag directly in it that a
    format recognises is a log; what is none, or cannot be opened, is told in a note, and hidden files are passed over.

    Parameters
    ----------
    names : of files, folders or patterns (`*`, `?`, `[...]`, and `**` for folders in folders, which follows no links);
        a file that has such a name is that file

    Returns
    -------
    (paths, notes)

    Raises
    ------
    LogError
        when a folder holds no log, or a pattern meets nothing. A file that is missing is left for its reader to say.
    """
    paths: list[str] = []
    notes: list[str] = []
    for given in names:
        name = os.fspath(given)
        if os.path.isdir(name):
            found, others = _in_folder(Path(name))
            paths += found
            if others:
                notes.append(f"{name}: {len(found)} logs; not logs, and not read: {some(others, _LISTED)}")
        elif not os.path.exists(name) and _PATTERN & set(name):
            found = sorted(match for match in _matches(name) if os.path.isfile(match) or _is_log(Path(match)))
            if not found:
                raise LogError(f"{name}: no file or bag meets this pattern; check the folder and the ending.")
            paths += found
        else:
            paths.append(name)
    return tuple(paths), tuple(notes)


def is_pattern(name: str) -> bool:
    """True when a word looks like a pattern of files; brackets alone do not, for an effect may have them."""
    return bool(set("*?") & set(name))


def _in_folder(folder: Path) -> tuple[list[str], list[str]]:
    """Logs in a folder, or the folder itself where it is one, and the names of its other files."""
    if format_of(read_head(folder)) is not None:
        return [str(folder)], []
    found, others = [], []
    for entry in sorted(folder.iterdir()):
        if entry.name.startswith("."):
            continue
        if _is_log(entry):
            found.append(str(entry))
        elif not entry.is_dir() or not os.access(entry, os.R_OK | os.X_OK):
            others.append(entry.name)
    if not found:
        held = f"{len(others)} files, none of them a log: {some(others, _LISTED)}" if others else "no file"
        raise LogError(f"{folder}: expected a folder of logs, got {held}; {expected()}.")
    return found, others


def _is_log(path: Path) -> bool:
    """True when a format recognises it; not for a pipe, a broken link, or a folder that cannot be looked into."""
    try:
        return (path.is_file() or path.is_dir()) and format_of(read_head(path)) is not None
    except LogError:
        # Of a broken gzip file, or one without permission, its reader says so, better than leaving it out unheard.
        return path.is_file()


def _matches(pattern: str) -> set[str]:
    """What meets a pattern; glob's own `**` follows links, and two that lead back keep it busy for ever."""
    parts = Path(pattern).parts
    if "**" not in parts:
        return set(glob.glob(pattern))
    at = parts.index("**")
    rest = parts[at + 1 :] or ("*",)
    found: set[str] = set()
    for base in glob.glob(os.path.join(*parts[:at])) if at else [os.curdir]:
        for folder, inner, _ in os.walk(base):
            inner[:] = [name for name in inner if not name.startswith(".")]
            found |= _matches(os.path.join(glob.escape(folder), *rest))
    return found if at else {os.path.normpath(name) for name in found}


def log_digests(paths: Sequence[str]) -> list[dict[str, str | None]]:
    """SHA-256 of each log as it is on disk now; of a folder, over the names and contents of the files in it.

    A log that is no longer there has null.
    """
    return [{"path": path, "sha256": _digest(Path(path))} for path in paths]


def _digest(path: Path) -> str | None:
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    digest = hashlib.sha256()
    try:
        for file in files:
            if path.is_dir():
                digest.update(f"{file.relative_to(path).as_posix()}\0{file.stat().st_size}\0".encode())
            with file.open("rb") as stream:
                while chunk := stream.read(BLOCK):
                    digest.update(chunk)
    except OSError:
        return None
    return digest.hexdigest()
