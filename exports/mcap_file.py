"""An MCAP file of JSON messages in chunks, compressed by zstandard and indexed, so that a viewer enters anywhere.

Records are those of the package mcap; its writer spends ten microseconds on each of ten thousands of messages, so one
loop puts those of a chunk together (MCAP specification, mcap.dev/spec).
"""

import struct
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import BinaryIO

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from ..measurements.formats.unpacking import zstd

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a file."""
_CHUNK = 2**20
"""Bytes from which a chunk ends: what the package mcap has."""
_MESSAGE, _HEAD = struct.Struct("<BQHIQQ"), struct.calcsize("<BQ")
"""What stands before the data of a message: opcode and length, then channel, number, and stamps of log and sender."""
_INDEX = struct.Struct("<BQHI")
"""What stands before the stamps and places of a message index: opcode and length, channel, and bytes that follow."""

Message = tuple[int, int, bytes]
"""Stamp [ns], channel, and content."""


class McapFile:
    """A file that is being written: `schema` and `channel` first, then `messages` once, `metadata`, and `finish`."""

    def __init__(self, stream: BinaryIO, library: str) -> None:
        self._stream, self._at = stream, 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        self._put(MAGIC + _bytes([Header("", library)]))

    def schema(self, name: str, definition: bytes) -> int:
        """Number of a JSON Schema, which is told."""
        self._schemas.append(Schema(id=len(self._schemas) + 1, data=definition, encoding="jsonschema", name=name))
        return self._schemas[-1].id

    def channel(self, topic: str, schema: int, about: Mapping[str, str]) -> int:
        """Number of a channel, which is told."""
        number = len(self._channels) + 1
        self._channels.append(Channel(number, topic, message_encoding="json", metadata=dict(about), schema_id=schema))
        return number

    def messages(self, found: Iterable[Message]) -> None:
        """Write all messages, which come in the order of their stamps."""
        parts = [_bytes([*self._schemas, *self._channels])]
        size, stamps, places = len(parts[0]), [0, 0], defaultdict(list)
        for stamp, channel, data in found:
            if not places:
                stamps[0] = stamp
            stamps[1] = stamp
            places[channel] += (stamp, size)
            length = _MESSAGE.size + len(data)
            parts += (_MESSAGE.pack(Opcode.MESSAGE, length - _HEAD, channel, 0, stamp, stamp), data)
            size += length
            if size > _CHUNK:
                self._chunk(b"".join(parts), stamps, places)
                parts, size = [], 0
                places.clear()
        if places:
            self._chunk(b"".join(parts), stamps, places)

    def _chunk(self, content: bytes, stamps: Sequence[int], places: Mapping[int, Sequence[int]]) -> None:
        """Write a chunk, and where the messages of each channel stand in it."""
        pressed, start = zstd().compress(content), self._at
        self._put(_bytes([Chunk("zstd", pressed, stamps[1], stamps[0], zlib.crc32(content), len(content))]))
        length, offsets = self._at - start, {}
        for channel, pairs in places.items():
            offsets[channel] = self._at
            ahead = _INDEX.pack(Opcode.MESSAGE_INDEX, _INDEX.size - _HEAD + 8 * len(pairs), channel, 8 * len(pairs))
            self._put(ahead + struct.pack(f"<{len(pairs)}Q", *pairs))
            self._counts[channel] += len(pairs) // 2
        self._chunks.append(
            ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression="zstd",
                compressed_size=len(pressed),
                message_end_time=stamps[1],
                message_index_length=self._at - start - length,
                message_index_offsets=offsets,
                message_start_time=stamps[0],
                uncompressed_size=len(content),
            )
        )

    def metadata(self, name: str, told: Mapping[str, str]) -> None:
        """Write words about the file."""
        record = _bytes([Metadata(name, dict(told))])
        self._metadata.append(MetadataIndex(self._at, len(record), name))
        self._put(record)

    def finish(self) -> None:
        """Write what stands at the end: the summary, by which a viewer finds everything."""
        self._put(_bytes([DataEnd(0)]))
        start, summary, offsets = self._at, b"", []
        for opcode, records in (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, self._metadata),
        ):
            group = _bytes(records)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        pointed = start + len(summary)
        summary += _bytes(offsets)
        ahead = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, pointed)
        self._put(summary + _bytes([Footer(start, pointed, zlib.crc32(ahead, zlib.crc32(summary)))]) + MAGIC)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _put(self, data: bytes) -> None:
        """Write, and count: a pipe does not tell where it is."""
        self._stream.write(data)
        self._at += len(data)


def _bytes(records: Iterable[McapRecord]) -> bytes:
    """Records one after the other."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()
