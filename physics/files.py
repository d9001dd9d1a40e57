"""Files appear whole or not at all: written to a temporary name beside the target, then renamed."""

import json
import math
import os
import re
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import yaml

from .printable import escaped_json, printable

LEFT = ".undertow-"
"""What the name of everything unfinished has in it: `.NAME.undertow-` and eight letters beside NAME."""
_LONGEST = 200
"""Bytes of a name that its unfinished neighbours bear: a name has at most 255."""
_STREAM = re.compile(r"/dev/(?:std(?P<name>in|out|err)|fd/(?P<number>\d+))|/proc/self/fd/(?P<proc>\d+)")
_NAMED = {"in": 0, "out": 1, "err": 2}
"""Numbers of the standard streams (POSIX, unistd.h)."""
_TRIED = 1 << 16
"""Bytes that are written to see whether a file can be [B]: those of a page, and more than what a full disk has."""


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write UTF-8 text as `write_bytes` does."""
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> Path:
    """Write bytes as `writing` does."""
    with writing(path) as stream:
        stream.write(data)
    return Path(path)


@contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A stream of bytes that become a file atomically (temporary name, then rename); the folder must exist.

    A link stays a link: the file that it leads to is replaced. A device or a stream such as /dev/stdout, where nothing
    can be renamed, is written to directly. What a killed process left unfinished beside the file goes.

    Raises
    ------
    OSError
        when the folder is missing or not writable; the target is then untouched.
    """
    target = Path(path)
    with _blaming(target):
        handle = stream_of(target)
        if handle is not None or is_device(target):
            with os.fdopen(os.dup(handle), "wb") if handle is not None else target.open("wb") as stream:
                yield stream
            return
        place = real(target)
        clear_left(place)
        with _unfinished(place) as (stream, temporary):
            yield stream
            stream.flush()
            os.fsync(stream.fileno())  # or a full disk may be noticed after the rename
            _keep_mode(place, temporary)
            os.replace(temporary, place)


def try_out(path: str | os.PathLike[str], size: int = _TRIED) -> None:
    """Write `size` bytes beside a file, and take it away again: what fails now does not fail after the work.

    Raises
    ------
    OSError
        when the file cannot be written: no such folder, no permission, no space, or a limit of the system.
    """
    target = Path(path)
    with _blaming(target):
        handle = stream_of(target)
        if handle is not None or is_device(target):
            _try_device(target, handle)
            return
        clear_left(real(target))
        with _unfinished(real(target)) as (stream, _):
            stream.write(bytes(size))
            stream.flush()
            os.fsync(stream.fileno())


def real(path: Path) -> Path:
    """Where a path leads to, through all links; the last of them may lead to nothing."""
    return Path(os.path.realpath(path))


def stream_of(path: Path) -> int | None:
    """The open stream that a name such as /dev/stdout stands for; None for every other name."""
    found = _STREAM.fullmatch(os.path.abspath(path))
    if found is None:
        return None
    return _NAMED[found["name"]] if found["name"] else int(found["number"] or found["proc"])


def is_device(path: Path) -> bool:
    """Whether there is a device, which is written to and never replaced."""
    try:
        return stat.S_ISCHR(path.stat().st_mode)
    except OSError:
        return False


def clear_left(place: Path) -> None:
    """Take away the files that killed processes left unfinished beside a file; those of living ones are locked."""
    for path in left_beside(place):
        if path.is_file() and not path.is_symlink():
            with suppress(OSError), path.open("rb") as stream:
                if lock(stream.fileno()):
                    path.unlink(missing_ok=True)


def lock(handle: int, *, wait: bool = False) -> bool | None:
    """Lock an open file or folder until it is closed; False where another has it, None where no locks are kept."""
    try:
        import fcntl
    except ImportError:  # a system without them never takes anything away
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def name_unfinished(place: Path) -> Path:
    """A new name beside a path, for what is not finished."""
    return place.with_name(f"{_stem(place)}{secrets.token_hex(4)}")


def left_beside(place: Path) -> list[Path]:
    """What was or is still written beside a path, and is not finished."""
    pattern = re.compile(re.escape(_stem(place)) + "[0-9a-f]{8}")
    try:
        return sorted(path for path in place.parent.iterdir() if pattern.fullmatch(path.name))
    except OSError:
        return []


def _stem(place: Path) -> str:
    return f".{os.fsdecode(os.fsencode(place.name)[:_LONGEST])}{LEFT}"


@contextmanager
def _unfinished(place: Path) -> Iterator[tuple[BinaryIO, Path]]:
    """A locked file beside `place`, gone at the end whatever happens, unless it was renamed."""
    temporary = None
    try:  # around the making of it, too: an interruption may come in any line
        while True:
            temporary = name_unfinished(place)
            handle = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_RDWR | getattr(os, "O_BINARY", 0), 0o666)
            stream = os.fdopen(handle, "wb")
            lock(handle, wait=True)
            if os.fstat(handle).st_nlink:  # else another process took it for left over, in the instant before the lock
                break
            stream.close()
        with stream:
            yield stream, temporary
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _keep_mode(place: Path, temporary: Path) -> None:
    with suppress(OSError):  # a new file has the mode that the user's mask gives it
        os.chmod(temporary, stat.S_IMODE(place.stat().st_mode))


def _try_device(target: Path, handle: int | None) -> None:
    """Devices such as /dev/full refuse a single byte; a terminal or a pipe would show it."""
    held = os.dup(handle) if handle is not None else os.open(target, os.O_WRONLY | getattr(os, "O_NOCTTY", 0))
    try:
        if stat.S_ISCHR(os.fstat(held).st_mode) and not os.isatty(held):
            os.write(held, b"\n")
    finally:
        os.close(held)


@contextmanager
def _blaming(target: Path) -> Iterator[None]:
    """Say of every failure which file was to be written, not which temporary name."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(target)) from error


def write_json(path: str | os.PathLike[str], data: Any) -> Path:
    """Write strict JSON: no NaN or Infinity (such a number becomes null), nine significant digits, order as given."""
    return write_text(path, strict_json(data) + "\n")


def strict_json(data: Any, indent: int | None = 1) -> str:
    """Strict JSON text of plain data; floats have nine significant digits, so that equal inputs give equal bytes.

    Letters of all scripts stand as they are; what a terminal obeys or UTF-8 lacks stands as JSON's escapes. Without an
    indent it is one line.
    """
    return escaped_json(json.dumps(_plain(data), allow_nan=False, indent=indent, ensure_ascii=False))


def yaml_text(data: Any, **how: Any) -> str:
    """YAML text of plain data, in the order given; letters of all scripts stand as they are, see `strict_json`."""
    text: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, **how)
    if printable(text) == text:
        return text
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=False, **how)


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_plain(value) for value in data]
    if isinstance(data, (bool, int, str)) or data is None:
        return data
    number = float(data)
    return float(f"{number:.9g}") if math.isfinite(number) else None
