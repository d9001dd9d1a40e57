"""MATLAB `.mat` files up to version 7, through scipy: a time vector, and vectors as long as it, are a wide table.

A struct with a time vector of its own is a table of its own, named by its dotted path. Simulink's "structure with time"
and a struct with the fields Time and Data, as `timeseries` is saved, are read as what they mean.
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ....physics.errors import LogError
from ....physics.frames import Array
from ....physics.reading import Plain
from ..base import DEEPEST, Format, Head, Recording, Request, Stream
from .matlab_elements import check_elements
from .pandas_part import FramePart
from .tables import wide_recording

_TIMES = {"t": "t", "time": "time", "Time": "time", "tout": "time", "timestamp_ns": "timestamp_ns"}
"""Names of a time vector -> what a wide table calls such a column; `T` may be anything."""
_FOREIGN = {
    b"\xff\xd8\xff": "a JPEG picture",
    b"\x89PNG": "a PNG picture",
    b"GIF8": "a GIF picture",
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a ZIP archive (or an office document)",
}
"""First bytes of files that are no log, and what these are. A .mat of version 4 has no mark of its own."""


@dataclass(slots=True)
class _Table:
    """A time vector and what is as long as it."""

    path: str
    name: str
    time: Array
    columns: dict[tuple[str, str], Array] = field(default_factory=dict)


def _read(head: Head, request: Request) -> Recording:
    from scipy.io import loadmat
    from scipy.io.matlab import matfile_version

    if head.start.startswith(b"MATLAB 7.3"):
        raise LogError(
            f"{head.path}: a MATLAB file of version 7.3 (HDF5), which is not read. In MATLAB: "
            "save('log.mat', 'variables', '-v7'), or write a table: writetable(T, 'log.csv')."
        )
    foreign = next((kind for mark, kind in _FOREIGN.items() if head.start.startswith(mark)), None)
    if foreign is not None:
        raise LogError(f"{head.path}: named .mat, but it is {foreign} and no MATLAB file. Give the log itself.")
    if matfile_version(head.path)[0] == 1:
        check_elements(head.path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        content = loadmat(head.path, simplify_cells=True)
    tables: list[_Table] = []
    left: list[str] = []
    _gather("", {name: value for name, value in content.items() if not name.startswith("__")}, [], tables, left)
    found = [_table(table, str(head.path)) for table in tables if table.columns]
    start = min((part.start_ns for part in found if part.start_ns), default=0)
    streams = [stream for part in found for stream in _since(start, part)]
    notes = [note for part in found for note in part.notes]
    if not streams:
        raise LogError(
            f"{head.path}: expected a time vector (t, time, tout [s] or timestamp_ns) and vectors as long as it, got "
            f"{', '.join(left[:12]) or 'no numbers'}. A table or timeseries is an object that only MATLAB reads: save "
            "table2struct(T, 'ToScalar', true), or write it with writetable(T, 'log.csv')."
        )
    if left:
        notes.append(f"as long as no time vector, not read: {', '.join(left[:12])}{' ...' if len(left) > 12 else ''}")
    return Recording(tuple(streams), tuple(notes), start_ns=start)


def _since(start: int, part: Recording) -> Sequence[Stream]:
    """Streams of a table, whose time may count from its own first stamp, on the time that counts from `start` [ns]."""
    later = (part.start_ns - start) / 1e9 if part.start_ns else 0.0
    return [replace(stream, time=stream.time + later) for stream in part.streams] if later else part.streams


def _table(table: _Table, where: str) -> Recording:
    """Cut a table as any wide table is cut, then name its streams by the struct that holds them."""
    import pandas as pd

    frame = pd.DataFrame({table.name: table.time} | {str(k): value for k, value in enumerate(table.columns.values())})
    found = wide_recording([FramePart(frame)], where)
    named = [
        replace(stream, topic=topic, field=name)
        for stream, (topic, name) in zip(found.streams, table.columns, strict=True)
    ]
    notes = [f"{table.path}: {note}" if table.path else note for note in found.notes]
    return replace(found, streams=tuple(named), notes=tuple(notes))


def _gather(path: str, content: Plain, times: list[_Table], tables: list[_Table], left: list[str]) -> None:
    """Sort the vectors of a struct under the time vector next to them, or the nearest one above of their length."""
    own = [_Table(path, _TIMES[name], value) for name, value in content.items() if _is_time(name, value)]
    tables += own
    times = [*own, *times]
    signal = _signal(content) if own and path else None
    if signal is not None:
        topic, _, name = path.rpartition(".")
        columns = _columns(name, signal)
        own[0].columns |= {(topic, column): value for column, value in columns if value.size == own[0].time.size}
        return
    for name, value in content.items():
        if _is_time(name, value):
            continue
        below = f"{path}.{name}" if path else name
        if name == "signals" and own:
            _simulink(path, value, own[0])
        elif isinstance(value, dict):
            if path.count(".") < DEEPEST:
                _gather(below, value, times, tables, left)
        elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
            for k, part in enumerate(list(np.ravel(np.asarray(value, dtype=object)))[:64]):
                if isinstance(part, dict):
                    _gather(f"{below}[{k}]", part, times, tables, left)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.size > 1:
            for column, numbers in _columns(name, value):
                table = next((table for table in times if table.time.size == numbers.size), None)
                if table is None:
                    left.append(f"{below} {'x'.join(str(n) for n in value.shape)}")
                    break
                table.columns[path, column] = numbers


def _is_time(name: str, value: Any) -> bool:
    numeric = isinstance(value, np.ndarray) and value.dtype.kind in "iuf"
    return name in _TIMES and numeric and value.ndim == 1 and value.size > 1


def _signal(content: Plain) -> np.ndarray | None:
    """Data of a struct that holds one signal: Time and Data, and nothing else that is as long."""
    found = [value for name, value in content.items() if name.lower() == "data"]
    return found[0] if len(found) == 1 and isinstance(found[0], np.ndarray) and found[0].dtype.kind in "biuf" else None


def _simulink(path: str, signals: Any, table: _Table) -> None:
    """Read the signals of Simulink's "structure with time": values and label of each."""
    listed = [signals] if isinstance(signals, dict) else list(np.ravel(np.asarray(signals, dtype=object)))
    for k, signal in enumerate(listed):
        if not isinstance(signal, dict) or not isinstance(signal.get("values"), np.ndarray):
            continue
        label = signal.get("label")
        name = label if isinstance(label, str) and label.strip() else f"signals[{k}]"
        for column, numbers in _columns(name, signal["values"]):
            if numbers.size == table.time.size:
                table.columns[path, column] = numbers


def _columns(name: str, value: np.ndarray) -> Iterator[tuple[str, Array]]:
    """Give a vector by its name, and the columns of a matrix (n, k) as name[0], name[1], ..."""
    if value.ndim == 1:
        yield name, value.astype(float)
    elif value.ndim == 2 and value.shape[1] <= 64:
        for k in range(value.shape[1]):
            yield f"{name}[{k}]", value[:, k].astype(float)


def _matches(head: Head) -> bool:
    return not head.gzipped and (head.start.startswith(b"MATLAB ") or head.path.suffix.lower() == ".mat")


MATLAB = Format("MATLAB", _matches, _read, (".mat",), library="scipy")
