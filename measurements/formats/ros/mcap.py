"""MCAP: the records one after the other, so that a file without its summary is read as well.

The layout is that of https://mcap.dev/spec (version 0). The summary at the end is not needed for a pass over all
messages, and a recorder that died has not written it.
"""

import struct
from collections.abc import Callable
from dataclasses import replace
from typing import BinaryIO
from zlib import crc32

from ..autopilots.mavlink import JsonTelemetry
from ..autopilots.telemetry import recording
from ..base import BrokenError, Format, Head, Recording, Request, begins_with, in_file, torn
from ..unpacking import LARGEST_PART, unpack, unpacked_message
from .ros_messages import Collector

MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15
"""Opcodes of records (mcap.dev/spec)."""
_RECORD = struct.Struct("<BQ")
_MESSAGE_START = struct.Struct("<HIQQ")
_CHUNK_START = struct.Struct("<QQQII")
_LANGUAGES = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl", "omgidl": "idl", "jsonschema": "jsonschema", "": ""}


class McapWalk:
    """One pass over the records of an MCAP file.

    Parameters
    ----------
    collector : takes the messages
    packed : whether every message is a zstd frame of its own (a ROS 2 bag compressed by message)
    """

    def __init__(self, collector: Collector, packed: bool = False) -> None:
        self._collector = collector
        self._packed = packed
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._wanted: set[int] = set()
        self._damaged = 0

    def read(self, file: BinaryIO, total: int, told: Callable[[float], None]) -> list[str]:
        """Hand all messages to the collector, tell the share done, and give notes on what is damaged.

        Parameters
        ----------
        file : at its start
        total : its bytes
        told : called for every chunk
        """
        at = len(file.read(len(MAGIC)))
        why = "" if at == len(MAGIC) else "in the middle of a record"
        ended = False
        while not why and not ended:
            told(min(at / total, 1.0))
            head = file.read(_RECORD.size)
            if len(head) < _RECORD.size:
                why = "it was not closed" if not head else "in the middle of a record"
                break
            op, length = _RECORD.unpack(head)
            data = file.read(min(length, LARGEST_PART))
            try:
                whole_record = len(data) == length
                if op == _CHUNK:
                    self._chunk(data, whole_record)
                elif whole_record:
                    self._record(op, memoryview(data))
                if not whole_record and length > LARGEST_PART and op not in (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK):
                    whole_record = _skipped(file, length - len(data))
                why = "" if whole_record else "in the middle of a record"
            except BrokenError as error:
                why = str(error)
            at += _RECORD.size + length * (not why)
            ended = op == _DATA_END
        notes = [f"{self._damaged} damaged chunks left out"] if self._damaged else []
        return [*notes, torn(min(at, total), total, why)] if why else notes

    def _chunk(self, data: bytes, whole: bool) -> None:
        """Hand the records of a chunk over; a damaged one is counted, of a torn one comes what can be had."""
        try:
            content = self._unpacked(data, whole)
        except Exception:
            # Three unpackers with errors of their own, and struct.error for a start that is cut off.
            self._damaged += whole
            return
        self._collector.unpacked(len(content))
        at, end = 0, len(content)
        unpack_from = _RECORD.unpack_from
        while at + 9 <= end:
            op, length = unpack_from(content, at)
            if at + 9 + length > end:
                break
            self._record(op, content[at + 9 : at + 9 + length])
            at += 9 + length

    def _unpacked(self, data: bytes, whole: bool) -> memoryview:
        _, _, size, crc, named = _CHUNK_START.unpack_from(data)
        start = _CHUNK_START.size + named
        how = data[_CHUNK_START.size : start].decode("ascii", "replace")
        (length,) = struct.unpack_from("<Q", data, start)
        raw = memoryview(data)[start + 8 : start + 8 + length]
        if whole and len(raw) < length:
            raise ValueError("a damaged size")
        content = unpack(how, raw, size)
        if whole and (len(content) != size or (crc and crc32(content) != crc)):
            raise ValueError("another size or checksum than it says")
        return memoryview(content)

    def _record(self, op: int, data: memoryview) -> None:
        """Take note of a schema or channel, hand a message over, pass over everything else."""
        try:
            if op == _MESSAGE:
                channel, _, received, _ = _MESSAGE_START.unpack_from(data)
                raw = data[_MESSAGE_START.size :]
                if self._packed and channel in self._wanted:
                    raw = unpacked_message(raw)
                    self._collector.unpacked(len(raw))
                self._collector.message(channel, min(received, 2**63 - 1), raw)
            elif op == _SCHEMA:
                (number,) = struct.unpack_from("<H", data)
                name, at = _text(data, 2)
                encoding, at = _text(data, at)
                self._schemas[number] = (name, encoding, _text(data, at)[0])
            elif op == _CHANNEL:
                number, schema = struct.unpack_from("<HH", data)
                topic, at = _text(data, 4)
                encoding, _ = _text(data, at)
                kind, language, definition = self._schemas.get(schema, ("", "", ""))
                readable = encoding if language in _LANGUAGES else f"{encoding} ({language})"
                kind = kind if kind.count("/") != 1 else kind.replace("/", "/msg/")
                wanted = self._collector.connect(
                    number, topic, kind, definition, _LANGUAGES.get(language, ""), readable
                )
                (self._wanted.add if wanted else self._wanted.discard)(number)
        except struct.error as error:
            raise BrokenError("a record is shorter than it must be") from error


def _text(data: memoryview, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from("<I", data, at)
    end = at + 4 + length
    if end > len(data):
        raise struct.error("a text is cut off")
    return bytes(data[at + 4 : end]).decode("utf-8", "replace"), end


def _skipped(file: BinaryIO, length: int) -> bool:
    """Read over bytes that nobody wants (a large attachment), a MB at a time."""
    while length:
        read = len(file.read(min(length, 2**20)))
        if not read:
            return False
        length -= read
    return True


def _read(head: Head, request: Request) -> Recording:
    mavlink = JsonTelemetry(request)
    collector = Collector(request, mavlink=mavlink)
    total = head.path.stat().st_size
    with in_file(head.path):
        with head.path.open("rb") as file:
            collector.new_file(total)
            notes = McapWalk(collector).read(file, total, lambda share: request.progress(int(share * total), total))
        request.progress(total, total)
        if not mavlink.moves:
            return collector.recording(notes)
        others = collector.recording(())
        told = (*notes, *(others.notes if others.streams else ()))
        return recording(mavlink, request, str(head.path), replace(others, notes=told))


MCAP = Format("MCAP", begins_with(MAGIC), _read, (".mcap",), library="rosbags")
