"""ROS 1 bags: the records of format 2.0, read one after the other, so that a bag without its index is read as well.

The layout is that of https://wiki.ros.org/Bags/Format/2.0. The index at the end is not needed for a pass over all
messages, and a recorder that died has not written it.
"""

import struct
from typing import BinaryIO

from ....physics.errors import LogError
from ..base import BrokenError, Format, Head, Recording, Request, begins_with, in_file, torn
from ..unpacking import LARGEST_PART, unpack
from .ros_messages import Collector

_MAGIC = b"#ROSBAG V"
_VERSION = b"#ROSBAG V2.0\n"
_BAG_HEADER, _CHUNK, _CONNECTION, _MESSAGE = 3, 5, 7, 2
"""Values of `op` in the header of a record (ROS bag format 2.0)."""
_LENGTH = struct.Struct("<I")
_STAMP = struct.Struct("<II")
_LARGEST_HEADER = 16 * 2**20
"""Bytes of the header of a record, or of the definition of a connection [B]: these have some kB."""


def _read(head: Head, request: Request) -> Recording:
    if not head.start.startswith(_VERSION):
        came = head.start.split(b"\n", 1)[0][:20].decode("ascii", "replace")
        raise LogError(f"{head.path}: expected a ROS 1 bag of version 2.0, got '{came}'; convert it with rosbag fix.")
    collector = Collector(request)
    total = head.path.stat().st_size
    with in_file(head.path):
        with head.path.open("rb") as file:
            collector.new_file(total)
            notes = _walk(file, total, collector, request)
        return collector.recording(notes)


def _walk(file: BinaryIO, total: int, collector: Collector, request: Request) -> list[str]:
    """Hand all messages to the collector; give notes on what is damaged."""
    file.seek(len(_VERSION))
    notes: list[str] = []
    damaged = 0
    indexed = False
    at = file.tell()
    why = ""
    while at < total and not why:
        request.progress(at, total)
        try:
            fields, length = _header(file)
            op = fields.get(b"op", b"\0")[0]
            if op == _BAG_HEADER:
                indexed = fields.get(b"index_pos", b"") not in (b"", bytes(8))
                if fields.get(b"encryptor"):
                    raise LogError(f"the bag is encrypted ({fields[b'encryptor'][:60]!r}); decrypt it with rosbag.")
            start = file.tell()
            if op == _CHUNK:
                here = min(length, total - start)
                try:
                    chunk = _unpacked(file.read(min(here, LARGEST_PART)), fields, here == length)
                    collector.unpacked(len(chunk))
                    _messages(chunk, collector)
                except BrokenError:
                    damaged += here == length
                if here < length:
                    why = "in the middle of a chunk"
            elif op in (_CONNECTION, _MESSAGE):
                # A chunk that was never closed says that it is empty; its messages follow as records of the file.
                data = memoryview(file.read(min(length, _LARGEST_HEADER if op == _CONNECTION else LARGEST_PART)))
                if len(data) < length:
                    raise BrokenError("in the middle of a message")
                _record(op, fields, data, collector)
            at = start + length
            if at > total:
                why = why or "in the middle of a record"
            file.seek(min(at, total))
        except BrokenError as error:
            why = str(error)
    request.progress(total, total)
    if damaged:
        notes.append(f"{damaged} damaged chunks left out")
    if why:
        notes.append(torn(min(at, total), total, why))
    elif not indexed:
        notes.append(
            "the bag has no index (the recorder did not close it); read from its chunks, to the end of the file"
        )
    return notes


def _header(file: BinaryIO) -> tuple[dict[bytes, bytes], int]:
    """The header of the next record of a file, and the length of its data."""
    length = _number(file.read(4))
    if length > _LARGEST_HEADER:
        raise BrokenError("a record's header is damaged")
    raw = file.read(length)
    if len(raw) < length:
        raise BrokenError("in the middle of a record's header")
    return _fields(raw), _number(file.read(4))


def _number(raw: bytes) -> int:
    if len(raw) < 4:
        raise BrokenError("in the middle of a record")
    return _LENGTH.unpack(raw)[0]


def _fields(raw: bytes | memoryview) -> dict[bytes, bytes]:
    """The `name=value` fields of a record's header, each after its length."""
    raw, result, at = bytes(raw), {}, 0
    while at < len(raw):
        if at + 4 > len(raw):
            raise BrokenError("a record's header is damaged")
        (length,) = _LENGTH.unpack_from(raw, at)
        name, equals, value = raw[at + 4 : at + 4 + length].partition(b"=")
        if not equals or at + 4 + length > len(raw):
            raise BrokenError("a record's header is damaged")
        result[name] = value
        at += 4 + length
    if not result.get(b"op", b"?"):
        raise BrokenError("a record's header is damaged")
    return result


def _unpacked(raw: bytes, fields: dict[bytes, bytes], whole: bool) -> memoryview:
    """The content of a chunk; of a chunk that breaks off, as much as can be had."""
    how = fields.get(b"compression", b"?").decode("ascii", "replace")
    size = _number(fields.get(b"size", b""))
    try:
        content = unpack(how, raw, size)
    except ValueError as error:
        raise BrokenError(f"a chunk cannot be unpacked: {error}") from error
    if whole and len(content) != size:
        raise BrokenError("a chunk has another size than it says")
    return memoryview(content)


def _messages(chunk: memoryview, collector: Collector) -> None:
    """Hand the records of a chunk to the collector, up to the last whole one."""
    at, end = 0, len(chunk)
    unpack = _LENGTH.unpack_from
    while at + 4 <= end:
        (length,) = unpack(chunk, at)
        data = at + 8 + length
        if data > end:
            break
        fields = _fields(chunk[at + 4 : data - 4])
        (size,) = unpack(chunk, data - 4)
        if data + size > end:
            break
        _record(fields[b"op"][0], fields, chunk[data : data + size], collector)
        at = data + size


def _record(op: int, fields: dict[bytes, bytes], data: memoryview, collector: Collector) -> None:
    """Hand a connection or a message to the collector."""
    try:
        if op == _MESSAGE:
            seconds, nanoseconds = _STAMP.unpack(fields[b"time"])
            collector.message(_LENGTH.unpack(fields[b"conn"])[0], seconds * 1_000_000_000 + nanoseconds, data)
        elif op == _CONNECTION:
            about = _fields(data)
            topic = fields[b"topic"].decode("utf-8", "replace")
            package, _, name = about[b"type"].decode("utf-8", "replace").partition("/")
            definition = about[b"message_definition"].decode("utf-8", "replace")
            number = _LENGTH.unpack(fields[b"conn"])[0]
            collector.connect(number, topic, f"{package}/msg/{name}", definition, "msg", "ros1")
    except (KeyError, struct.error) as error:
        raise BrokenError("a record lacks its fields") from error


ROS1_BAG = Format("ROS 1 bag", begins_with(_MAGIC), _read, (".bag",), library="rosbags")
