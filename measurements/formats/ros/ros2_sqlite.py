"""The sqlite3 storage of ROS 2 bags, read in the order of its rows, up to where the file is torn."""

import os
import sqlite3
from collections.abc import Callable
from pathlib import Path
from urllib.parse import quote

from ....physics.errors import LogError
from ..base import torn
from ..unpacking import LARGEST_PART, unpacked_message
from .ros_messages import Collector

MAGIC = b"SQLite format 3\0"
_LANGUAGES = {"ros2msg": "msg", "ros2idl": "idl"}


class SqliteWalk:
    """One pass over the messages of a sqlite3 file.

    Parameters
    ----------
    collector : takes the messages
    packed : whether every message is a zstd frame of its own
    """

    def __init__(self, collector: Collector, packed: bool = False) -> None:
        self._collector = collector
        self._packed = packed

    def read(self, path: Path, told: Callable[[float], None]) -> list[str]:
        """Hand all messages to the collector, tell the share done, and give notes on what is damaged.

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
                wanted = self._topics(database)
                rows = _last(database)
            except (sqlite3.Error, TypeError, ValueError) as error:
                raise LogError(
                    f"{path}: expected a ROS 2 bag with tables 'topics' and 'messages' ({error}). Copy the log again."
                ) from error
            declared = _declared(path)
            missing = declared > total or declared == 0
            why = self._messages(database, wanted, missing, total, lambda row: told(min(row / max(rows, 1), 1.0)))
            if why:
                notes.append(torn(total, max(declared, total), why))
        finally:
            database.close()
        return notes

    def _topics(self, database: sqlite3.Connection) -> list[int]:
        """Learn of the topics; give the numbers of those that are wanted."""
        definitions: dict[str, tuple[str, str]] = {}
        if database.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'").fetchone():
            query = "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
            definitions = {
                str(kind): (str(text), _LANGUAGES.get(how, "")) for kind, text, how in database.execute(query)
            }
        wanted = []
        for number, topic, kind, encoding in database.execute(
            "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
        ):
            definition, language = definitions.get(str(kind), ("", ""))
            if self._collector.connect(int(number), str(topic), str(kind), definition, language, str(encoding)):
                wanted.append(int(number))
        return wanted

    def _messages(
        self,
        database: sqlite3.Connection,
        wanted: list[int],
        missing: bool,
        total: int,
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
                    if self._packed:
                        raw = unpacked_message(raw)
                        self._collector.unpacked(len(raw))
                    self._collector.message(number, received, raw)
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
