"""Check of late fixes: one that is a row late makes the boat stop, then leap."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from ..finding import Channels, Check, Finding, Fix, Reach
from ..fixes import LEAST, Fixes, at_fixes, fixes_of
from ..record import Record

_OFTEN = 0.01
"""Share of steps that are off from which fixes come late, and not now and then."""
_TOLD = 5
"""Logs that are told by name: a line."""
_REAL = 0.5
"""Surplus way over surplus time in a step that is off: 1 for honest stamps, 0 where only the stamp is off."""
_ROW = 0.6
"""Share of a row that a fix must be late: rows are what a logger writes, and a fix waits for the next one."""
_JITTER = 0.5
"""Steps half off the beat, for each that is off, from which all stamps jitter; a late fix is late by a whole row."""


def _examine(records: Sequence[Record]) -> list[Finding]:
    """Look for steps between fixes that miss the beat, and whether the boat moved as the stamps say."""
    if not any({"x", "y"} <= set(record.log.channels) for record in records):
        return []
    every = [fixes_of(record.log.channels) for record in records]
    known = [fixes for fixes in every if fixes is not None and not fixes.digit]
    found = [fixes for fixes in known if np.count_nonzero(fixes.moving) >= LEAST]
    finding = partial(Finding, check="late fixes", channels=("x", "y"))
    if not found:
        text = "the boat moves too little, or positions are too coarse, to tell whether fixes come late"
        return [finding(verdict="cannot tell", sentence=text)]
    off = np.concatenate([fixes.off for fixes in found])
    share = float(off.mean())
    finding = partial(finding, value=share, unit="1")
    if share < _OFTEN:
        text = f"fixes come on their beat ({100.0 * share:.1f} % of the steps between them do not)"
        return [finding(verdict="ok", sentence=text)]
    late = float(np.median(np.concatenate([np.abs(np.diff(f.time) - f.beat * f.whole)[f.off] for f in found])))
    slopes = [(s, np.count_nonzero(f.off & f.moving)) for f in found if (s := f.slope) is not None]
    each = {r.log.name: float(f.off.mean()) for r, f in zip(records, every, strict=True) if f in found}
    worst = sorted((name for name in each if each[name] > _OFTEN), key=lambda name: -each[name])[:_TOLD]
    where = f" ({', '.join(f'{name} {100.0 * each[name]:.0f} %' for name in worst)})" if len(records) > 1 else ""
    told = f"{100.0 * share:.0f} % of the steps between fixes{where} are {late:.2g} s too long or too short"
    row = max(_row(record.log.channels, f) for record, f in zip(records, every, strict=True) if f is not None)
    if late < _ROW * row:
        text = f"{told}: the stamps jitter, and no fix is late by a row of {row:.2g} s"
        return [finding(verdict="note", sentence=text)]
    if not slopes:
        text = f"{told}; the boat moves too little there to tell whether the fixes or their stamps are off"
        return [finding(verdict="cannot tell", sentence=text)]
    slope = sum(s * n for s, n in slopes) / sum(n for _, n in slopes)
    if slope > _REAL:
        text = f"{told}, and the boat moves as the stamps say: the fixes are irregular, their stamps are right"
        return [finding(verdict="note", sentence=text)]
    spikes = max(f.spikes for f in found)
    between = np.average([f.between for f in found], weights=[np.count_nonzero(f.off) for f in found])
    if between > _JITTER:
        text = f"{told}, and more still by half of that: the stamps jitter, and no fix is late by a row"
        return [finding(verdict="note", sentence=text)]
    noise = min(f.noise_speed for f in found)
    if spikes < noise:
        text = f"{told}; the noise of the positions hides what that does to speeds ({noise:.2g} m/s)"
        return [finding(verdict="note", sentence=text)]
    return [
        finding(
            verdict="defect",
            sentence=f"{told}, but the boat goes on evenly: these fixes came {late:.2g} s late",
            consequence=f"speeds from positions have false spikes of up to +-{spikes:.2g} m/s",
            remedy="put late fixes back on their beat",
            fix=Fix(
                f"late fixes put back on their beat of {found[0].beat:.3g} s",
                partial(at_fixes, taken=Fixes.retimed),
            ),
            parts={"late": late, "spikes": spikes},
            short=f"position fixes come late ({100.0 * share:.0f} % of the steps between them)",
            reach=Reach.SECONDS,
        )
    ]


def _row(channels: Channels, fixes: Fixes) -> float:
    """Time from row to row of the logger [s]; 0 where only the positions show it, which may be without held rows."""
    periods = [channel.period for name, channel in channels.items() if name not in ("x", "y")]
    row = min((period for period in periods if period > 0.0), default=np.inf)
    return row if row < 1.1 * fixes.step else 0.0


LATE_FIXES = Check("late fixes", _examine)
