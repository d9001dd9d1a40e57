"""Folders replaced as a whole by one rename, so that a reader finds the old one or the new one, and never a part."""

import ctypes
import errno
import filecmp
import json
import os
import re
import secrets
import shutil
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import RequestError
from .files import LEFT, lock, name_unfinished, real, try_out, unfinished_files, write_text
from .reading import read_json

_EXCHANGE = 2
"""RENAME_EXCHANGE of linux/fs.h."""
_HERE = -100
"""AT_FDCWD of fcntl.h: paths are those of the working folder."""
_PATIENCE = 20.0
"""Time after which a locked folder is given up [s]: two folders change names in milliseconds, on any disk."""
_PAUSE = 0.01
"""Time between two looks at a locked folder [s]: nobody notices it, and it costs no processor time."""


def exchange(one: Path, other: Path) -> bool:
    """Let two folders change names in one step; False where the system cannot."""
    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, TypeError, AttributeError):  # no C library as on Linux, or an old one
        return False
    return call(_HERE, os.fsencode(one), _HERE, os.fsencode(other), _EXCHANGE) == 0


def link(source: Path, target: Path) -> None:
    """Have a file or a folder of files in two places, linked or else copied."""
    if source.is_symlink():
        os.symlink(os.readlink(source), target)
    elif source.is_dir():
        shutil.copytree(source, target, symlinks=True, copy_function=_link_file)
    else:
        _link_file(source, target)


def _link_file(source: str | Path, target: str | Path) -> None:
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:
        shutil.copy2(source, target, follow_symlinks=False)


def cannot_link(path: Path) -> bool:
    """True when something is, or holds, what is neither file, folder nor link: pipes, sockets, other disks."""
    if path.is_symlink() or path.is_file():
        return False
    if not path.is_dir() or os.path.ismount(path):
        return True
    return any(cannot_link(inner) for inner in path.iterdir())


def same(one: Path, other: Path) -> bool:
    """True when two files, or all files of two folders, hold the same."""
    if one.is_symlink() or other.is_symlink():
        return one.is_symlink() and other.is_symlink() and os.readlink(one) == os.readlink(other)
    if one.is_dir():
        return other.is_dir() and all(same(inner, other / inner.name) for inner in one.iterdir())
    return one.is_file() and other.is_file() and (one.samefile(other) or filecmp.cmp(one, other, shallow=False))


def remove(path: Path) -> None:
    """Remove a file, a link, or a folder with all that is in it."""
    shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)


@contextmanager
def lock_settled(place: Path) -> Iterator[None]:
    """Lock the folder that bears this name, once others that replace it are done.

    Raises
    ------
    RequestError
        when one is at work there for long, as a training is.
    """
    until = time.monotonic() + _PATIENCE
    while True:
        before = identity(place)
        with locked(place) as free:
            if free is not False and identity(place) == before:  # else it was replaced before it was locked
                yield
                return
        if time.monotonic() > until:
            raise RequestError(f"another process is at work in {place}; wait until it is done, or give another folder")
        time.sleep(_PAUSE)


def identity(place: Path) -> tuple[int, int] | None:
    """The folder that bears a name now; None where there is none."""
    try:
        found = place.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


@contextmanager
def locked(folder: Path, *, wait: bool = False) -> Iterator[bool | None]:
    """Lock a file or folder; False where another process has it, None where it cannot be locked."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # gone, or a system that opens no folders
        yield None
        return
    try:
        yield lock(handle, wait=wait)
    finally:
        os.close(handle)


Own = Callable[[Path], Collection[str]]
"""Names of the files in a folder that undertow certainly wrote and nobody changed: these alone may go."""
_UNFINISHED = ".undertow-unfinished"
"""File in a new folder until it is complete: whatever has it holds nothing that is not elsewhere."""
_COMMIT = f"{LEFT}commit"
"""Complete new files in a folder that cannot be renamed: they are moved to their places, now or by the next call."""
_STALE = ".undertow-stale"
"""List of the names that go: from the folder when the files of `_COMMIT` are in place, or from an old folder."""
_LEFT = re.compile(r"(\..+)?\.undertow-([0-9a-f]{8}|commit|unfinished|stale)")
"""Names that are not somebody's, but what a process left or is at work on."""
_LISTED = 4
"""Names that a message tells before it counts the rest: they fit on a line."""
_TRIED = 1 << 20
"""Bytes that are written to see whether a folder can be [B]: those of a run of a few minutes."""


def foreign_entries(target: Path, new: Collection[str], own: Own, *, force: bool = False) -> list[str]:
    """Names of the files and folders in a folder that are not undertow's, and stay in it when it is replaced.

    Parameters
    ----------
    new : names that will be written
    force : whether others' files of these names, and a folder in which nothing is undertow's, may be written over

    Raises
    ------
    RequestError
        when something of another's would be lost, or the folder is another's.
    """
    if not target.is_dir():
        return []
    names = [path.name for path in target.iterdir() if not _is_unfinished(path.name)]
    mine = set(own(target))
    others = sorted(set(names) - mine)
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
    return [name for name in others if name not in new]


def check_folder(target: Path, new: Collection[str], own: Own, *, force: bool = False) -> None:
    """Put right what a killed process left, and check that a folder can be written and nothing of another's be lost.

    A folder is made beside it, with a file in it, and taken away again: what fails now does not fail after the work.

    Parameters
    ----------
    new, own, force : see `carried`

    Raises
    ------
    RequestError
        see `carried`.
    OSError
        when the folder cannot be written.
    """
    place = real(target)
    recover(place, own)
    with lock_settled(place):
        foreign_entries(target, new, own, force=force)
    if place.exists() and not place.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, "it is a file", str(target))
    if _stays(place):
        try_out(place / "file", _TRIED)
        return
    with _staged(place) as work:
        try_out(work / "file", _TRIED)


def replace_folder(target: Path, build: Callable[[Path], Collection[str]], own: Own, *, force: bool = False) -> None:
    """Write a folder whole, in the place of an earlier one; what others put there stays.

    The new folder is built beside the old one. Others' files are linked into it, or copied where nothing can be linked,
    and the two folders change names in one step (`renameat2` with RENAME_EXCHANGE). A process that is killed leaves the
    old folder or the new one, and beside it a hidden folder that the next call takes away. Of two processes the one
    that is done last wins; each leaves a whole folder.

    A folder that cannot be renamed (a mount, the working folder, no permission beside it, a file system without the
    exchange), or is another's and was forced, gets its files one by one, out of a complete set within it; a process
    that is killed between two of them leaves that set to the next call, see `finish`.

    Parameters
    ----------
    target : the folder; of a link, what it leads to
    build : writes the new files into an empty folder, and gives back their names; it may link files of the old folder
        there, which then stay as they are
    own, force : see `carried`

    Raises
    ------
    RequestError
        when something of another's would be lost; nothing is changed then.
    OSError
        when the folder cannot be written; nothing is changed then.
    """
    place = real(target)
    recover(place, own)
    with _staged(place) as work:
        new = {name for name in build(work) if name != _UNFINISHED}
        theirs = place.is_dir() and any(place.iterdir()) and not own(place)
        if not theirs and not _stays(place) and _exchanged(work, place, new, own, force):
            return
        place.mkdir(exist_ok=True)
        with lock_settled(place):
            others = foreign_entries(place, new, own, force=force)
            there = {path.name for path in place.iterdir() if not _is_unfinished(path.name)}
            _move_in(work, place, sorted(there - {*others, *new, *(path.name for path in work.iterdir())}))


def recover(target: Path, own: Own) -> None:
    """Finish or take away what a killed process left in and beside a folder; what a living one has is left alone."""
    place = real(target)
    finish_move(place)
    for path in unfinished_files(place):
        with suppress(OSError), locked(path) as free:
            if free and not path.is_symlink():
                remove(path) if (path / _UNFINISHED).is_file() else _retire(path, place, own)


def finish_move(target: Path) -> None:
    """Move into a folder what a killed process had completed but not moved; nothing where there is nothing."""
    place = real(target)
    with suppress(OSError):
        inside = [p for p in place.iterdir() if _is_unfinished(p.name) and p.name not in (_UNFINISHED, _STALE)]
        for path in inside:
            with locked(path) as free:
                if free and (path.is_file() or (path / _UNFINISHED).is_file()):
                    remove(path)
                elif free and path.name == _COMMIT:
                    _roll_forward(place)


@contextmanager
def hold_folder(folder: Path, what: str) -> Iterator[None]:
    """Keep a folder to this process while it works in it.

    Raises
    ------
    RequestError
        when another process has it.
    """
    with locked(folder) as free:
        if free is False:
            raise RequestError(f"another process {what} {folder}; wait until it is done, or give another folder")
        yield


def _exchanged(work: Path, place: Path, new: Collection[str], own: Own, force: bool) -> bool:
    """Put the complete folder `work` in the place of another; False where the system cannot."""
    while not place.exists() or not any(place.iterdir()):
        if place.exists():
            shutil.copymode(place, work)
        (work / _UNFINISHED).unlink()
        try:
            os.rename(work, place)  # onto nothing, or an empty folder
            return True
        except OSError as error:
            (work / _UNFINISHED).touch()
            if error.errno not in (errno.EEXIST, errno.ENOTEMPTY):  # else another process was faster
                if place.exists():
                    return False
                raise
    with lock_settled(place):  # nobody takes the old one for left over while it is looked through
        others = foreign_entries(place, new, own, force=force)
        if any(cannot_link(place / name) for name in others):
            return False
        others = [name for name in others if not os.path.lexists(work / name)]
        for name in others:
            link(place / name, work / name)
        shutil.copymode(place, work)
        (work / _UNFINISHED).unlink()
        if exchange(work, place):
            with suppress(OSError):  # the new one is in its place; the next call takes up what is left of the old one
                _retire(work, place, own, new if force else ())
            return True
        (work / _UNFINISHED).touch()
        for name in others:
            remove(work / name)
    return False


def _retire(old: Path, place: Path, own: Own, given_up: Collection[str] = ()) -> None:
    """Take away a folder that another took the place of, but nothing of another's that is not in that, too."""
    mine = {*own(old), *given_up, *_stale(old)}
    write_text(old / _STALE, json.dumps(sorted(mine)))  # own() may know nothing more when half of the files are gone
    for path in sorted(old.iterdir(), key=lambda path: (path.name == _STALE, path.name)):
        there = place / path.name
        if path.name not in mine and not _is_unfinished(path.name) and not os.path.lexists(there):
            os.rename(path, there)  # it came while the folders changed names
        elif path.name in mine or _is_unfinished(path.name) or same(path, there):
            remove(path)
    with suppress(OSError):  # what is left is somebody's, and stays
        old.rmdir()


def _move_in(work: Path, place: Path, stale: list[str]) -> None:
    """Complete the new files under one name, then move them into their places."""
    write_text(work / _STALE, json.dumps(stale))
    commit = place / _COMMIT
    try:
        os.rename(work, commit)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        commit.mkdir()  # a folder from elsewhere that is mounted here, which nothing shows before
        (commit / _UNFINISHED).touch()
        for path in work.iterdir():
            shutil.copy2(path, commit / path.name)
    (commit / _UNFINISHED).unlink()
    _roll_forward(place)


def _roll_forward(place: Path) -> None:
    """Do what is left to do; begun anew after a kill, it ends the same."""
    commit = place / _COMMIT
    for path in sorted(commit.iterdir()):
        if path.name != _STALE:
            os.replace(path, place / path.name)
            path.unlink(missing_ok=True)  # of two links to one file, the system leaves both
    for name in _stale(commit):
        (place / name).unlink(missing_ok=True)
    (commit / _STALE).unlink(missing_ok=True)
    commit.rmdir()


def _stale(folder: Path) -> list[str]:
    """Names that are known to be of no more use, where such a list is."""
    try:
        return [str(name) for name in read_json(folder / _STALE)]
    except FileNotFoundError:
        return []


@contextmanager
def _staged(place: Path) -> Iterator[Path]:
    """A locked, unfinished folder, gone at the end whatever happens, unless it was renamed."""
    inside = _stays(place)
    while True:
        work = place / f"{LEFT}{secrets.token_hex(4)}" if inside else name_unfinished(place)
        work.mkdir()
        with suppress(FileNotFoundError):
            (work / _UNFINISHED).touch()
        with locked(work, wait=True):
            if not (work / _UNFINISHED).is_file():  # taken for left over in the instant before the lock
                continue
            try:
                yield work
            finally:
                if (work / _UNFINISHED).is_file():
                    shutil.rmtree(work, ignore_errors=True)
            return


def _stays(place: Path) -> bool:
    """True when a folder must stay where it is: a mount, the working folder, or in a folder that cannot be written."""
    if not place.is_dir():
        return False
    try:
        here = Path(os.getcwd())
    except FileNotFoundError:
        here = place.parent
    return os.path.ismount(place) or here.is_relative_to(place) or not os.access(place.parent, os.W_OK | os.X_OK)


def _is_unfinished(name: str) -> bool:
    return _LEFT.fullmatch(name) is not None


def _some(names: Collection[str]) -> str:
    told = sorted(names)
    return ", ".join(told[:_LISTED]) + (f" and {len(told) - _LISTED} more" if len(told) > _LISTED else "")
