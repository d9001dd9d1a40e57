"""Writes a repaired log: canonical channels as CSV, and above them, in remarks, what was done to it."""

import gzip
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..physics.errors import RequestError
from ..physics.files import write_bytes
from .log import Log


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
    remarks = [f"repaired by undertow from {log.name}", *done, *wrong, *log.notes]
    head = "".join(f"# {' '.join(remark.split())}\n" for remark in remarks)
    data = (head + _table(log)).encode("utf-8")
    return write_bytes(target, gzip.compress(data, mtime=0) if target.suffix == ".gz" else data)


def _table(log: Log) -> str:
    channels = list(log.channels.values())
    time, start = channels[0].time, log.start_ns

    def stamp(t: float) -> str:
        return str(start + round(1e9 * t)) if start else f"{t:.6f}"

    if all(np.array_equal(channel.time, time) for channel in channels):
        rows = np.column_stack([channel.value for channel in channels]).tolist()
        lines = [
            f"{stamp(t)},{','.join(f'{x:.9g}' for x in row)}\n" for t, row in zip(time.tolist(), rows, strict=True)
        ]
        return f"{'timestamp_ns' if start else 't'},{','.join(channel.name for channel in channels)}\n" + "".join(lines)
    long = [
        (t, channel.name, x)
        for channel in channels
        for t, x in zip(channel.time.tolist(), channel.value.tolist(), strict=True)
    ]
    long.sort(key=lambda row: row[0])
    lines = [f"{stamp(t)},fixed,{name},{x:.9g}\n" for t, name, x in long]
    return f"{'timestamp_ns' if start else 'time'},topic,field,value\n" + "".join(lines)
