"""The folder of a mission: a file for each that may drive it, and `mission.json`, which says whose they are."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from ..discovery.experiment.optimal_manoeuvre import Driven
from ..exports.missions.base import Mission, MissionFormat
from ..exports.missions.registry import mission_formats
from ..measurements.prepared_logs import PathLike
from ..physics.errors import RequestError
from ..physics.file_records import Flag, Number, Record, absent
from ..physics.files import write_json, write_text
from ..physics.folders import replace_folder
from ..physics.reading import read_json
from .run_folder.targets import check_target_folder

RECORD = "mission.json"


class PlannedDrive(Record):
    """A manoeuvre in a file.

    Attributes
    ----------
    words, seconds : what to drive, and its length [s]
    gains : log-likelihood by which each model that may be true would part from the others, in the order of `effects`
    probability : that it tells them apart, each of the models being as likely
    reach, speed : farthest from where it begins [m], and fastest [m/s]
    """

    words: str
    seconds: Number
    gains: tuple[Number, ...]
    probability: Number
    reach: Number
    speed: Number

    @classmethod
    def of(cls, driven: Driven) -> "PlannedDrive":
        """What the models made of one."""
        return cls(
            words=driven.trial.words,
            seconds=driven.seconds,
            gains=driven.gains,
            probability=driven.probability,
            reach=driven.reach,
            speed=driven.speed,
        )


class PlanRecord(Record):
    """The content of `mission.json`.

    Attributes
    ----------
    effects : the question, the first is what the search selected
    tells : whether the manoeuvre is more likely than not to tell them apart within the limits
    binding : limits without which one would
    hopeless : effects that nothing which was tried would tell from the others, were they the true ones
    minutes : on the water, with the rest before and after
    best, fixed : the manoeuvre, and the library's best
    files : SHA-256 of each file, by name
    """

    SCHEMA: ClassVar[str] = "undertow.mission/1"

    effects: tuple[str, ...]
    tells: Flag
    binding: tuple[str, ...] = ()
    hopeless: tuple[str, ...] = ()
    minutes: Number
    heading: Number
    best: PlannedDrive
    fixed: PlannedDrive
    files: dict[str, str] | None = absent()


def forms_of(mission: Mission) -> tuple[MissionFormat, ...]:
    """The formats in which a mission can be written: without a place, all but the waypoints."""
    return tuple(form for form in mission_formats() if mission.place is not None or not form.needs_place)


def write_mission(
    mission: Mission, record: PlanRecord, out: PathLike, reads: Sequence[PathLike] = (), *, force: bool = False
) -> Path:
    """Write the folder whole, in the place of an earlier one.

    Parameters
    ----------
    record : of `mission.json`, without digests
    reads : what the mission was made from, which no folder may replace

    Raises
    ------
    RequestError
        when the folder cannot be written, or something of another's would be lost.
    """
    target = check_mission_target(out, reads, force=force)

    def build(work: Path) -> list[str]:
        digests = {}
        for form in forms_of(mission):
            text = form.content(mission)
            write_text(work / form.name, text)
            digests[form.name] = hashlib.sha256(text.encode()).hexdigest()
        write_json(work / RECORD, record.but(files=digests).to_dict())
        return [*digests, RECORD]

    try:
        replace_folder(target, build, own_mission, force=force)
    except OSError as error:
        raise RequestError(f"cannot write the mission to {target}: {error.strerror or error}") from None
    return target


def check_mission_target(out: PathLike, reads: Sequence[PathLike], *, force: bool = False) -> Path:
    """The folder of a mission, if it can be written and nothing of the user's be lost."""
    names = {form.name for form in mission_formats()} | {RECORD}
    check_target_folder("--out", Path(out), names, own_mission, reads, force=force)
    return Path(out)


def own_mission(folder: Path) -> set[str]:
    """Names of the files of a mission in a folder that undertow wrote and nobody changed since."""
    try:
        held = read_json(folder / RECORD)
        if held.get("schema") != PlanRecord.SCHEMA:
            return set()
        digests = dict(held.get("files") or {})
        same = {n for n, d in digests.items() if hashlib.sha256((folder / n).read_bytes()).hexdigest() == d}
    except (OSError, ValueError, AttributeError, TypeError):
        return set()
    return same | {RECORD}
