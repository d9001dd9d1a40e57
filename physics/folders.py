"""Folders replaced as a whole: the new files are completed under a hidden name, and only then take their places.

A folder that is new appears by one rename. In one that is there, the complete set is called `.undertow-commit`; its
files are moved out of it one by one, and a process that is killed meanwhile leaves the rest to the next call that
reads or writes the folder. What others put there is never moved.
"""

import errno
import json
import os
import re
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import RequestError
from .files import LEFT, locked, real, remove_unfinished, try_out, unfinished, write_text
from .reading import read_json

Own = Callable[[Path], Collection[str]]
"""Names of the files in a folder that undertow certainly wrote and nobody changed: these alone may go."""
_COMMIT = f"{LEFT}commit"
"""Complete new files in a folder: they are moved to their places, now or by the next call."""
_STALE = f"{LEFT}stale"
"""List in it of the names that go from the folder when its files are in place."""
_INSIDE = "folder"
"""What a folder is called that is prepared in another."""
_HIDDEN = re.compile(r"(\..+)?\.undertow-([0-9a-f]{8}|commit|unfinished|stale)")
"""Names that are not somebody's, but what a process left or is at work on."""
_LISTED = 4
"""Names that a message tells before it counts the rest: they fit on a line."""
_TRIED = 1 << 20
"""Bytes that are written to see whether a folder can be [B]: those of a run of a few minutes."""
PATIENCE = 20.0
"""Time after which a locked folder is given up [s]: files change their places in milliseconds, on any disk."""
_PAUSE = 0.01
"""Time between two looks at a locked folder [s]: nobody notices it, and it costs no processor time."""


def check_folder(target: Path, new: Collection[str], own: Own, *, force: bool = False) -> None:
    """Put right what a killed process left, and check that a folder can be written and nothing of another's be lost.

    A file is written within it, or beside it where it is not there, and taken away again: what fails now does not fail
    after the work.

    Parameters
    ----------
    target : the folder
    new : names of the files that will be written
    own : tells which files are undertow's
    force : whether others' files of these names, and a folder in which nothing is undertow's, may be written over

    Raises
    ------
    RequestError
        when something of another's would be lost, or the folder is another's.
    OSError
        when the folder cannot be written.
    """
    recover(target)
    place = real(target)
    if place.exists() and not place.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, "it is a file", str(target))
    with hold_folder(place, patience=PATIENCE):
        _check_others(target, new, own, force=force)
    with unfinished(_within(place), Path.mkdir) as work:
        try_out(work / "file", _TRIED)


def replace_folder(target: Path, build: Callable[[Path], Collection[str]], own: Own, *, force: bool = False) -> None:
    """Write a folder whole, in the place of an earlier one; what others put there stays.

    Of two processes the one that is done last wins; each leaves a whole folder.

    Parameters
    ----------
    target : the folder; of a link, what it leads to
    build : writes the new files into an empty folder, and gives back their names; it may link files of the old folder
        there, which then stay as they are
    own, force : see `check_folder`

    Raises
    ------
    RequestError
        when something of another's would be lost; nothing is changed then.
    OSError
        when the folder cannot be written; nothing is changed then.
    """
    recover(target)
    place = real(target)
    with unfinished(_within(place), Path.mkdir) as work:
        new = build(work)
        if not place.is_dir() and _renamed(work, place):
            return
        with hold_folder(place, patience=PATIENCE):
            _roll_forward(place)
            mine = _check_others(place, new, own, force=force)
            write_text(work / _STALE, json.dumps(sorted(mine.difference(os.listdir(work)))))
            os.rename(work, place / _COMMIT)
            _roll_forward(place)


def recover(target: Path) -> None:
    """Finish or take away what a killed process left in and beside a folder; what a living one has is left alone."""
    place = real(target)
    finish_move(place)
    remove_unfinished(place)
    remove_unfinished(place / _INSIDE)


def finish_move(target: Path) -> None:
    """Move into a folder what a killed process had completed but not moved; nothing where there is nothing."""
    place = real(target)
    if (place / _COMMIT).is_dir():
        with suppress(OSError), locked(place) as free:
            if free:
                _roll_forward(place)


@contextmanager
def hold_folder(folder: Path, what: str = "is at work in", *, patience: float = 0.0) -> Iterator[None]:
    """Keep a folder to this process while it works in it.

    Parameters
    ----------
    what : this process does in it, for the message of another that wants it
    patience : time for which another process is waited for [s]

    Raises
    ------
    RequestError
        when another process has it.
    """
    until = time.monotonic() + patience
    while True:
        with locked(folder) as free:
            if free is not False:
                yield
                return
        if time.monotonic() >= until:
            raise RequestError(f"another process {what} {folder}; wait until it is done, or give another folder")
        time.sleep(_PAUSE)


def _check_others(target: Path, new: Collection[str], own: Own, *, force: bool) -> set[str]:
    """Refuse to write over what is not undertow's; give back the names of what is."""
    if not target.is_dir():
        return set()
    names = {path.name for path in target.iterdir() if not _HIDDEN.fullmatch(path.name)}
    mine = names.intersection(own(target))
    others = sorted(names - mine)
    lost = [name for name in others if name in new]
    folders = [name for name in lost if (target / name).is_dir()]
    if others and not mine and not force:
        raise RequestError(
            f"cannot write {target}: the folder holds other files ({_some(others)}) and nothing that this verb wrote; "
            f"give a new one, or --force to write beside them{f' and over {_some(lost)}' if lost else ''}"
        )
    if lost and not force:
        raise RequestError(
            f"cannot write {target}: it holds {_some(lost)}, which undertow did not write, or which was changed "
            "since; move it away, give another folder, or --force to replace it"
        )
    if folders:
        raise RequestError(
            f"cannot write {target}: it holds a folder {_some(folders)}, where a file is to be written; move it away"
        )
    return mine


def _renamed(work: Path, place: Path) -> bool:
    """Give a complete folder its name; False where another process was faster."""
    try:
        os.rename(work, place)
    except OSError:
        if place.is_dir():
            return False
        raise
    return True


def _roll_forward(place: Path) -> None:
    """Do what is left to do; begun anew after a kill, it ends the same."""
    commit = place / _COMMIT
    if not commit.is_dir():
        return
    for path in sorted(commit.iterdir()):
        if path.name != _STALE:
            os.replace(path, place / path.name)
            path.unlink(missing_ok=True)  # of two links to one file, the system leaves both
    if (commit / _STALE).is_file():
        for name in read_json(commit / _STALE):
            (place / os.path.basename(name)).unlink(missing_ok=True)
        (commit / _STALE).unlink()
    commit.rmdir()


def _within(place: Path) -> Path:
    """A path beside which a folder is prepared: one in the folder, or the folder itself where it is not there."""
    return place / _INSIDE if place.is_dir() else place


def _some(names: Collection[str]) -> str:
    told = sorted(names)
    return ", ".join(told[:_LISTED]) + (f" and {len(told) - _LISTED} more" if len(told) > _LISTED else "")
