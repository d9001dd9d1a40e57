"""A repaired log: in memory, or as CSV with remarks above its canonical channels that say what was done to it."""

import gzip
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..physics.errors import RequestError
from ..physics.file_marks import on_top
from ..physics.files import write_bytes
from ..physics.printable import one_line
from ..physics.vehicle import Vehicle
from .log import REPAIRED, Log, read_log
from .log_options import Reading
from .quality.examination import examine

VERB = "inspect --fix"
_PART = 1 << 16
"""Rows that are written together; all at once, the rows of a long log would take gigabytes."""


def repair(
    log: Log, vehicle: Vehicle | None = None, *, progress: Callable[[int, int], None] | None = None
) -> tuple[Log, str]:
    """Make the safe repairs of a log in memory, those that `inspect --fix` writes.

    Parameters
    ----------
    vehicle : whose thrusters the commands must agree with
    progress : see `examine`

    Returns
    -------
    (the repaired log, what was done to it) : Log, str
        Its first note says so, too.
    """
    examination = examine(log, vehicle, progress=progress)
    clean, done = examination.clean, "; ".join(examination.fixes) or "nothing had to be put right"
    return replace(clean, notes=(f"repaired in memory: {done}", *clean.notes)), done


def read_as_wanted(path: str, reading: Reading, vehicle: Vehicle | None = None) -> Log:
    """Read a log, and repair it where the reading says so."""
    log = read_log(path, reading, mend=reading.fix)
    return repair(log, vehicle)[0] if reading.fix else log


def check_target(out: Path, logs: Sequence[Path]) -> None:
    """Refuse a file that is one of the logs read, or that cannot be written.

    Raises
    ------
    RequestError
        for an input, another ending than .csv or .csv.gz, a folder, or a folder that is not there.
    """
    if any(out.exists() and log.exists() and out.samefile(log) for log in logs):
        raise RequestError(f"--fix {out} is the log that is read; give another name, so that the raw log is kept")
    if not out.name.endswith((".csv", ".csv.gz")):
        raise RequestError(f"--fix {out}: expected a name that ends in .csv or .csv.gz")
    if out.is_dir():
        raise RequestError(f"cannot write {out}: it is a folder; give the name of a file")
    if not out.parent.is_dir():
        raise RequestError(f"cannot write {out}: the folder {out.parent} does not exist; create it first")


def write_clean(log: Log, fixes: Sequence[str], left: Sequence[str], out: str | os.PathLike[str]) -> Path:
    """Write a log: a row per stamp where all channels share their stamps, a long table otherwise.

    The first lines are remarks, `# ...`: what was fixed, what was not, and what reading the raw log had to assume.
    `read_log` gives them back as notes. Time is that of the log, in nanoseconds where it counts from 1970. The same log
    gives the same bytes.

    Parameters
    ----------
    log : as repaired
    fixes, left : what was done to it, and what is still wrong with it, as sentences
    out : .csv or .csv.gz

    Raises
    ------
    RequestError
        see `check_target`.
    """
    target = Path(out)
    check_target(target, [log.path])
    done = [f"fixed: {fix}" for fix in fixes] or ["nothing had to be fixed"]
    wrong = [f"not fixed: {sentence}" for sentence in left]
    remarks = [f"{REPAIRED} {log.name}", *done, *wrong, *log.notes]
    head = "".join(f"# {one_line(' '.join(remark.split()))}\n" for remark in remarks)
    data = on_top(VERB, "".join((head, *_table(log)))).encode("utf-8")
    return write_bytes(target, gzip.compress(data, mtime=0) if target.suffix == ".gz" else data)


def _table(log: Log) -> Iterator[str]:
    """Give the table part by part, numbers with as many digits as they need to be read back the same."""
    channels = list(log.channels.values())
    time, start = channels[0].time, log.start_ns
    names = [channel.name for channel in channels]

    def stamp(t: float) -> str:
        return str(start + round(1e9 * t)) if start else repr(round(t, 9))

    if all(np.array_equal(channel.time, time) for channel in channels):
        yield f"{'timestamp_ns' if start else 't'},{','.join(names)}\n"
        for at in range(0, time.size, _PART):
            rows = np.column_stack([channel.value[at : at + _PART] for channel in channels]).tolist()
            stamps = time[at : at + _PART].tolist()
            yield "".join(f"{stamp(t)},{','.join(map(repr, row))}\n" for t, row in zip(stamps, rows, strict=True))
        return
    yield f"{'timestamp_ns' if start else 'time'},topic,field,value\n"
    every, values = (np.concatenate([getattr(c, part) for c in channels]) for part in ("time", "value"))
    which = np.repeat(np.arange(len(channels)), [channel.time.size for channel in channels])
    order = np.argsort(every, kind="stable")
    for at in range(0, order.size, _PART):
        part = order[at : at + _PART]
        rows = zip(every[part].tolist(), which[part].tolist(), values[part].tolist(), strict=True)
        yield "".join(f"{stamp(t)},fixed,{names[k]},{x!r}\n" for t, k, x in rows)
