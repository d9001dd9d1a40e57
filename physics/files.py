"""Files written whole or not at all (temporary name, then rename), and marks that say which verb wrote a file.

A mark is a verb and the SHA-256 of the rest of the file, in a remark on top (channel maps, vehicles, repaired logs), at
the end (pages, PDF), in the metadata (Parquet), or in the zeros after the first stamps of a simulated log. A file that
somebody edits is theirs: its mark is no longer true.
"""

import gzip
import hashlib
import json
import math
import os
import re
import secrets
import shutil
import stat
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import yaml

from .errors import escaped_json, printable
from .reading import BLOCK

LEFT = ".undertow-"
"""What the name of everything unfinished has in it: `.NAME.undertow-` and eight letters beside NAME."""
_LONGEST = 200
"""Bytes of a name that its unfinished neighbours bear: a name has at most 255."""
_STREAM = re.compile(r"/dev/(?:std(?P<name>in|out|err)|fd/(?P<number>\d+))|/proc/self/fd/(?P<proc>\d+)")
_NAMED = {"in": 0, "out": 1, "err": 2}
"""Numbers of the standard streams (POSIX, unistd.h)."""
_new_file = partial(Path.touch, exist_ok=False)
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
        with unfinished(place, _new_file) as temporary, temporary.open("wb") as stream:
            yield stream
            _flush(stream)  # or a full disk may be noticed after the rename
            with suppress(OSError):  # a new file has the mode that the user's mask gives it
                os.chmod(temporary, stat.S_IMODE(place.stat().st_mode))
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
        with unfinished(real(target), _new_file) as temporary, temporary.open("wb") as stream:
            stream.write(bytes(size))
            _flush(stream)


def real(path: Path) -> Path:
    """Resolve a path through all links; the last of them may lead to nothing."""
    return Path(os.path.realpath(path))


def stream_of(path: Path) -> int | None:
    """The open stream that a name such as /dev/stdout stands for; None for every other name."""
    found = _STREAM.fullmatch(os.path.abspath(path))
    if found is None:
        return None
    return _NAMED[found["name"]] if found["name"] else int(found["number"] or found["proc"])


def is_device(path: Path) -> bool:
    """True when there is a device, which is written to and never replaced."""
    with suppress(OSError):
        return stat.S_ISCHR(path.stat().st_mode)
    return False


@contextmanager
def unfinished(place: Path, make: Callable[[Path], object]) -> Iterator[Path]:
    """A locked new file or folder beside a path, gone at the end whatever happens, unless it was renamed.

    Parameters
    ----------
    place : beside which it is made
    make : makes a file or a folder of a name, where there is none
    """
    remove_unfinished(place)
    path = None
    try:  # around the making of it, too: an interruption may come in any line
        while True:
            path = place.with_name(f"{_stem(place)}{secrets.token_hex(4)}")
            make(path)
            with locked(path, wait=True):
                if path.exists():  # else another process took it for left over, in the instant before the lock
                    yield path
                    return
    finally:
        if path is not None:
            remove(path)


def remove_unfinished(place: Path) -> None:
    """Take away what killed processes left unfinished beside a path; what is of living ones is locked."""
    for path in unfinished_beside(place):
        with suppress(OSError), locked(path) as free:
            if free and not path.is_symlink():
                remove(path)


def unfinished_beside(place: Path) -> list[Path]:
    """Unfinished files and folders beside a path, of living and of killed processes."""
    pattern = re.compile(re.escape(_stem(place)) + "[0-9a-f]{8}")
    with suppress(OSError):
        return sorted(path for path in place.parent.iterdir() if pattern.fullmatch(path.name))
    return []


@contextmanager
def locked(path: Path, *, wait: bool = False) -> Iterator[bool | None]:
    """Lock a file or folder; False where another process has it, None where it cannot be locked."""
    try:
        import fcntl

        handle = os.open(path, os.O_RDONLY)
    except (ImportError, OSError):  # gone, or a system without such locks, which never takes anything away
        yield None
        return
    try:
        free: bool | None = True
        try:
            fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            free = False if isinstance(error, BlockingIOError) else None
        yield free
    finally:
        os.close(handle)


def remove(path: Path) -> None:
    """Remove a file, a link, or a folder with all that is in it."""
    shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)


def _stem(place: Path) -> str:
    return f".{os.fsdecode(os.fsencode(place.name)[:_LONGEST])}{LEFT}"


def _flush(stream: BinaryIO) -> None:
    stream.flush()
    os.fsync(stream.fileno())


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


_MARK = re.compile(rb"written by undertow ([a-z]+(?: --[a-z-]+)?), sha256 ([0-9a-f]{64})")
_LINE = re.compile(rb"(?:# |// |<!-- |% )" + _MARK.pattern + rb"(?: -->)?")
_SIMULATE = "simulate"
_HEADER = b"time,topic,field,value"
_SPELT = 16
"""Stamps that spell a digest, a hexadecimal digit each: two logs agree by chance in one of 2^64 cases."""
_STAMP = re.compile(rb"(-?\d+\.\d{6})(0{0,15}),")
_NEAR = 300
"""Bytes from either end of a file within which its mark is [B], which has at most 130; rows of a log are as short."""
_MOST = 1 << 30
"""Bytes after which a file is not read on [B]: none of undertow is so long, but a small gzip file can pretend to be."""
_MOST_METADATA = 1 << 24
"""Bytes of metadata that are searched in a Parquet file [B]; those of a simulated log are a few thousand."""


def remark(verb: str, data: bytes) -> str:
    """The words of a mark."""
    return f"written by undertow {verb}, sha256 {hashlib.sha256(data).hexdigest()}"


def on_top(verb: str, text: str) -> str:
    """Put a mark above a text in which `#` begins a remark."""
    return f"# {remark(verb, text.encode('utf-8'))}\n{text}"


def at_end(verb: str, data: bytes, begin: bytes = b"<!-- ", end: bytes = b" -->") -> bytes:
    """Put a mark below a page, or, with "% " and "", a PDF, or whatever else begins and ends a remark.

    Parameters
    ----------
    verb : that wrote the file
    data : its content
    begin, end : of a remark
    """
    data = data if data.endswith(b"\n") else data + b"\n"
    return data + begin + remark(verb, data).encode() + end + b"\n"


def in_stamps(text: str) -> str:
    """Spell the digest of a simulated log, header and rows, in zeros after its first stamps: 0.05 and 0.050 are one."""
    data = text.encode("utf-8")
    digits = hashlib.sha256(data).hexdigest()[:_SPELT]
    rows = data.split(b"\n", _SPELT + 1)
    spelt = [row.replace(b",", b"0" * int(digit, 16) + b",", 1) for row, digit in zip(rows[1:], digits, strict=False)]
    return b"\n".join([rows[0], *spelt, *rows[len(spelt) + 1 :]]).decode("utf-8")


def is_mark(text: str) -> bool:
    """True when a remark is a mark, be it true or not."""
    return _MARK.fullmatch(text.encode("utf-8")) is not None


def written_by(path: str | os.PathLike[str]) -> str | None:
    """The verb that wrote a file, such as "fit" or "inspect --fix"; None for any other file, and one edited since."""
    try:
        with open(path, "rb") as stream:
            begin = stream.read(4)
            stream.seek(0)
            if begin == b"PAR1":
                return _of_parquet(stream)
            if begin.startswith(b"\x1f\x8b"):
                with gzip.open(stream, "rb") as inner:
                    return _of_beginning(inner)
            return _of_end(stream) or _of_beginning(stream)
    except (OSError, EOFError, zlib.error):
        return None


def _of_beginning(stream: BinaryIO | gzip.GzipFile) -> str | None:
    """The verb of a text whose mark is in its first line, or in its first stamps."""
    line = stream.readline(_NEAR)
    found = _LINE.fullmatch(line.rstrip(b"\n"))
    if found is not None:
        return _verb(found, _digest(stream))
    if line != _HEADER + b"\n":
        return None
    rows = [stream.readline(_NEAR) for _ in range(_SPELT)]
    stamps = [stamp for row in rows if (stamp := _STAMP.match(row))]
    if len(stamps) < _SPELT:
        return None
    spelt = "".join(f"{len(stamp[2]):x}" for stamp in stamps)
    plain = [stamp[1] + row[stamp.end() - 1 :] for stamp, row in zip(stamps, rows, strict=True)]
    return _SIMULATE if _digest(stream, begin=line + b"".join(plain))[:_SPELT] == spelt else None


def _of_end(stream: BinaryIO) -> str | None:
    """The verb of a file whose mark is in its last line; the file is then at its beginning again."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - _NEAR))
    last = stream.read().removesuffix(b"\n").rpartition(b"\n")[2]
    stream.seek(0)
    found = _LINE.fullmatch(last)
    verb = None if found is None else _verb(found, _digest(stream, size - len(last) - 1))
    stream.seek(0)
    return verb


def _of_parquet(stream: BinaryIO) -> str | None:
    """The verb of a Parquet file, which has its metadata, the mark among them, after all that is marked."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - 8))
    begins = size - 8 - int.from_bytes(stream.read(4), "little")
    if not 4 < begins < size or size - begins > _MOST_METADATA:
        return None
    stream.seek(begins)
    found = _MARK.search(stream.read())
    stream.seek(4)
    return None if found is None else _verb(found, _digest(stream, begins - 4))


def parquet_data(data: bytes) -> bytes:
    """Content of a Parquet file that its mark is the digest of: all but its magic bytes and metadata."""
    return data[4 : len(data) - 8 - int.from_bytes(data[-8:-4], "little")]


def _verb(found: re.Match[bytes], digest: str) -> str | None:
    return found[1].decode() if digest == found[2].decode() else None


def _digest(stream: BinaryIO | gzip.GzipFile, most: int = _MOST, begin: bytes = b"") -> str:
    """SHA-256 of what begins so, and goes on with at most so many bytes; a part of a file agrees with no mark."""
    digest = hashlib.sha256(begin)
    while most > 0 and (chunk := stream.read(min(BLOCK, most))):
        digest.update(chunk)
        most -= len(chunk)
    return digest.hexdigest()
