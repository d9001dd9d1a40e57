"""Sources of a fleet's logs (folders, patterns, a manifest, object stores), with the boat and the day of each log."""

import csv
import io
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any

from ..measurements.formats.registry import SUFFIXES, find_logs
from ..physics.errors import LogError, RequestError
from ..physics.reading import read_text, read_yaml
from ..physics.registry_members import how_to_install

_URL = re.compile(r"(?:s3a?|gs|az|abfss?|https?)://[^/]+", re.ASCII)


def is_url(name: str) -> bool:
    """True when a name is the address of an object store, or of something in one."""
    return _URL.match(name) is not None


def objects_below(url: str, suffixes: Collection[str]) -> list[tuple[str, str]]:
    """Addresses of the logs at or below an address, each with what changes when the object does.

    Parameters
    ----------
    url : an address, or a pattern of addresses: `*` is any part of a name, `**` any folders
    suffixes : usual endings of a log's name; what ends otherwise is passed over, unless it is the address itself

    Raises
    ------
    LogError
        when the store cannot be asked, or nothing is there.
    """
    root, key = _parted(url)
    pattern = "*" in key
    prefix = key.partition("*")[0].rpartition("/")[0] if pattern else key.rstrip("/")
    with _telling(url):
        store = _store(root)
        listed = [one for many in _obstore().list(store, prefix=prefix or None) for one in many]
        # A list with a prefix gives what is below it; the object of that name itself is asked for.
        listed += [] if not key or key.endswith("/") or listed or pattern else [_obstore().head(store, key)]
    known = {one["path"]: f"{one['size']}-{one.get('e_tag')}-{one['last_modified'].isoformat()}" for one in listed}
    endings = tuple(suffixes)
    if pattern:
        found = [p for p in sorted(known) if _meets(p.split("/"), key.split("/"))]
    else:
        found = [p for p in sorted(known) if p == key or p.lower().endswith(endings)]
    if not found:
        text = "meets the pattern" if pattern else "is a log"
        raise LogError(f"{url}: expected logs at this address, got {len(known)} objects and none that {text}")
    return [(f"{root}/{p}", known[p]) for p in found]


def _meets(key: Sequence[str], pattern: Sequence[str]) -> bool:
    """True when the parts of a key meet those of a pattern, whose `**` stands for any number of parts."""
    if not pattern:
        return not key
    if pattern[0] == "**":
        return any(_meets(key[skipped:], pattern[1:]) for skipped in range(len(key) + 1))
    return bool(key) and fnmatchcase(key[0], pattern[0]) and _meets(key[1:], pattern[1:])


@contextmanager
def fetched(url: str) -> Iterator[Path]:
    """An object as a file of its name, for as long as it is read.

    Raises
    ------
    LogError
        when it cannot be fetched.
    """
    root, key = _parted(url)
    with TemporaryDirectory(prefix="undertow-") as folder:
        path = Path(folder, PurePosixPath(key).name)
        with _telling(url), path.open("wb") as stream:
            for part in _obstore().get(_store(root), key).stream():
                stream.write(part)
        yield path


def _parted(url: str) -> tuple[str, str]:
    root = _URL.match(url)
    assert root is not None, url
    return root[0], url[root.end() :].lstrip("/")


def _store(root: str) -> Any:
    """The store of a bucket; credentials and the endpoint come from the environment, as its own tools have them."""
    from obstore.store import from_url

    return from_url(root)


def _obstore() -> Any:
    try:
        import obstore
    except ImportError:
        raise RequestError(f"logs in object stores need obstore: {how_to_install('cluster')}") from None
    return obstore


@contextmanager
def _telling(url: str) -> Iterator[None]:
    _obstore()
    try:
        yield
    except Exception as error:  # obstore has a dozen kinds, of the network, the store and the address
        told = (str(error).strip().splitlines() or [type(error).__name__])[0]
        raise LogError(
            f"{url}: cannot be read ({told[:300]}); look at the address, and at AWS_* or the like in the environment"
        ) from None


COLUMNS = ("log", "boat", "day", "vehicle", "notes")
"""Columns of a manifest, of which the first is needed."""
INDEX = "fleet.json"
"""File that makes a folder a fleet; no log is looked for in one."""
_MANIFESTS = {".csv", ".yaml", ".yml"}
_SURE = (*(suffix for suffix in SUFFIXES if suffix not in (".log", ".gz")), ".csv.gz")
"""Endings that hardly anything but a log has: one of these that no reader knows is named, and not passed over."""
_DATE = re.compile(r"(?<!\d)(20\d\d)-?([01]\d)-?([0-3]\d)(?!\d)(?:[T_ -]+([0-2]\d)[-:]?([0-5]\d)(?:[-:]?([0-5]\d))?)?")
"""A date in a name, perhaps with the time of day: 2026-05-03, 20260503_101500."""


@dataclass(frozen=True, slots=True)
class LogSource:
    """A log, and what is known of it before it is read.

    Attributes
    ----------
    place : path, from the root on, for a fleet is added to from several folders; or address
    boat : name of the boat
    begins : when it begins [s since 1970], or when its day does, where somebody says so; None where nobody does
    named : the same, as the name of the file has it
    vehicle : vehicle file, where it has one of its own; empty for that of the fleet
    notes : of the person who made the manifest
    version : what changes when the file does: size and time of the last change, or what an object store tells
    """

    place: str
    boat: str
    begins: float | None = None
    named: float | None = None
    vehicle: str = ""
    notes: str = ""
    version: str = ""


def find_sources(given: Sequence[str | os.PathLike[str]]) -> tuple[LogSource, ...]:
    """The logs that are meant, each once, in the order of their places.

    A folder stands for the logs in it and in the folders below it. The folder that a log lies in is its boat, where no
    manifest says another.

    Parameters
    ----------
    given : logs, folders, patterns, addresses (s3://bucket/path/, gs://, az://), and manifests

    Raises
    ------
    LogError
        when a folder holds no log, or a pattern meets nothing.
    RequestError
        when a manifest cannot be read, or a log is given with two boats or days.
    """
    found: dict[str, LogSource] = {}
    for name in given:
        for source in _sources(os.fspath(name)):
            known = found.setdefault(source.place, source)
            if replace(known, version=source.version) != source:
                raise RequestError(
                    f"{source.place}: given twice, as {_said(known)} and as {_said(source)}; say one of the two"
                )
    return tuple(found[place] for place in sorted(found))


def _sources(name: str) -> Iterable[LogSource]:
    if is_url(name):
        return [_of(url, PurePosixPath(url).parent.name, version) for url, version in objects_below(name, SUFFIXES)]
    path = Path(name)
    if path.is_dir():
        return [_local(place) for place in _below(path)]
    if path.suffix.lower() in _MANIFESTS and path.is_file() and (rows := _manifest(path)) is not None:
        return [source for number, row in rows for source in _of_row(path, number, row)]
    return [_local(place) for place in find_logs([name])[0]]


def _below(folder: Path) -> list[str]:
    """Logs in a folder and in those below it, but for hidden ones and fleets, with what has a log's ending and is none.

    Links to folders are followed, each folder once; one that cannot be opened stands among the logs, to be named.
    """
    result: list[str] = []
    told = ""
    seen: set[str] = set()

    def shut(error: OSError) -> None:
        result.append(error.filename)

    for here, inner, files in os.walk(folder, followlinks=True, onerror=shut):
        inner[:] = sorted(name for name in inner if not name.startswith(".") and not (Path(here, name, INDEX)).exists())
        if INDEX in files or os.path.realpath(here) in seen:
            inner[:] = []
            continue
        seen.add(os.path.realpath(here))
        try:
            logs = find_logs([here])[0]
        except LogError as error:
            told = told or error.typed
            logs = ()
        result += logs
        if logs == (here,):
            inner[:] = []
            continue
        inner[:] = [name for name in inner if str(Path(here, name)) not in logs]
        others = [str(Path(here, name)) for name in files if name.lower().endswith(_SURE) and not name.startswith(".")]
        result += sorted(set(others) - set(logs))
    if not result:
        raise LogError(told or f"{folder}: expected a folder of logs, got a fleet; give the folder of its logs")
    return result


def _of(place: str, boat: str, version: str) -> LogSource:
    return LogSource(place, boat or "boat", named=date_in(PurePosixPath(place).name), version=version)


def _local(place: str) -> LogSource:
    path = Path(os.path.abspath(place))
    return _of(str(path), path.resolve().parent.name, _version(path))


def _version(path: Path) -> str:
    try:
        found = path.stat()
    except OSError:  # whoever reads it says so
        return ""
    # Of a folder only what is directly in it would show: a bag is looked through each time.
    return "" if path.is_dir() else f"{found.st_size}-{found.st_mtime_ns}"


def _manifest(path: Path) -> Sequence[tuple[int, Mapping[str, str]]] | None:
    """Rows of a manifest, each with its number; None for a table that is none, such as a log."""
    if path.suffix.lower() == ".csv":
        with path.open("rb") as stream:
            head = stream.readline()
        mark = max(b",", b";", b"\t", key=head.count)  # spreadsheets of half of Europe write semicolons
        if b"log" not in [word.strip(b'" \xef\xbb\xbf\r\n').lower() for word in head.split(mark)]:
            return None
        try:
            lines = csv.reader(io.StringIO(read_text(path)), delimiter=mark.decode(), skipinitialspace=True)
            keys = [key.strip().lower() for key in next(lines)]
            rows = [(lines.line_num, cells) for cells in lines if any(map(str.strip, cells))]
        except (ValueError, csv.Error) as error:
            raise RequestError(f"{path}: not readable as a manifest: {error}") from None
        for number, cells in rows:
            if len(cells) > len(keys) or len(set(keys)) < len(keys):
                raise RequestError(
                    f"{path}, row {number}: expected a cell for each of the columns {', '.join(keys)}, each once; got "
                    f"{len(cells)} cells; put quotes about a cell with a {mark.decode()!r} in it"
                )
        numbered = [(number, dict(zip(keys, cells, strict=False))) for number, cells in rows]
    else:
        try:
            content = read_yaml(path)
        except ValueError as error:
            raise RequestError(f"{path}: not readable as a manifest: {error}") from None
        items = content.get("logs") if isinstance(content, dict) else content
        if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
            raise RequestError(f"{path}: expected a list of logs, each with {', '.join(COLUMNS)}; got something else")
        numbered = [(n, {str(k): "" if v is None else str(v) for k, v in i.items()}) for n, i in enumerate(items, 1)]
    if not numbered:
        raise RequestError(f"{path}: expected a manifest with logs, got none")
    for number, row in numbered:
        unknown = [key for key in row if key not in COLUMNS]
        if unknown or not row.get("log", "").strip():
            wrong = f"{unknown[0]!r}" if unknown else "no log"
            raise RequestError(f"{path}, row {number}: expected {', '.join(COLUMNS)}, got {wrong}; mend the manifest")
    return numbered


def _of_row(path: Path, number: int, row: Mapping[str, str]) -> list[LogSource]:
    given = {key: value.strip() for key, value in row.items() if value.strip()}
    log = given["log"] if is_url(given["log"]) else str(path.parent / given["log"])
    begins = _day(given["day"], f"{path}, row {number}") if "day" in given else None
    vehicle, notes = given.get("vehicle", ""), given.get("notes", "")
    if vehicle and (path.parent / vehicle).exists():
        vehicle = str(path.parent / vehicle)
    try:
        sources = list(_sources(log))
    except LogError as error:
        raise LogError(f"{path}, row {number}: {error.typed}") from None
    return [
        replace(source, boat=given.get("boat", source.boat), begins=begins, vehicle=vehicle, notes=notes)
        for source in sources
    ]


def _day(text: str, where: str) -> float:
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        raise RequestError(f"{where}: expected a day such as 2026-05-03 or 2026-05-03T10:15, got {text!r}") from None
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()


def date_in(name: str) -> float | None:
    """The date in a name [s since 1970, UTC]; None where there is none.

    Examples
    --------
    >>> date_in("otter_1970-01-02.csv"), date_in("2026-05-03T10-15.bin")
    (None, 1777803300.0)
    """
    found = _DATE.search(name)
    if found is None:
        return None
    try:
        return datetime(*(int(part or 0) for part in found.groups()), tzinfo=UTC).timestamp()  # type: ignore[misc]
    except ValueError:
        return None


def _said(source: LogSource) -> str:
    day = "" if source.begins is None else datetime.fromtimestamp(source.begins, UTC).isoformat()
    return " ".join(filter(None, (source.boat, day, source.vehicle, source.notes)))
