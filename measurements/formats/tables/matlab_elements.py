"""The elements of a MATLAB file of version 5 to 7, looked over before scipy unpacks them.

Layout: "MAT-File Format", The MathWorks, chapter 1, level 5. scipy 1.17 takes the type of an element for an index
without a check, and a damaged one ends the process.
"""

import math
import mmap
import struct
from pathlib import Path

from ..unpacking import inflated, most_held

_HEADER = 128
"""Bytes before the first element (MAT-File Format, level 5)."""
_MATRIX, _PACKED = 14, 15
"""Types of elements that are a matrix, and that are packed (MAT-File Format, level 5)."""
_NUMBERS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
"""Types of elements that hold numbers or text -> bytes of one."""
_CELL, _STRUCTS, _TEXT = 1, (2, 3), 4
"""Classes of a matrix that hold other matrices, or text; an object is saved as a struct is."""
_BEFORE = 6
"""Most elements that stand before the parts of a matrix."""
_DEPTH = 32
"""Levels of structs in structs: more than any log has, and few beside the calls that Python bears."""
_MOST_PARTS = 500_000
"""Matrices of a file: a struct array of 50,000 messages with 10 fields has so many, and each takes 1 kB in memory."""


def check_elements(path: Path) -> None:
    """Walk all elements of a file.

    Raises
    ------
    ValueError
        for an element of no known type, one that is longer than what holds it, one that claims more parts than it has,
        or more than `unpacking.most_held` lets packed variables hold.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        order = ">" if content[126:128] == b"MI" else "<"
        most = most_held(len(content))
        at, left, packed, walk = _HEADER, most, 0, _Walk(order)
        while at < len(content):
            kind, start, end, at = _element(content, at, len(content), order)
            if kind == _PACKED:
                unpacked = inflated(content[start:end], left)
                left -= len(unpacked)
                before = walk.numbers
                walk.down(unpacked, 0, len(unpacked), 0)
                packed += walk.numbers - before
                if 8 * packed > most:
                    raise ValueError(f"its packed variables hold more than {most // 8} numbers")
                at = end  # packed elements are not padded
            elif kind == _MATRIX:
                walk.down(content, start, end, 1)
            else:
                raise ValueError(f"an element of type {kind} where a variable is due")


class _Walk:
    """Goes down into the elements of matrices, and counts them.

    Attributes
    ----------
    numbers, parts : numbers and matrices seen so far
    """

    def __init__(self, order: str) -> None:
        self._order = order
        self.numbers = self.parts = 0

    def down(self, content: bytes | mmap.mmap, at: int, end: int, depth: int) -> None:
        """Look over the elements of a matrix, or of an unpacked variable (depth 0)."""
        numbers: list[bytes] = []
        parts, size = 0, end - at
        while at < end:
            kind, start, stop, at = _element(content, at, end, self._order)
            if not parts and kind != _MATRIX and len(numbers) < _BEFORE:
                numbers.append(content[start:stop])
            if kind == _MATRIX:
                parts += 1
                self.parts += 1
                if depth > _DEPTH:
                    raise ValueError(f"structs in structs, more than {_DEPTH} deep")
                if self.parts > _MOST_PARTS:
                    raise ValueError(f"more than {_MOST_PARTS} matrices, cells or fields of structs")
                self.down(content, start, stop, depth + 1)
            elif kind in _NUMBERS:
                self.numbers += (stop - start) // _NUMBERS[kind]
            else:
                raise ValueError(f"an element of type {kind}")
        if depth:
            _check_count(numbers, parts, size, self._order)


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
