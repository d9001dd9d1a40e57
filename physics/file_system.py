"""What a file system can do with two folders: change their names, link, compare and lock what is in them."""

import ctypes
import filecmp
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import RequestError
from .files import lock

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
    """Whether something is, or holds, what is neither file, folder nor link: pipes, sockets, other disks."""
    if path.is_symlink() or path.is_file():
        return False
    if not path.is_dir() or os.path.ismount(path):
        return True
    return any(cannot_link(inner) for inner in path.iterdir())


def same(one: Path, other: Path) -> bool:
    """Whether two files, or all files of two folders, hold the same."""
    if one.is_symlink() or other.is_symlink():
        return one.is_symlink() and other.is_symlink() and os.readlink(one) == os.readlink(other)
    if one.is_dir():
        return other.is_dir() and all(same(inner, other / inner.name) for inner in one.iterdir())
    return one.is_file() and other.is_file() and (one.samefile(other) or filecmp.cmp(one, other, shallow=False))


def take_away(path: Path) -> None:
    """Remove a file, a link, or a folder with all that is in it."""
    shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)


@contextmanager
def at_rest(place: Path) -> Iterator[None]:
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
    """Which folder bears a name now; None where there is none."""
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
