"""Fleets joined in a new one, where they do not say two things of one log."""

import os
from collections.abc import Sequence
from pathlib import Path

from ..physics.errors import RequestError
from ..physics.folders import held
from .fleet_folder import (
    FACTORS,
    FleetIndex,
    FleetLog,
    check_fleet_target,
    clear_factors,
    factors_path,
    fleet_there,
    has_factors,
    index_of,
    keep_factors,
    read_hull_factors,
    read_index,
    write_index,
)

PathLike = str | os.PathLike[str]


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
    if not force and (lost := sorted(log.log for log in fleet_there(folder).logs if log.sha256 not in logs)):
        raise RequestError(
            f"cannot write {folder}: it is a fleet with {len(lost)} logs that are in none of the others ({lost[0]}); "
            "merge it, too, into a new folder, or --force to replace it"
        )
    places = {log.log for log in logs.values()}
    skipped = {(s.log, s.problem): s for index in indices for s in index.skipped if s.log not in places}
    (folder / FACTORS).mkdir(parents=True, exist_ok=True)
    with held(folder, "writes"):
        for one, index in zip(folders, indices, strict=True):
            for log in index.logs:
                if not has_factors(folder, log.factors):
                    read_hull_factors(one, log.factors)  # which refuses what is broken
                    keep_factors(folder, log.factors, factors_path(one, log.factors).read_bytes())
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
