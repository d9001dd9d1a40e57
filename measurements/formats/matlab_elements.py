"""The elements of a MATLAB file of version 5 to 7, looked over before scipy unpacks them.

Layout: "MAT-File Format", The MathWorks, chapter 1, level 5. scipy 1.17 takes the type of an element for an index
without a check, and a damaged one ends the process.
"""

import math
import mmap
import struct
import zlib
from pathlib import Path

_HEADER = 128
_MATRIX, _PACKED = 14, 15
_NUMBERS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18))
"""Types of elements that hold numbers or text."""
_CELL, _STRUCTS, _TEXT = 1, (2, 3), 4
"""Classes of a matrix that hold other matrices, or text; an object is saved as a struct is."""
_BEFORE = 6
"""Most elements that stand before the parts of a matrix."""
_DEPTH = 32
MOST = 1 << 29
"""Bytes that the packed variables of a file may unpack to; smaller ones may be bombs, larger ones do not fit."""


def check_elements(path: Path) -> None:
    """Walk all elements of a file.

    Raises
    ------
    ValueError
        for an element of no known type, one that is longer than what holds it, one that claims more parts than it has,
        or more than half a gigabyte packed.
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
    numbers: list[bytes] = []
    parts, size = 0, end - at
    while at < end:
        kind, start, stop, at = _element(content, at, end, order)
        if not parts and kind != _MATRIX and len(numbers) < _BEFORE:
            numbers.append(content[start:stop])
        parts += kind == _MATRIX
        if kind == _MATRIX:
            if depth > _DEPTH:
                raise ValueError(f"structs in structs, more than {_DEPTH} deep")
            _walk(content, start, stop, order, depth + 1)
        elif kind not in _NUMBERS:
            raise ValueError(f"an element of type {kind}")
    if depth:
        _check_count(numbers, parts, size, order)


def _check_count(numbers: list[bytes], parts: int, size: int, order: str) -> None:
    """Refuse a matrix that claims more parts than it has: scipy makes room for all of them before it reads one.

    Parameters
    ----------
    numbers : what stands before the parts: flags, dimensions, name, and of a struct the length of a field's name, and
        these names
    parts : matrices in this one
    size : of it [bytes]
    """
    if len(numbers) < 2 or len(numbers[0]) < 4:
        return
    mark = struct.unpack_from(f"{order}I", numbers[0])[0] & 0xFF
    many = math.prod(struct.unpack(f"{order}{len(numbers[1]) // 4}i", numbers[1][: len(numbers[1]) // 4 * 4]))
    most = size
    if mark == _CELL:
        most = parts
    elif mark in _STRUCTS and len(numbers) >= 5 and len(numbers[-2]) >= 4 and numbers[-1]:
        length = struct.unpack_from(f"{order}i", numbers[-2])[0]
        many *= len(numbers[-1]) // max(length, 1)
        most = parts
    elif mark not in (*_STRUCTS, _TEXT):
        return
    if many > most:
        raise ValueError(f"a cell array, struct or text of {many} parts in {size} bytes")


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
