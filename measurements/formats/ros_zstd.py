"""The zstd unpacker that rosbags brings along."""

import sys
from typing import Any

_LARGEST_MESSAGE = 64 * 2**20


def zstd() -> Any:
    """The module `compression.zstd` of Python 3.14, or the same for older ones."""
    if sys.version_info >= (3, 14):
        from compression import zstd as module
    else:
        from backports import zstd as module
    return module


def unpack(data: bytes | memoryview, largest: int) -> bytes:
    """Unpack a zstd frame.

    Raises
    ------
    Exception
        of zstd for broken data; ValueError for more than `largest` bytes.
    """
    unpacker = zstd().ZstdDecompressor()
    content = unpacker.decompress(data, largest)
    if not unpacker.eof and not unpacker.needs_input:
        raise ValueError(f"more than {largest} bytes")
    return content


def unpacked_message(raw: bytes | memoryview) -> bytes:
    """Unpack a message that was packed on its own; a broken one comes out empty, which is no message either."""
    try:
        return unpack(raw, _LARGEST_MESSAGE)
    except Exception:
        # zstd's own error differs between its two homes.
        return b""
