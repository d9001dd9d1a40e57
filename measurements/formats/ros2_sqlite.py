"""The sqlite3 storage of ROS 2 bags, read in the order of its rows, up to where the file is torn."""

import sqlite3
from pathlib import Path
from urllib.parse import quote

from ...physics.errors import LogError
from .base import Request, torn
from .ros_messages import Collector
from .ros_zstd import unpacked_message

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

    def read(self, path: Path, total: int, request: Request, before: int = 0, whole: int | None = None) -> list[str]:
        """Hand all messages to the collector; give notes on what is damaged.

        Raises
        ------
        LogError
            when not even the topics can be read.
        """
        self._collector.new_file()
        notes: list[str] = []
        database = _opened(path, total, notes)
        try:
            try:
                wanted = self._topics(database)
                rows = _last(database)
            except (sqlite3.Error, TypeError, ValueError) as error:
                raise LogError(
                    f"{path}: expected a ROS 2 bag with tables 'topics' and 'messages' ({error}). Copy the log again."
                ) from error
            at, why = self._messages(
                database, wanted, rows, lambda share: request.progress(before + int(share * total), whole or total)
            )
            if why:
                notes.append(torn(int(at / max(rows, at, 1) * total), total, why))
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

    def _messages(self, database: sqlite3.Connection, wanted: list[int], rows: int, progress) -> tuple[int, str]:
        """Hand over the messages; give the number of the last row, and why there are no more."""
        last, count, why = 0, 0, ""
        # The order of rows is that of the table itself; an index or a sort would touch pages behind the break first.
        marks = ",".join("?" * len(wanted))
        query = (
            f"SELECT id, topic_id, timestamp, data FROM messages NOT INDEXED WHERE topic_id IN ({marks}) ORDER BY id"
        )
        try:
            for row, number, received, data in database.execute(query, wanted):
                if row <= last:
                    # Damaged pages may lead in a circle; rows of a sound table only go up.
                    return last, "rows repeat"
                last, count = row, count + 1
                raw = data if isinstance(data, bytes) else str(data).encode()
                self._collector.message(number, received, unpacked_message(raw) if self._packed else raw)
                if count % 1000 == 0:
                    progress(min(row / max(rows, 1), 1.0))
        except sqlite3.Error as error:
            why = str(error)
        except (TypeError, OverflowError):
            why = "a row holds what is no message"
        return last, why


def _opened(path: Path, total: int, notes: list[str]) -> sqlite3.Connection:
    """Open the file without writing to it, as far as it is there."""
    journal = path.with_name(path.name + "-wal")
    live = journal.is_file() and journal.stat().st_size > 0
    how = "mode=ro" if live else "mode=ro&immutable=1"
    database = sqlite3.connect(f"file:{quote(str(path.resolve()))}?{how}", uri=True)
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


def _last(database: sqlite3.Connection) -> int:
    """The number of the last row, for the progress; 0 where the way to it is torn."""
    try:
        return int(database.execute("SELECT max(id) FROM messages").fetchone()[0] or 0)
    except (sqlite3.DatabaseError, TypeError):
        # The table must at least be there.
        database.execute("SELECT id FROM messages LIMIT 0").fetchall()
        return 0
