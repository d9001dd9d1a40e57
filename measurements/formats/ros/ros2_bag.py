"""ROS 2 bags: a folder with metadata.yaml and its storage, MCAP or sqlite3 read row by row up to where it is torn."""

import os
import re
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote

from ....physics.errors import LogError, listed
from ....physics.reading import BLOCK, parse_yaml, read_bytes
from ..base import Format, Head, Recording, Request, check_pointer, in_file, torn
from ..unpacking import LARGEST_PART, ZSTD_MAGIC, Allowance, unpacked_message, zstd
from .mcap import MAGIC as MCAP_MAGIC
from .mcap import McapWalk
from .ros_messages import Collector

MAGIC = b"SQLite format 3\0"
_LANGUAGES = {"ros2msg": "msg", "ros2idl": "idl"}


def walk_sqlite(path: Path, collector: Collector, packed: bool, told: Callable[[float], None]) -> list[str]:
    """Hand all messages of a sqlite3 file to a collector, tell the share done, and give notes on what is damaged.

    Parameters
    ----------
    path : the file
    collector : takes the messages
    packed : whether every message is a zstd frame of its own
    told : called now and then

    Raises
    ------
    LogError
        when not even the topics can be read.
    """
    notes: list[str] = []
    total = path.stat().st_size
    database = _opened(path, total, notes)
    try:
        try:
            _check_plain(database)
            wanted = _topics(database, collector)
            rows = _last(database)
        except (sqlite3.Error, TypeError, ValueError) as error:
            raise LogError(
                f"{path}: expected a ROS 2 bag with tables 'topics' and 'messages' ({error}). Copy the log again."
            ) from error
        declared = _declared(path)
        missing = declared > total or declared == 0
        why = _messages(database, wanted, collector, packed, missing, lambda row: told(min(row / max(rows, 1), 1.0)))
        if why:
            notes.append(torn(total, max(declared, total), why))
    finally:
        database.close()
    return notes


def _topics(database: sqlite3.Connection, collector: Collector) -> list[int]:
    """Learn of the topics; give the numbers of those that are wanted."""
    definitions: dict[str, tuple[str, str]] = {}
    if database.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'").fetchone():
        query = "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
        definitions = {str(kind): (str(text), _LANGUAGES.get(how, "")) for kind, text, how in database.execute(query)}
    wanted = []
    for number, topic, kind, encoding in database.execute(
        "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
    ):
        definition, language = definitions.get(str(kind), ("", ""))
        if collector.connect(int(number), str(topic), str(kind), definition, language, str(encoding)):
            wanted.append(int(number))
    return wanted


def _messages(
    database: sqlite3.Connection,
    wanted: list[int],
    collector: Collector,
    packed: bool,
    missing: bool,
    progress: Callable[[int], None],
) -> str:
    """Hand over the messages; say why there are no more, where the end is not reached."""
    last: int | None = None
    # The order of rows is that of the table itself; an index or a sort would touch pages behind the break first.
    # Rows that nobody wants are stepped over here, without their data, so that none can be missing unseen.
    data_of_wanted = f"CASE WHEN topic_id IN ({','.join('?' * len(wanted))}) THEN data END"
    query = f"SELECT id, topic_id, timestamp, {data_of_wanted} FROM messages NOT INDEXED ORDER BY id"
    topics = set(wanted)
    try:
        for row, number, received, data in database.execute(query, wanted):
            if last is not None and (row <= last or (missing and row != last + 1)):
                # Damaged pages may lead in a circle, and pages that are not there read as empty.
                return "rows repeat" if row <= last else "rows are missing"
            last = row
            if number in topics and isinstance(received, int):
                raw = data if isinstance(data, bytes) else str(data).encode()
                if packed:
                    raw = unpacked_message(raw)
                    collector.unpacked(len(raw))
                collector.message(number, received, raw)
            if row % 1000 == 0:
                progress(row)
    except sqlite3.Error as error:
        return str(error)
    except MemoryError:
        # So Python tells of a row that claims more bytes than the limit lets it have; none were taken.
        return "a row is longer than it can be"
    return "it is shorter than it says" if missing else ""


def _declared(path: Path) -> int:
    """The size of the file by its own first page [bytes] (https://www.sqlite.org/fileformat.html, section 1.3)."""
    with path.open("rb") as file:
        start = file.read(100)
    size, pages = int.from_bytes(start[16:18], "big"), int.from_bytes(start[28:32], "big")
    return (65536 if size == 1 else size) * pages


def _opened(path: Path, total: int, notes: list[str]) -> sqlite3.Connection:
    """Open the file without writing to it, as far as it is there."""
    journal = path.with_name(path.name + "-wal")
    live = journal.is_file() and journal.stat().st_size > 0
    how = "mode=ro" if live else "mode=ro&immutable=1"
    database = sqlite3.connect(f"file:{quote(os.fsencode(path.resolve()))}?{how}", uri=True)
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_PART)
    database.execute("PRAGMA trusted_schema = OFF")
    database.text_factory = lambda raw: raw.decode("utf-8", "replace")
    # Without this, sqlite refuses a file that is shorter than its first page says, and with it everything before.
    database.execute("PRAGMA writable_schema = ON")
    # Damaged pages may make a query run for ever; a sound file needs some ten steps for each of its rows.
    steps = 1_000_000
    budget = [20 + total // 100_000]

    def spent() -> bool:
        budget[0] -= 1
        return budget[0] < 0

    database.set_progress_handler(spent, steps)
    if live:
        notes.append(f"{journal.name}, written by a recorder that did not close the bag, is read with it")
    return database


def _check_plain(database: sqlite3.Connection) -> None:
    """Refuse tables that are computed (views, virtual tables, generated columns): a few bytes then give gigabytes.

    Raises
    ------
    ValueError
        naming the table.
    """
    query = (
        "SELECT name, type, rootpage FROM sqlite_master "
        "WHERE lower(name) IN ('topics', 'messages', 'message_definitions')"
    )
    for name, kind, page in database.execute(query).fetchall():
        hidden = database.execute("SELECT 1 FROM pragma_table_xinfo(?) WHERE hidden != 0", (name,)).fetchone()
        if kind != "table" or not page or hidden:
            raise ValueError(f"'{name}' is no plain table")


def _last(database: sqlite3.Connection) -> int:
    """The number of the last row, for the progress; 0 where the way to it is torn."""
    try:
        return int(database.execute("SELECT max(id) FROM messages").fetchone()[0] or 0)
    except (sqlite3.DatabaseError, TypeError):
        # The table must at least be there.
        database.execute("SELECT id FROM messages LIMIT 0").fetchall()
        return 0


METADATA = "metadata.yaml"
_KEY = "rosbag2_bagfile_information"
_LONGEST_METADATA = 16 * 2**20
"""Bytes of metadata.yaml [B]: a topic takes 1 kB, most of it its quality of service."""
_STORAGE = re.compile(r"(?P<stem>.+?)(?:_(?P<split>\d+))?\.(?:db3|mcap)(?:\.zstd)?")
_JOURNAL = re.compile(r".+\.db3-(?:wal|shm|journal)")


@dataclass(frozen=True, slots=True)
class _Contents:
    """What a bag's folder holds: storage files in order, distribution, whether messages are packed one by one."""

    files: tuple[Path, ...]
    distribution: str = ""
    packed: bool = False
    notes: tuple[str, ...] = ()


def _matches(head: Head) -> bool:
    if head.entries is None:
        return head.start.startswith(MAGIC) and not head.gzipped
    if METADATA in head.entries and _KEY.encode() in _metadata(head.path):
        return True
    return _is_series([name for name in head.entries if not name.startswith(".") and name != METADATA])


def _is_series(names: Sequence[str]) -> bool:
    """True when the files of a folder are one bag by their names: one file, or the splits NAME_0, NAME_1, ... of one.

    A recorder that died has written no metadata. Anything else beside them makes the folder one of several logs.
    """
    found = [_STORAGE.fullmatch(name) for name in names if not _JOURNAL.fullmatch(name)]
    if not all(found) or len({match["stem"] for match in found if match}) != 1:
        return False
    splits = {int(match["split"] or -1) for match in found if match}
    return len(found) == 1 or (min(splits) == 0 and len(splits) == len(found))


def _metadata(folder: Path) -> bytes:
    """The text of the metadata; nothing for what is no file, or for one that no recorder writes so long."""
    path = folder / METADATA
    try:
        return read_bytes(path, _LONGEST_METADATA)
    except (OSError, ValueError):
        return b""


def _read(head: Head, request: Request) -> Recording:
    contents = _Contents((head.path,)) if head.entries is None else _contents(head.path, head.entries)
    collector = Collector(request, contents.distribution)
    notes = list(contents.notes)
    sizes = [path.stat().st_size if path.is_file() else 0 for path in contents.files]
    total = sum(sizes)
    for k, path in enumerate(contents.files):

        def told(share: float, before: int = sum(sizes[:k]), size: int = sizes[k]) -> None:
            request.progress(before + int(share * size), total)

        with in_file(head.path):
            collector.new_file(sizes[k])
            found = _walk(path, collector, contents.packed, told)
        notes += [f"{path.name}: {note}" for note in found] if len(contents.files) > 1 else found
    request.progress(total, total)
    with in_file(head.path):
        return collector.recording(notes)


def _walk(path: Path, collector: Collector, packed: bool, told: Callable[[float], None]) -> list[str]:
    """Hand the messages of one storage file to the collector."""
    if not path.is_file():
        raise LogError(f"{path}: expected a storage file of a bag, got a pipe, a folder or a broken link.")
    with path.open("rb") as file:
        start = file.read(256)
    check_pointer(start, path)
    if start.startswith(MCAP_MAGIC):
        with path.open("rb") as file:
            return McapWalk(collector, packed).read(file, path.stat().st_size, told)
    if start.startswith(MAGIC):
        return walk_sqlite(path, collector, packed, told)
    if start.startswith(ZSTD_MAGIC):
        with tempfile.TemporaryDirectory(prefix="undertow-") as folder:
            inner = Path(folder) / path.stem
            notes = _unpacked(path, inner)
            with inner.open("rb") as file:
                if file.read(4) == ZSTD_MAGIC:
                    raise LogError(f"{path}: a packed file in a packed file. Copy the log again.")
            return [*notes, *_walk(inner, collector, packed, told)]
    raise LogError(f"{path}: expected an MCAP or sqlite3 file of a ROS 2 bag, got {start[:8]!r}. Copy the log again.")


def _unpacked(path: Path, target: Path) -> list[str]:
    """Unpack a storage file as far as it goes."""
    unpacker = zstd().ZstdDecompressor()
    allowance = Allowance(path.stat().st_size)
    written, why = 0, ""
    with path.open("rb") as source, target.open("wb") as file:
        try:
            while not unpacker.eof and not why:
                block = source.read(BLOCK) if unpacker.needs_input else b""
                if not block and unpacker.needs_input:
                    why = "it ends too early"
                content = unpacker.decompress(block, BLOCK)
                written += len(content)
                allowance.take(len(content))
                if len(content) > shutil.disk_usage(target.parent).free:
                    raise LogError(f"{path}: it unpacks to more than the disk holds. Unpack it elsewhere with zstd -d.")
                file.write(content)
        except zstd().ZstdError as error:
            why = str(error)
    if not written:
        raise LogError(f"{path}: it cannot be unpacked ({why}). Copy the log again.")
    return [f"{path.name} cannot be unpacked beyond {written / 1e6:.3f} MB ({why})"] if why else []


def _contents(folder: Path, entries: Sequence[str]) -> _Contents:
    """What the metadata says, checked against the folder; the folder alone where there is none, or none that is sound.

    Raises
    ------
    LogError
        when there is no storage file, or a packing that is not read.
    """
    present = sorted((entry for entry in entries if _STORAGE.fullmatch(entry)), key=_natural)
    if METADATA not in entries:
        note = f"no {METADATA} in the folder (the recorder did not close the bag); all {len(present)} files are read"
        return _Contents(tuple(folder / name for name in present), notes=(note,))
    try:
        told = parse_yaml(_metadata(folder).decode())[_KEY]
        names = [PurePosixPath(_text(name)).name for name in told["relative_file_paths"]]
        mode, packing = (_text(told.get(key) or "").lower() for key in ("compression_mode", "compression_format"))
        distribution = _text(told.get("ros_distro") or "")
    except (KeyError, TypeError, AttributeError, ValueError):
        if not present:
            raise LogError(
                f"{folder}: {METADATA} is broken and there is no storage file. Copy the log again."
            ) from None
        note = f"{METADATA} is broken; all {len(present)} storage files of the folder are read"
        return _Contents(tuple(folder / name for name in present), notes=(note,))
    if mode == "message" and packing not in ("", "zstd"):
        raise LogError(f"{folder}: messages packed by '{packing}', expected zstd; convert it with ros2 bag convert.")
    missing = [name for name in names if name not in entries]
    notes = (f"files that {METADATA} names are missing: {listed(missing)}",) if missing else ()
    # A file that the recorder was writing when it died is not in the metadata of the last split.
    found = [name for name in names if name in entries] or present
    if not found:
        raise LogError(f"{folder}: the files that {METADATA} names are missing: {listed(missing)}.")
    return _Contents(tuple(folder / name for name in found), distribution, mode == "message", notes)


def _text(value: object) -> str:
    """A text of the metadata; a list in its place may be one of aliases of aliases, endless when written out."""
    if not isinstance(value, str):
        raise TypeError(f"expected a text, got {type(value).__name__}")
    return value


def _natural(name: str) -> list[Any]:
    """Order of splits: 2 before 10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


ROS2_BAG = Format("ROS 2 bag", _matches, _read, (".db3",), library="rosbags")
