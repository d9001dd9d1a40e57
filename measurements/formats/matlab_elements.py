"""The elements of a MATLAB file of version 5 to 7, looked over before scipy unpacks them.

Layout: "MAT-File Format", The MathWorks, chapter 1, level 5. scipy 1.17 takes the type of an element for an index
without a check, and a damaged one ends the process.
"""

import mmap
import struct
import zlib
from pathlib import Path

_HEADER = 128
_MATRIX, _PACKED = 14, 15
_NUMBERS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18))
"""Types of elements that hold numbers or text."""
_DEPTH = 32
MOST = 1 << 29
"""Bytes that the packed variables of a file may unpack to; smaller ones may be bombs, larger ones do not fit."""


def check_elements(path: Path) -> None:
    """Walk all elements of a file.

    Raises
    ------
    ValueError
        for an element of no known type, one that is longer than what holds it, or more than half a gigabyte packed.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        order = ">" if content[126:128] == b"MI" else "<"
        at, left = _HEADER, MOST
        while at < len(content):
            kind, start, end, at = _element(content, at, len(content), order)
            if kind == _PACKED:
                unpacked = _unpacked(content[start:end], left)
                left -= len(unpacked)
                _walk(unpacked, 0, len(unpacked), order, 0)
                at = end  # packed elements are not padded
            elif kind == _MATRIX:
                _walk(content, start, end, order, 1)
            else:
                raise ValueError(f"an element of type {kind} where a variable is due")


def _walk(content: bytes | mmap.mmap, at: int, end: int, order: str, depth: int) -> None:
    while at < end:
        kind, start, stop, at = _element(content, at, end, order)
        if kind == _MATRIX:
            if depth > _DEPTH:
                raise ValueError(f"structs in structs, more than {_DEPTH} deep")
            _walk(content, start, stop, order, depth + 1)
        elif kind not in _NUMBERS:
            raise ValueError(f"an element of type {kind}")


def _element(content: bytes | mmap.mmap, at: int, end: int, order: str) -> tuple[int, int, int, int]:
    """Type of an element, where its data begin and end, and where the next one begins."""
    if at + 8 > end:
        raise ValueError("it ends within an element")
    kind, size = struct.unpack_from(f"{order}II", content, at)
    if kind >> 16:
        # Up to four bytes are held in the tag itself, with type and length in a half each.
        if kind >> 16 > 4:
            raise ValueError("a short element that is too long")
        return kind & 0xFFFF, at + 4, at + 4 + (kind >> 16), at + 8
    stop = at + 8 + size
    if stop > end:
        raise ValueError("an element is longer than the file")
    return kind, at + 8, stop, stop + (-size) % 8


def _unpacked(packed: bytes, most: int) -> bytes:
    worker = zlib.decompressobj()
    unpacked = worker.decompress(packed, max(most, 1))
    if not worker.eof:
        raise ValueError(f"a packed variable is cut short, or unpacks to more than {most / 1e6:.0f} MB")
    return unpacked
