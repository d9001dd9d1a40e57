"""Check for spikes: single values that stand out of a record, and jumps across its range, as of short counters."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ....physics.motion import Array
from ...canonical import MOTION, Channel
from ...statistics.blocks import numbered_on
from ..faults import BLOCK, Fault, Kind, Size, size_of
from ..record import QUICK_ROW, About, Check, Finding, Fix, Found, Record, altered, channels_called

_LEAST_ROWS = 50
"""Rows of which the outermost 2 % are one: of fewer, no usual range can be told.
Steady, see `benchmarks/steady_limits.py`."""
_OUT = 0.5
"""Share of a record's usual range by which a value must leave both its neighbours; a boat does not in one row.
Twice as much finds the same, half of it
accuses quick turns at 1 Hz (`benchmarks/steady_limits.py`)."""
_STEPS = 10.0
"""Median steps by which a value must leave its neighbours, where the range is narrow: a jump, not a quick change.
Twice as much finds the same, half of it
accuses quick turns at 1 Hz (`benchmarks/steady_limits.py`)."""
_WHOLE = 0.8
"""Share of its whole range by which a record must jump in one row for a counter that turned over.
Steady, see `benchmarks/steady_limits.py`."""


def _examine(records: Sequence[Record]) -> Found:
    """Look for values that leave their neighbours and come back at once, and for jumps across the whole range.

    A finding for each channel at fault, or one that says that none is.
    """
    found = []
    for name in MOTION:
        channels = channels_called(records, name)
        found += _sentence(name, [channel for channel in channels if channel.time.size >= _LEAST_ROWS])
    return found or [About("spikes", value=0.0, unit="1").ok("no value stands out of its record")]


def _sentence(name: str, channels: Sequence[Channel]) -> list[Finding]:
    out = sum(int(np.count_nonzero(_spiked(channel.unwrapped))) for channel in channels)
    jumps = [float(jump) for channel in channels for jump in _jumps(channel.unwrapped)]
    if len(jumps) > 1 and not out:
        unit = channels[0].unit
        facts = {"jump": abs(jumps[0]), "unit": unit, "count": len(jumps)}
        share = _size(channels, _unwrapped).share  # of bends: all that follows a jump is wrong, whatever its power
        size = Size(share, share)
        fault = Fault(Kind.WRAPPED, (name,), size, facts, jumps[0], unit=unit)
        return [] if (found := fault.ruled()) is None else [found]
    if not out:
        return []
    share, size = out / sum(channel.time.size for channel in channels), _size(channels, _smoothed)
    row = max(channel.period for channel in channels)
    if row > QUICK_ROW and name not in ("x", "y"):
        text = f"{out} values of {name} stand far out of their record: spikes, or turns quicker than {1.0 / row:.2g} Hz"
        return [About("spikes", (name,), share, "1").note(text)]
    drop = partial(altered, names=(name,), change=lambda channel: channel.rows(~_spiked(channel.unwrapped)))
    fix = Fix(f"{out} values of {name} that stand far out of the record dropped", drop)
    fault = Fault(Kind.SPIKES, (name,), size, {"count": out, "part": 100.0 * share}, share, fix=fix)
    return [fault.in_words("defect" if size.refuses else "warning")]


def _size(channels: Sequence[Channel], mended: Callable[[Array], Array]) -> Size:
    """How much of the bends of records goes where they are mended, and over the records' own power."""
    rows, blocks = [], []
    for channel in channels:
        values = channel.unwrapped
        bends = [np.diff(one, 2) ** 2 for one in (values, mended(values))]
        blocks.append(((channel.time[1:-1] - channel.time[0]) // BLOCK).astype(np.int64))
        rows.append((*bends, (values[1:-1] - np.median(values)) ** 2))
    as_is, changed, power = (np.concatenate(column) for column in zip(*rows, strict=True))
    return size_of(as_is, changed, power, numbered_on(blocks))


def _smoothed(values: Array) -> Array:
    """The record (n,) with lines between the neighbours of values that stand out."""
    rows, out = np.arange(values.size), _spiked(values)
    return np.where(out, np.interp(rows, rows[~out], values[~out]), values)


def _unwrapped(values: Array) -> Array:
    """The record (n,) of a counter that goes on where it turned over: by its whole range."""
    steps, whole = np.diff(values), float(np.ptp(values))
    turns = np.where(np.isin(steps, _jumps(values)), -np.sign(steps), 0.0)
    return values + np.concatenate([[0.0], np.cumsum(turns)]) * (whole + float(np.median(np.abs(steps))))


def _spiked(values: Array) -> NDArray[np.bool_]:
    """Rows whose value leaves both neighbours, to one side, by half of the usual range."""
    low, high = np.quantile(values, [0.02, 0.98])
    steps = np.diff(values)
    least = max(_OUT * float(high - low), _STEPS * float(np.median(np.abs(steps))))
    result = np.zeros(values.size, dtype=bool)
    if least > 0.0:
        before, after = steps[:-1], steps[1:]
        result[1:-1] = (before * after < 0.0) & (np.minimum(np.abs(before), np.abs(after)) > least)
    return result


def _jumps(values: Array) -> Array:
    """Steps across the whole range of a record, each from one end to the other."""
    steps = np.diff(values)
    whole = _WHOLE * float(np.ptp(values))
    least = max(whole, 2.0 * _STEPS * float(np.median(np.abs(steps))))
    return steps[np.abs(steps) > least] if whole > 0.0 else steps[:0]


SPIKES = Check("spikes", _examine)
