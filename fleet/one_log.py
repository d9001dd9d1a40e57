"""One log to factors: what a worker does. A path goes in, a few kilobytes come out."""

import hashlib
import json
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from ..discovery.balance.base import WeakSettings
from ..measurements.log_digests import log_digests
from ..measurements.log_options import Reading
from ..measurements.statistics.single_threaded import single_threaded
from ..physics.errors import LogError
from ..physics.vehicle import Vehicle
from ..workflows.compress import in_pieces
from ..workflows.inputs import read_motions
from .fleet_folder import has_factors
from .hull_factors import hull_factors, settings_of
from .hull_factors_file import HullFactorsAbout, to_bytes
from .object_store import fetched, is_url

_MOST_TOLD = 500
"""Letters of a reason: some lines."""


@dataclass(frozen=True, slots=True)
class LogTask:
    """What is asked of a worker.

    Attributes
    ----------
    place : path or address of the log
    vehicle, follow, reading : what is followed, and how the log is read
    kept : folder of the fleet; factors that are in it already are not made again
    """

    place: str
    vehicle: Vehicle
    follow: tuple[str, ...]
    reading: Reading
    kept: str


@dataclass(frozen=True, slots=True)
class LogAnswer:
    """What a worker answers.

    Attributes
    ----------
    sha256 : of the bytes of the log
    key : of the factors: of the bytes, the vehicle, and how the factors are made
    content : the factors; none where they are kept already
    problem : why there are none; empty where there are
    """

    sha256: str = ""
    key: str = ""
    content: bytes | None = None
    problem: str = ""


@single_threaded
def factors_of(task: LogTask) -> LogAnswer:
    """Read a log and make its factors, unless they are there; what is wrong with the log is told, not raised."""
    path = Path(task.place)
    try:
        with fetched(task.place) if is_url(task.place) else nullcontext(path) as path:
            return _factors_of(task, path)
    except Exception as error:  # whatever a broken log leads to, the others go on
        told = str(error).strip() or type(error).__name__
        told = told.replace(str(path), task.place).removeprefix(f"{task.place}: ")
        return LogAnswer(problem=" ".join(told.split())[:_MOST_TOLD])


def key_of(sha256: str, task: LogTask) -> str:
    """By what the factors of a log are known: equal keys, equal factors."""
    reading = task.reading
    mapped = None if reading.channel_map is None else log_digests([str(reading.channel_map)])[0]["sha256"]
    made = {
        "schema": HullFactorsAbout.SCHEMA,
        "log": sha256,
        "follow": task.follow,
        "settings": settings_of(task.vehicle),
        "reading": [reading.frame, mapped, reading.namespace, reading.as_is, reading.fix],
    }
    return hashlib.sha256(json.dumps(made, sort_keys=True).encode()).hexdigest()


def _factors_of(task: LogTask, path: Path) -> LogAnswer:
    sha256 = log_digests([str(path)])[0]["sha256"]
    if sha256 is None:
        raise LogError(f"{path}: no such log, or it cannot be opened")
    key = key_of(sha256, task)
    if has_factors(Path(task.kept), key):
        return LogAnswer(sha256, key)
    log, motions = read_motions(path, task.vehicle, task.reading)
    start = log.start_ns / 1e9 if log.start_ns else float("nan")
    pieces = in_pieces(motions, WeakSettings())
    factors = hull_factors(pieces, task.vehicle, task.follow, digest=sha256, start=start)
    return LogAnswer(sha256, key, to_bytes(factors))
