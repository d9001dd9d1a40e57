"""The folder of a fleet, made, added to and joined: `fleet.json` lists the logs, `factors/KEY.npz` holds each."""

from collections.abc import Collection, Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import ClassVar

from ..measurements.prepared_logs import PathLike
from ..physics.errors import RequestError
from ..physics.file_records import Number, Record
from ..physics.files import write_bytes, write_json
from ..physics.folders import hold_folder
from ..physics.reading import read_bytes, read_json, reason
from ..workflows.run_folder.run_files import check_target_folder
from .hull_factors import HullFactors, from_bytes
from .log_sources import INDEX

FACTORS = "factors"
"""Folder of the factors."""
_MOST = 2**26
"""Bytes of the factors of a log [B]: 128 blocks with some forty parameters."""
_REMEDY = "'undertow fleet LOGS --vehicle V --out FOLDER' makes one"


class FleetLog(Record):
    """A log of the fleet.

    Attributes
    ----------
    log : path or address
    boat : its name
    time : middle of the log, UTC, as ISO 8601 has it
    hours : in which the boat was driven [h]
    factors : name of the file of its factors, without the ending
    sha256 : of the bytes of the log
    vehicle : digest of the vehicle
    begins : what a manifest says of its day, UTC; empty for nothing
    notes : of the manifest
    version : by which it is seen whether the log changed since
    """

    log: str
    boat: str
    time: str
    hours: Number
    factors: str
    sha256: str
    vehicle: str
    begins: str = ""
    notes: str = ""
    version: str = ""

    @property
    def day(self) -> str:
        """The date (UTC), as ISO 8601 has it."""
        return self.time[: len("2026-05-03")]


class SkippedLog(Record):
    """A log that could not be read when it was last given, or that counts already, and why."""

    log: str
    boat: str
    problem: str


class FleetIndex(Record):
    """The content of `fleet.json`: logs in the order of their keys, so that equal fleets have equal files."""

    SCHEMA: ClassVar[str] = "undertow.fleet/1"
    logs: tuple[FleetLog, ...] = ()
    skipped: tuple[SkippedLog, ...] = ()

    @property
    def boats(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(sorted({log.boat for log in self.logs}))

    @property
    def of_several_vehicles(self) -> tuple[str, ...]:
        """Boats whose logs were read with vehicles that differ."""
        pairs = {(log.boat, log.vehicle) for log in self.logs}
        return tuple(boat for boat in self.boats if sum(boat == one for one, _ in pairs) > 1)

    @property
    def hours(self) -> float:
        """Of all logs [h]."""
        return sum(log.hours for log in self.logs)


def index_of(logs: Iterable[FleetLog], skipped: Iterable[SkippedLog]) -> FleetIndex:
    """The index of logs in whatever order."""
    told = sorted(skipped, key=lambda one: (one.log, one.problem))
    return FleetIndex(logs=tuple(sorted(logs, key=lambda log: (log.factors, log.log))), skipped=tuple(told))


def read_index(folder: Path) -> FleetIndex:
    """The index of a fleet folder.

    Raises
    ------
    RequestError
        when there is none, or it is none.
    """
    path = folder / INDEX
    try:
        return FleetIndex.read(read_json(path), path, _REMEDY)
    except OSError as error:
        what = "a file" if folder.is_file() else f"one without {INDEX}" if folder.is_dir() else "no such folder"
        got = f"{path}: {error.strerror or error}" if path.is_file() else what
        raise RequestError(f"{folder}: expected the folder of a fleet, got {got}; {_REMEDY}") from None
    except ValueError as error:
        if isinstance(error, RequestError):
            raise
        raise RequestError(f"{path}: not readable as a fleet ({reason(error)}); {_REMEDY}") from None


def write_index(folder: Path, index: FleetIndex) -> None:
    """Write the index, whole or not at all."""
    write_json(folder / INDEX, index.to_dict())


def own_fleet(folder: Path) -> Collection[str]:
    """Which files of a folder are those of a fleet."""
    try:
        read_index(folder)
    except (RequestError, OSError):
        return ()
    return (INDEX, FACTORS)


def existing_index(folder: Path) -> FleetIndex:
    """The index of a folder, an empty one where it is no fleet yet."""
    return read_index(folder) if own_fleet(folder) else FleetIndex()


def check_fleet_target(folder: Path, reads: Iterable[str | Path], *, force: bool) -> None:
    """Check that a fleet can be written; what only looks like one is not made over, nor taken for anything else.

    Raises
    ------
    RequestError
        when its index cannot be read, or what `check_target_folder` says.
    """
    try:
        if (folder / INDEX).is_file():
            read_index(folder)
    except RequestError as error:
        raise RequestError(f"{error.typed}; to write here, take it away first") from None
    check_target_folder("--out", folder, {INDEX, FACTORS}, own_fleet, list(reads), force=force)


def factors_path(folder: Path, key: str) -> Path:
    """Where the factors of a key are."""
    return folder / FACTORS / f"{key}.npz"


def read_hull_factors(folder: Path, key: str) -> HullFactors:
    """The factors of a key.

    Raises
    ------
    RequestError
        when they are gone or broken.
    """
    path = factors_path(folder, key)
    try:
        return from_bytes(read_bytes(path, _MOST), path)
    except OSError as error:
        raise RequestError(
            f"{path}: {error.strerror or error}; run 'undertow fleet' with the same logs again, which makes it"
        ) from None


def has_factors(folder: Path, key: str) -> bool:
    """True when the factors of a key are there, and whole."""
    try:
        read_hull_factors(folder, key)
    except RequestError:
        return False
    return True


def clear_factors(folder: Path, index: FleetIndex) -> None:
    """Take away factors that no log of the index has any more; other files stay."""
    kept = {log.factors for log in index.logs}
    for path in (folder / FACTORS).glob("*.npz"):
        if len(path.stem) == 64 and path.stem not in kept:  # a SHA-256 is ours
            path.unlink(missing_ok=True)


def iso(seconds: float) -> str:
    """An instant [s since 1970] as ISO 8601 has it, to the second."""
    return datetime.fromtimestamp(round(seconds), UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def seconds_of(text: str) -> float:
    """The reverse of `iso`."""
    return datetime.fromisoformat(text).timestamp()


def merge_fleets(fleets: Sequence[PathLike], out: PathLike, *, force: bool = False) -> FleetIndex:
    """Join fleet folders in a new one; a log that is in several is there once.

    Raises
    ------
    RequestError
        when one is no fleet, two say something else of a log, or the folder cannot be written.
    """
    if len(fleets) < 2:
        raise RequestError(f"merge: expected two fleets or more, got {len(fleets)}")
    folder = Path(out)
    folders = [Path(fleet) for fleet in fleets]
    indices = [read_index(one) for one in folders]
    check_fleet_target(folder, folders, force=force)
    logs = _joined(indices)
    if not force and (lost := sorted(log.log for log in existing_index(folder).logs if log.sha256 not in logs)):
        raise RequestError(
            f"cannot write {folder}: it is a fleet with {len(lost)} logs that are in none of the others ({lost[0]}); "
            "merge it, too, into a new folder, or --force to replace it"
        )
    places = {log.log for log in logs.values()}
    skipped = {(s.log, s.problem): s for index in indices for s in index.skipped if s.log not in places}
    (folder / FACTORS).mkdir(parents=True, exist_ok=True)
    with hold_folder(folder, "writes"):
        for one, index in zip(folders, indices, strict=True):
            for log in index.logs:
                if not has_factors(folder, log.factors):
                    read_hull_factors(one, log.factors)  # which refuses what is broken
                    write_bytes(factors_path(folder, log.factors), factors_path(one, log.factors).read_bytes())
        merged = index_of(logs.values(), skipped.values())
        write_index(folder, merged)
        clear_factors(folder, merged)
    return merged


def _joined(indices: Sequence[FleetIndex]) -> dict[str, FleetLog]:
    """The logs of several fleets by the digests of their bytes."""
    logs: dict[str, FleetLog] = {}
    places: dict[tuple[str, str, str], FleetLog] = {}
    for log in sorted((log for index in indices for log in index.logs), key=lambda log: (log.log, log.sha256)):
        known = logs.setdefault(log.sha256, log)
        if (known.boat, known.time) != (log.boat, log.time):
            raise RequestError(
                f"merge: expected one boat and day of {log.log}, got {known.boat} {known.time} and {log.boat} "
                f"{log.time}; say which with a manifest, and make one of the fleets again"
            )
        if known.factors != log.factors:
            raise RequestError(
                f"merge: expected one vehicle and the same parameters for {log.log} of {log.boat}, got two ways of "
                "reading it; make one of the fleets again as the other was made"
            )
        other = places.setdefault((log.log, log.boat, log.day), log)
        if other.sha256 != log.sha256:
            raise RequestError(
                f"merge: expected one log {log.log} of {log.boat} on {log.day}, got two with other bytes; "
                "where it grew, make the older fleet again; where there are two, name their boats in manifests"
            )
    return logs
