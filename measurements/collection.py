"""Which logs are meant: files, bags, folders of logs, and patterns such as `logs/*.bin`, as one data set."""

import glob
import os
from collections.abc import Sequence
from pathlib import Path

from ..physics.errors import LogError
from .channels.mapping import some
from .formats.base import read_head
from .formats.registry import expected, format_of

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
    """Whether a word looks like a pattern of files; brackets alone do not, for an effect may have them."""
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
    """Whether a format recognises it; not for a pipe, a broken link, or a folder that cannot be looked into."""
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
