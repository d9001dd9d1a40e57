"""Unpacking of packed files within bounds: every bound and every unpacker, in one place.

Text of sensors packs 5 to 10 to 1, of frozen ones 50 to 100 to 1; what packs far better was made to fill memory.
Whoever has such a file may unpack it first: a file of full size on the disk is read.
"""

import bz2
import gzip
import io
import sys
import zlib
from pathlib import Path
from typing import Any

from ...physics.errors import LogError
from ...physics.reading import BLOCK

_ALWAYS = 64 * 2**20
"""Bytes to which any file may unpack, however small it is: they do no harm."""
_MOST_TIMES = 200
"""Beyond that, how many times a file's own size: twice the best that frozen sensors reach."""
_PASSING = 4 * 2**30
"""Bytes beyond which that is no longer enough, of what passes through in parts and is read in a minute."""
_USUAL_TIMES = 20
"""How many times its size a file may still unpack to then: any amount of sound recordings, which reach 10."""
HELD = 2**29
"""Bytes of numbers that a packed table may hold in memory at once; with the copies made of them, 1.2 GB."""
_MOST_LETTERS = 2**30
"""Bytes of text that a packed table may have: numbers of seven letters, as many as may be held."""
_LONGEST_LINE = 2**20
"""Bytes of one line of a table: 10,000 columns of numbers with all their digits have a third of it."""
LARGEST_PART = 256 * 2**20
"""Bytes of one chunk or record, packed or not: a recorder closes its chunks at some MB, or after one large message."""
_LARGEST_MESSAGE = 64 * 2**20
"""Bytes of one message that was packed on its own: more than twice a picture of 4K, which is no channel."""
_FREE_MESSAGES = 1_000_000
"""Messages that any file may have, however small it is: their tables take some 100 MB."""
_BYTES_A_MESSAGE = 4
"""Fewest bytes of a file for each message beyond the first million: its two stamps alone hardly pack better."""

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def most_unpacked(packed: int) -> int:
    """Bytes to which a file of `packed` bytes may unpack, when they pass through in parts."""
    return max(min(_ALWAYS + _MOST_TIMES * packed, _PASSING), _USUAL_TIMES * packed)


def most_held(packed: int, most: int | None = None) -> int:
    """Bytes to which a file of `packed` bytes may unpack, when all of them are in memory together; `HELD` at most."""
    return min(_ALWAYS + _MOST_TIMES * packed, HELD if most is None else most)


def check_unpacked(size: int, packed: int, most: int | None = None) -> None:
    """Refuse what unpacks to far more than any log does.

    Parameters
    ----------
    size : bytes unpacked so far
    packed : bytes of the file
    most : bytes that are allowed; `most_unpacked(packed)` when None

    Raises
    ------
    LogError
        without the path, which the reader adds.
    """
    most = most_unpacked(packed) if most is None else most
    if size > most:
        raise LogError(
            f"expected a log that unpacks to at most {most / 1e6:.0f} MB, for it has {packed / 1e6:.3f} MB, got more. "
            "It is broken, or made to fill the memory; if it is neither, unpack it yourself and give what comes out"
        )


class Allowance:
    """What the packed parts of one file may still become.

    Parameters
    ----------
    packed : bytes of the file on disk
    """

    def __init__(self, packed: int) -> None:
        self._packed = packed
        self._size = self._messages = 0
        self._most_messages = _FREE_MESSAGES + packed // _BYTES_A_MESSAGE

    def take(self, size: int) -> None:
        """Count bytes that were unpacked; see `check_unpacked`."""
        self._size += size
        check_unpacked(self._size, self._packed)

    def count_message(self) -> None:
        """Count a message, and refuse more than any file has.

        Raises
        ------
        LogError
            without the path, which the reader adds.
        """
        self._messages += 1
        if self._messages > self._most_messages:
            raise LogError(
                f"expected at most {self._most_messages} messages in a file of {self._packed / 1e6:.3f} MB, got more. "
                "It is broken, or made to fill the memory; if it is neither, unpack it yourself and give what comes out"
            )


def zstd() -> Any:
    """The module `compression.zstd` of Python 3.14, or the same for older ones, which rosbags brings along."""
    if sys.version_info >= (3, 14):
        from compression import zstd as module
    else:
        from backports import zstd as module
    return module


def unpack(how: str, data: bytes | memoryview, size: int) -> bytes | memoryview:
    """Unpack one part of a file.

    Parameters
    ----------
    how : zstd, lz4, bz2, or empty or none for what is not packed
    size : bytes that come out at most

    Raises
    ------
    ValueError
        when it is packed in another way, broken, or says that it is larger than any part.
    """
    if size > LARGEST_PART:
        raise ValueError(f"a part of {size} bytes")
    try:
        if how == "zstd":
            return zstd().ZstdDecompressor().decompress(data, size)
        if how == "lz4":
            from lz4.frame import LZ4FrameDecompressor

            return LZ4FrameDecompressor().decompress(data, size)
        if how == "bz2":
            return bz2.BZ2Decompressor().decompress(data, size)
    except ImportError:
        raise
    except Exception as error:
        # Each of the three has errors of its own, and zstd's differs between its two homes.
        raise ValueError(f"broken {how}: {error}") from error
    if how not in ("", "none"):
        raise ValueError(f"packed by {how[:20]!r}")
    return data


def unpacked_message(raw: bytes | memoryview) -> bytes | memoryview:
    """Unpack a message that was packed by zstd on its own; a broken one comes out empty, which is no message either."""
    try:
        content = unpack("zstd", raw, _LARGEST_MESSAGE + 1)
    except ValueError:
        return b""
    return content if len(content) <= _LARGEST_MESSAGE else b""


def inflated(packed: bytes | memoryview, most: int) -> bytes:
    """Unpack a zlib stream, as MATLAB packs its variables.

    Raises
    ------
    ValueError
        when it is broken, cut short, or unpacks to more than `most` bytes.
    """
    worker = zlib.decompressobj()
    try:
        content = worker.decompress(packed, max(most, 1))
    except zlib.error as error:
        raise ValueError(f"a packed variable is broken ({error})") from None
    if not worker.eof:
        raise ValueError(f"a packed variable is cut short, or unpacks to more than {most / 1e6:.0f} MB")
    return content


class TableText(io.RawIOBase):
    """The text of a table file, plain or gzip, as a binary stream that is refused once it grows beyond all bounds.

    Parameters
    ----------
    path : the file
    gzipped : whether it is packed

    Attributes
    ----------
    refusal : the error with which reading ended, for a parser that hides it behind one of its own
    packed : bytes of the file, where it is packed
    """

    def __init__(self, path: Path, gzipped: bool) -> None:
        self._file: Any = gzip.open(path, "rb") if gzipped else path.open("rb")  # noqa: SIM115 - `close` closes it
        self._on_disk = path.stat().st_size
        self.packed = self._on_disk if gzipped else None
        self._size = 0
        self._line = 0
        self.refusal: LogError | None = None

    def look_through(self, separator: str) -> None:
        """Unpack it once without parsing, a hundred times as fast, so that a bomb is refused before its words are read.

        Raises
        ------
        LogError
            for a packed table of more text, longer lines, or more numbers than fit.
        """
        if self.packed is None:
            return
        numbers = 0
        while block := self.read(BLOCK):
            numbers += block.count(separator.encode()) + block.count(b"\n")
            check_table(numbers, self.packed)
        self._file.seek(0)
        self._size = self._line = 0

    @property
    def done(self) -> tuple[int, int]:
        """Bytes of the file that were read so far, and all of them."""
        read = self._size if self.packed is None else self._file.fileobj.tell()
        return min(read, self._on_disk), self._on_disk

    def readable(self) -> bool:
        """Say yes."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read some bytes, and count what came and how long its last line is by now.

        Raises
        ------
        LogError
            for more text than a packed table has, or a line longer than any.
        """
        content = self._file.read(len(buffer))
        buffer[: len(content)] = content
        self._size += len(content)
        end = content.rfind(b"\n")
        self._line = self._line + len(content) if end < 0 else len(content) - end - 1
        try:
            if self.packed is not None:
                check_unpacked(self._size, self.packed, most_held(self.packed, _MOST_LETTERS))
            if self._line > _LONGEST_LINE:
                raise LogError(f"expected a table with lines of at most {_LONGEST_LINE} bytes, got a longer one")
        except LogError as error:
            self.refusal = error
            raise
        return len(content)

    def close(self) -> None:
        """Close the file as well."""
        self._file.close()
        super().close()


def check_table(numbers: int, packed: int | None) -> None:
    """Refuse a packed table of more numbers than may be held in memory; `packed` is its size, None for a plain one.

    Raises
    ------
    LogError
        without the path, which the reader adds.
    """
    if packed is not None:
        check_unpacked(8 * numbers, packed, most_held(packed))
