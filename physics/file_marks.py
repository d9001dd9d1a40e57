"""Marks by which a file says which verb wrote it, and that nobody has changed it since.

A mark is a verb and the SHA-256 of the rest of the file. It stands in a remark on top (channel maps, vehicles, repaired
logs), in one at the end (pages, PDF), in the metadata (Parquet), or, where a remark would break whoever reads the file
as a plain table (simulated logs), in the zeros after its first time stamps. Whoever edits the file makes it his own.
"""

import gzip
import hashlib
import os
import re
import zlib
from collections.abc import Iterator
from itertools import chain
from typing import BinaryIO

from .reading import BLOCK

_MARK = re.compile(rb"written by undertow ([a-z]+(?: --[a-z-]+)?), sha256 ([0-9a-f]{64})")
_LINE = re.compile(rb"(?:# |// |<!-- |% )" + _MARK.pattern + rb"(?: -->)?")
_SIMULATE = "simulate"
_HEADER = b"time,topic,field,value"
_SPELT = 16
"""Stamps that spell a digest, a hexadecimal digit each: two logs agree by chance in one of 2^64 cases."""
_STAMP = re.compile(rb"(-?\d+\.\d{6})(0{0,15}),")
_NEAR = 300
"""Bytes from either end of a file within which its mark is [B]; it has at most 130."""
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
    """Put a mark below a page, or, with "% " and "", a PDF, or whatever else begins and ends a remark."""
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
    """Whether a remark is a mark, be it true or not."""
    return _MARK.fullmatch(text.encode("utf-8")) is not None


def written_by(path: str | os.PathLike[str]) -> str | None:
    """The verb that wrote a file, such as "fit" or "inspect --fix"; None for any other file, and one edited since."""
    try:
        with open(path, "rb") as stream:
            first, last = _ends(stream)
            if first.startswith(b"PAR1"):
                return _parquet(stream, last)
            if not first.startswith(b"\x1f\x8b"):
                return _text(stream, first, last)
            with gzip.open(stream, "rb") as inner:
                first = inner.read(_NEAR)
                return _above(chain([first], _chunks(inner, _MOST)), first)
    except (OSError, EOFError, zlib.error):
        return None


def _ends(stream: BinaryIO) -> tuple[bytes, bytes]:
    first = stream.read(_NEAR)
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - _NEAR))
    last = stream.read(_NEAR)
    stream.seek(0)
    return first, last


def _text(stream: BinaryIO, first: bytes, last: bytes) -> str | None:
    found = _LINE.fullmatch(last[: len(last.rstrip(b"\n"))].rpartition(b"\n")[2])
    if found is None or _LINE.fullmatch(first.partition(b"\n")[0]):
        return _above(_chunks(stream, _MOST), first)
    size = os.fstat(stream.fileno()).st_size - len(last.rstrip(b"\n").rpartition(b"\n")[2]) - 1
    return _agreed(found, _chunks(stream, size))


def _above(chunks: Iterator[bytes], first: bytes) -> str | None:
    """The verb of a text whose mark is in its first line, or in its first stamps."""
    line = first.partition(b"\n")[0]
    found = _LINE.fullmatch(line)
    if found is not None:
        return _agreed(found, chain([next(chunks)[len(line) + 1 :]], chunks))
    if line != _HEADER:
        return None
    rows = next(chunks)
    while rows.count(b"\n") <= _SPELT and (more := next(chunks, b"")):
        rows += more
    parts = rows.split(b"\n", _SPELT + 1)
    stamps = [_STAMP.match(row) for row in parts[1 : _SPELT + 1]]
    sound = [stamp for stamp in stamps if stamp is not None]
    if len(sound) < _SPELT:
        return None
    digest = "".join(f"{len(stamp[2]):x}" for stamp in sound)
    plain = [stamp[1] + row[stamp.end() - 1 :] for stamp, row in zip(sound, parts[1:], strict=False)]
    found_digest = _digest(chain([b"\n".join([parts[0], *plain, *parts[_SPELT + 1 :]])], chunks))
    return _SIMULATE if found_digest[:_SPELT] == digest else None


def _parquet(stream: BinaryIO, last: bytes) -> str | None:
    """Parquet has its metadata, the mark among them, after all that is marked."""
    size = os.fstat(stream.fileno()).st_size
    begins = size - 8 - int.from_bytes(last[-8:-4], "little")
    if not 4 < begins < size or size - begins > _MOST_METADATA:
        return None
    stream.seek(begins)
    found = _MARK.search(stream.read())
    stream.seek(4)
    return None if found is None else _agreed(found, _chunks(stream, begins - 4))


def parquet_data(data: bytes) -> bytes:
    """What a mark of a Parquet file is the digest of: all but its magic bytes and metadata."""
    return data[4 : len(data) - 8 - int.from_bytes(data[-8:-4], "little")]


def _agreed(found: re.Match[bytes], chunks: Iterator[bytes]) -> str | None:
    return found[1].decode() if _digest(chunks) == found[2].decode() else None


def _digest(chunks: Iterator[bytes]) -> str:
    digest = hashlib.sha256()
    for chunk in chunks:
        digest.update(chunk)
    return digest.hexdigest()


def _chunks(stream: BinaryIO | gzip.GzipFile, most: int) -> Iterator[bytes]:
    """A file in parts, up to `most` bytes; a digest of only the beginning agrees with no mark."""
    while most > 0 and (chunk := stream.read(min(BLOCK, most))):
        yield chunk
        most -= len(chunk)
