"""Files of a run folder: which are undertow's and unchanged, by digests in `run.json`, and which a verb may write.

A verb writes no file that it reads, and replaces only files that it wrote.
"""

import hashlib
import os
import re
import stat
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import Enum
from itertools import combinations
from pathlib import Path
from typing import Any

from ...measurements.formats.registry import find_logs
from ...physics.errors import LogError, RequestError, expect
from ...physics.files import is_device, real, stream_of, strict_json, try_out, write_json, written_by
from ...physics.folders import Own, check_folder, replace_folder
from ...physics.reading import read_json
from ...residuals.models.foreign import is_function_name
from ...residuals.models.model_files import NETWORK_FILES
from ...residuals.models.neural import is_network_folder
from .moved_files import RunOrigin, places

COMPARE = "compare"
"""The `verb` in the `run.json` of a comparison; that of a run has none."""
RUN_SCHEMA = "undertow.run/1"
RECORD, PAGE, PDF = "run.json", "report.html", "report.pdf"
_SCHEMAS = {f"{name}.json": name for name in ("findings", "comparison", "audit")}
_SCHEMAS |= {"inspection.json": "inspections", "standardisation.json": "standardisation", RECORD: "run"}
_VERSIONS = ("1", "2")
VIEWED = ("series.mcap", "series.foxglove.json", "series.plotjuggler.xml")
"""For viewers: a series, and how each shows it."""
DATA = (*(name for name in _SCHEMAS if name != RECORD), "model.yaml", "nominal.yaml", "series.csv", *VIEWED)
"""What the pages are made of."""
RUN_FILES = (*DATA, RECORD, PAGE, PDF)
"""What a run folder holds; what is for viewers and the pages may be left out."""


def is_run(folder: str | os.PathLike[str]) -> bool:
    """True when a folder holds a run, be it whole or damaged."""
    return any(_of_schema(Path(folder) / name) for name in (RECORD, "findings.json"))


def is_comparison(folder: str | os.PathLike[str]) -> bool:
    """True when a folder holds what `compare --page` wrote, and not a run: its `run.json` says so."""
    return content_of(Path(folder) / RECORD).get("verb") == COMPARE


def own_run(folder: Path) -> set[str]:
    """Names of the files of a run in a folder that undertow wrote and nobody changed since.

    Those that `run.json` has digests of must agree with them; pages bear their own marks. In a run of an earlier
    version, which has no digests, only JSON shows by its schema whose it is.
    """
    return own_report(folder) if _of_schema(folder / RECORD) else set()


def own_report(folder: Path) -> set[str]:
    """The same of a folder that may lack `run.json`, which a page does not need."""
    record = content_of(folder / RECORD)
    pages = {name for name in (PAGE, PDF) if (written_by(folder / name) or "").startswith("report")}
    digests = record.get("files")
    if not isinstance(digests, dict):
        return pages | {name for name in _SCHEMAS if _of_schema(folder / name)}
    held = pages | (unchanged(folder, digests) & set(DATA))
    return held | {RECORD} if digests.get(RECORD) == _own_digest(record) else held


def unchanged(folder: Path, digests: Mapping[str, Any]) -> set[str]:
    """Names of files in a folder that have the SHA-256 of a list."""
    return {name for name, digest in digests.items() if digest is not None and _digest(folder / name) == digest}


def seal(folder: Path, record: Mapping[str, Any], names: Collection[str]) -> None:
    """Write `run.json` with the digests of files in the folder, and of itself without its own digest.

    Parameters
    ----------
    record : what it says else; digests in it stay, but for those of `names`
    names : of the files that are new
    """
    held = {**record.get("files", {}), **{name: _digest(folder / name) for name in names}}
    files = {name: held[name] for name in DATA if held.get(name) is not None}
    sealed = {**record, "files": files}
    write_json(folder / RECORD, {**sealed, "files": {**files, RECORD: _own_digest(sealed)}})


def reseal(folder: Path, names: Collection[str]) -> bool:
    """Bring `run.json` up to date, where it has digests, when files were written anew; True when it was changed."""
    record = content_of(folder / RECORD)
    if not isinstance(record.get("files"), dict):
        return False
    seal(folder, record, names)
    return True


def _own_digest(record: Mapping[str, Any]) -> str:
    files = {name: digest for name, digest in record["files"].items() if name != RECORD}
    return hashlib.sha256(strict_json({**record, "files": files}).encode("utf-8")).hexdigest()


def _of_schema(path: Path) -> bool:
    """True when a file holds what its name says, of this or an earlier version."""
    kind, _, version = str(content_of(path).get("schema")).rpartition("/")
    return kind == f"undertow.{_SCHEMAS[path.name]}" and version in _VERSIONS


def content_of(path: Path) -> dict[str, Any]:
    """The JSON object in a file, empty for anything else."""
    with suppress(OSError, ValueError):
        content = read_json(path)
        return content if isinstance(content, dict) else {}
    return {}


def _digest(path: Path) -> str | None:
    with suppress(OSError), path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
    return None


_MCAP = b"\x89MCAP0\r\n"
_HEAD = 400
"""Bytes at the beginning of a file that show what it is, where it bears no mark [B]."""
_SIGNED = b"undertow export"
"""What a binary export holds near its beginning, where no remark can be."""
_LIBRARY = 64
"""Bytes of an MCAP file within which its header names the library that wrote it [B]."""


class Kind(Enum):
    """Kind of file that a verb writes, with the verb's own words for it."""

    MAP = "inspect --map-out"
    FIXED = "inspect --fix"
    COMPARISON = "compare"
    SERIES = "compare --series"
    AUDIT = "check"
    FITTED = "fit"
    FOLLOWED = "adapt"
    VALUES = "adapt --values"
    STARTED = "init"
    CHANNELS = "init --channels"
    ADDED = "add"
    LIMITS = "ci --write-limits"
    SIMULATED = "simulate"
    EXPORTED = "export"
    TRACKS = "control"
    PAGE = "report"
    DIARY = "diary"
    PDF = "report --pdf"

    def wrote(self, path: Path) -> bool:
        """True when a file shows that this verb wrote it, and that nobody has changed it since where it has a mark."""
        if self in (Kind.COMPARISON, Kind.AUDIT):
            schema = "comparison" if self is Kind.COMPARISON else "audit"
            return re.match(rb'\s*\{\s*"schema":\s*"undertow\.%s/1"' % schema.encode(), _head(path)) is not None
        if self is Kind.SERIES:
            return _head(path).startswith(_MCAP) and b"undertow" in _head(path)[:_LIBRARY]
        if self is Kind.EXPORTED and _SIGNED in _head(path):
            return True
        return written_by(path) == self.value


def check_targets(
    targets: Iterable[tuple[str, Kind, Path | None]], reads: Iterable[Any] = (), *, force: bool = False
) -> list[Path]:
    """Check files before the work on them begins: nothing of the user's is lost, and they can be written.

    Parameters
    ----------
    targets : option, kind and path of each file; no path, no file
    reads : what the call reads: logs, folders, patterns, vehicles, maps, models; other objects and None are passed over
    force : write over what another made; never over what is read

    Returns
    -------
    list of Path
        Those in whose place a file is now, for `tell_replaced`.

    Raises
    ------
    RequestError
        when a target is read by the same call, is another target, belongs to a run or a network, was not written by
        this verb, or cannot be written.
    """
    wanted = [(option, kind, path) for option, kind, path in targets if path is not None]
    for (other, _, earlier), (option, _, path) in combinations(wanted, 2):
        if same_place(path, earlier) and not is_device(path):
            raise RequestError(f"{option} {path} is the file of {other}, too; give each a name of its own")
    inputs = list(inputs_of(reads)) if wanted else []
    for option, kind, path in wanted:
        _check(option, kind, path, inputs, force)
    earlier = [path for _, _, path in wanted if path.is_file() and path.stat().st_size]
    for _, _, path in wanted:
        with refused(str(path), "; nothing was read or written"):
            try_out(path)
    return earlier


def write_folder(what: str, target: Path, build: Callable[[Path], Collection[str]], own: Own, *, force: bool) -> Path:
    """Write a folder whole, in the place of an earlier one, see `replace_folder`; give its path.

    Parameters
    ----------
    what : is in it, for the message of an error

    Raises
    ------
    RequestError
        when it cannot be written, or something of another's would be lost.
    """
    with refused(f"{what} to {target}"):
        replace_folder(target, build, own, force=force)
    return target


@contextmanager
def refused(what: str, more: str = "") -> Iterator[None]:
    """Refuse to go on where something inside cannot be written, and say why.

    Raises
    ------
    RequestError
        in the place of an OSError.
    """
    try:
        yield
    except OSError as error:
        raise RequestError(f"cannot write {what}: {error.strerror or error}{more}") from None


def check_target_folder(
    option: str, target: Path, new: Collection[str], own: Own, reads: Iterable[Any] = (), *, force: bool = False
) -> None:
    """Check a folder before the work on it begins: nothing of the user's is lost, and it can be written.

    Parameters
    ----------
    new : names of the files that will be written
    own : which files in a folder are of this verb; see `physics.folders`
    reads, force : see `check_targets`

    Raises
    ------
    RequestError
        when the folder is a file, holds what is read or what this verb did not write, or cannot be written.
    """
    if target.exists() and not target.is_dir():
        raise RequestError(f"cannot write {target}: it is a file; give a folder that may be made")
    place = real(target)
    if not place.parent.is_dir():
        cure = "is a file; give a folder" if place.parent.exists() else "does not exist; make it"
        raise RequestError(f"cannot write {target}: {place.parent} {cure}")
    for path in inputs_of(reads):
        if real(path).is_relative_to(place):
            raise RequestError(f"{option} {target} holds {path}, which is read; give another folder, to keep it")
    with refused(str(target)):
        check_folder(target, new, own, force=force)


def check_target(
    out: str | os.PathLike[str], reads: Iterable[Any] = (), *, report: bool = True, force: bool = False
) -> Path:
    """The run folder's path, if it can be written and nothing of the user's be lost.

    Parameters
    ----------
    reads : logs, vehicle, map: what the run is made from
    report : whether the page is written, too
    force : replace also what undertow did not write

    Raises
    ------
    RequestError
        see `check_target_folder`.
    """
    expect("write_run: out", out, (str, os.PathLike), "give the path of a folder")
    target = Path(out)
    new = {name for name in RUN_FILES if name != PDF and (report or name != PAGE)}
    check_target_folder("--out", target, new, own_run, reads, force=force)
    return target


def check_page(out: str | os.PathLike[str], reads: Iterable[Any] = (), *, force: bool = False) -> Path:
    """The path of the folder of a comparison, if it can be written, nothing of the user's be lost, and no run.

    Parameters
    ----------
    reads : logs, vehicle, map, models: what is compared
    force : replace also what undertow did not write; never a run

    Raises
    ------
    RequestError
        see `check_target_folder`, and when the folder holds a run.
    """
    expect("compare: page", out, (str, os.PathLike), "give the path of a folder")
    target = Path(out)
    if is_run(target) and not is_comparison(target):
        raise RequestError(f"--page {target} holds a run, which would be lost; give another folder")
    check_target_folder("--page", target, ("comparison.json", "series.csv", RECORD, PAGE), own_run, reads, force=force)
    return target


def inputs_of(reads: Iterable[Any]) -> Iterator[Path]:
    """The files and folders that are read when these are given; a run brings its logs with it."""
    for given in reads:
        if isinstance(given, (list, tuple)):
            yield from inputs_of(given)
        elif isinstance(given, (str, os.PathLike)):
            yield from _inputs(os.fspath(given))


def same_place(one: Path, other: Path) -> bool:
    """True when two paths are one file, be it there or not."""
    with suppress(OSError):
        return one.samefile(other)
    return real(one) == real(other)


def _inputs(name: str) -> Iterator[Path]:
    path = Path(name)
    if not os.path.lexists(path) and not is_function_name(name):
        with suppress(LogError, OSError):
            yield from map(Path, find_logs([name])[0])  # a pattern; what is missing, its reader says
    elif not path.exists() and is_function_name(name):
        yield Path(*name.partition(":")[0].split(".")).with_suffix(".py")
    elif is_run(path):
        yield from (path / file for file in RUN_FILES)
        yield from _of_run(path)
    elif is_network_folder(path):
        yield from (path / file for file in NETWORK_FILES)
    else:
        yield path
        with suppress(LogError, OSError):
            for log in map(Path, find_logs([name])[0]):
                yield from (p for p in log.rglob("*") if p.is_file()) if log.is_dir() else (log,)


def _of_run(folder: Path) -> Iterator[Path]:
    """Logs and channel map of a run, wherever they may be now, as far as its record can be read."""
    with suppress(OSError, ValueError):
        record = RunOrigin.read(read_json(folder / RECORD), RECORD, "")
        made = [*record.made_logs, *([] if record.made_map is None else [record.made_map])]
        there = [place for one in made for place in places(folder, one) if os.path.exists(place)]
        yield from inputs_of([place for place in there if not is_run(place)])  # a run that names itself would never end


def _check(option: str, kind: Kind, path: Path, inputs: list[Path], force: bool) -> None:
    if stream_of(path) is not None or is_device(path):
        return
    for given in inputs:
        if not given.is_dir() and same_place(path, given):
            raise RequestError(f"{option} {path} is read by this call; give another name, so that it is not lost")
    if path.is_dir():
        raise RequestError(f"cannot write {path}: it is a folder; give the name of a file")
    place = real(path)
    if not place.parent.is_dir():
        parent = place.parent if path.is_symlink() else path.parent
        raise RequestError(f"cannot write {path}: the folder {parent} does not exist; create it first")
    if place.is_symlink():
        raise RequestError(f"cannot write {path}: its links lead in a circle; give the name of a file")
    there = place.exists()
    if there and not stat.S_ISREG(place.stat().st_mode):
        raise RequestError(f"cannot write {path}: it is a pipe, a socket or a disk; give the name of a file")
    if force:
        return
    for holds, names, what in ((is_run, RUN_FILES, "run folder"), (is_network_folder, NETWORK_FILES, "network")):
        if place.name in names and holds(place.parent):
            raise RequestError(
                f"{path} is in the {what} {place.parent.name}, whose files belong together; give another name"
            )
    if not there or not place.stat().st_size:
        return  # nothing is lost, and a script may have asked the system for the file
    if not kind.wrote(place):
        changed = "" if kind in (Kind.COMPARISON, Kind.SERIES, Kind.AUDIT) else ", or it was changed since"
        raise RequestError(
            f"{path} is there, and 'undertow {kind.value}' did not write it{changed}; give another name, or --force to "
            "replace it"
        )
    if not place.stat().st_mode & 0o222:
        raise RequestError(f"{path} is there and write-protected; give another name, or --force to replace it")


def _head(path: Path) -> bytes:
    with suppress(OSError), path.open("rb") as stream:
        return stream.read(_HEAD)
    return b""
