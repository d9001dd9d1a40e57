"""The verb `inspect`: logs read as they are, looked over one by one and together, and one of them repaired."""

from collections.abc import Sequence
from pathlib import Path

from ..measurements.collection import find_logs
from ..measurements.inspection import Fixed, Inspection, Inspections, inspect_log, inspect_logs
from ..measurements.log import Log, read_log
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.prepared_logs import check_target, write_clean
from ..measurements.quality.examination import examine
from ..physics.errors import RequestError
from ..physics.stage import Say, trim_memory
from ..physics.vehicle import Vehicle
from ..reports.terminal.progress import SHOWN, Pace, megabytes, showing


def logs_in(paths: Sequence[Path]) -> tuple[list[Path], tuple[str, ...]]:
    """The logs that files, folders and patterns stand for, and notes on what else is there; see `find_logs`.

    Raises
    ------
    RequestError
        when a log is named twice.
    LogError
        when a folder or a pattern holds none.
    """
    names, notes = find_logs(paths)
    found = [Path(name) for name in names]
    seen = set()
    for path in found:
        if path.resolve() in seen:
            raise RequestError(f"{path} is given twice; its evidence would count twice. Give it once.")
        seen.add(path.resolve())
    return found, notes


@showing
def look_over(
    paths: Sequence[Path],
    vehicle: Vehicle | None = None,
    reading: Reading = AS_GUESSED,
    *,
    fix: Path | None = None,
    progress: Say | None = SHOWN,
) -> tuple[Inspection | Inspections, Log]:
    """Inspect logs, and write one of them repaired.

    Parameters
    ----------
    paths : logs, folders of logs, or patterns
    vehicle : whose needs are checked
    reading : see `read_log`
    progress : called with lines about the work, shown where nothing is said; None for silence
    fix : file for the repaired log, None to write nothing

    Returns
    -------
    (what was found, the first log) : Inspection or Inspections, Log
        Of one log or of several, whose `notes` name the files beside them that are no logs; with `fix`, its path and
        what was done under `fixed`.

    Raises
    ------
    LogError, RequestError
        when a log cannot be read, or `fix` is asked of several logs or would overwrite one.
    """
    logs, notes = logs_in(paths)
    if fix is not None:
        if len(logs) > 1:
            raise RequestError(f"--fix {fix}: expected one log to repair, got {len(logs)}; repair them one by one")
        check_target(fix, logs)
    told_bytes = megabytes(progress)
    read = [read_log(log, reading, progress=told_bytes, mend=True) for log in logs]
    trim_memory()
    if len(read) > 1:
        return inspect_logs(read, vehicle).but(notes=notes), read[0]
    checked = Pace(progress, "checks of the log", even=False).told
    examination = examine(read[0], vehicle, progress=checked)
    inspection = inspect_log(read[0], vehicle, examination=examination)
    inspection = inspection.but(notes=(*inspection.notes, *notes))
    if fix is None:
        return inspection, read[0]
    done, left = examination.fixes, examination.still_wrong
    write_clean(examination.clean, done, left, fix)
    fixed = Fixed(path=str(fix), done=done, left=left, usable=inspection.repaired)
    return inspection.but(fixed=fixed), read[0]
