"""Checks of fixes: held, as a receiver of 5 Hz does on a grid of 10 Hz, and late, which makes the boat stop, then leap.

Also the fixes in a record of positions: when they came, how far the boat went between, and when they were taken.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ....physics.motion import Array
from ...canonical import Channel
from ...preparation.resampling import new_positions
from ...statistics.signals import noise_of_differences
from ..record import About, Channels, Check, Fix, Found, Reach, Record

_LEAST = 20
"""Fixes of a moving boat from which something can be said."""
_TOGETHER = 4
"""Steps between fixes that are taken together to find the beat."""
_OFF = 0.25
"""Share of the beat by which a step between fixes must miss a whole number of beats to be off."""
_BREAK = 5.0
"""Beats without a fix after which the beat is looked for anew."""
_LONGEST_REST = 120.0
"""Rest during which an old fix is repeated on every beat [s]: over a longer one it would be most of the log."""
_RESTART = 50
"""Fixes within which a step that is too short says that the first ones were late, and not that the beat moved."""


@dataclass(frozen=True, slots=True, eq=False)
class Fixes:
    """The fixes in the position channels of one log.

    Attributes
    ----------
    row : (k,) rows at which a new position appears
    time : (k,) their stamps [s]
    position : (k, 2) [m]
    rows : usual number of rows from one fix to the next, 1 where every row is new
    beat : usual time from one fix to the next [s]
    step : usual time from row to row [s]
    moving : (k - 1,) whether the boat moved plainly between two fixes
    off : (k - 1,) whether the step between two fixes misses a whole number of beats
    whole : (k - 1,) that whole number, at least 1
    digit : last digit of the positions, where the boat usually goes but one from fix to fix [m]: whether a position is
        held, or rounded, nobody can tell then; else 0
    """

    row: NDArray[np.int64]
    time: Array
    position: Array
    rows: int
    beat: float
    step: float
    moving: NDArray[np.bool_]
    off: NDArray[np.bool_]
    whole: NDArray[np.int64]
    digit: float

    @property
    def slope(self) -> float | None:
        """Share of its surplus time in which the boat moved on, in steps that are off: 1 for honest stamps, 0 for late.

        None where too few such steps lie within straight motion.
        """
        length = np.hypot(*np.diff(self.position, axis=0).T)
        pace = length / (self.whole * self.beat)
        between = np.flatnonzero(self.off & self.moving)
        between = between[(between > 0) & (between < self.off.size - 1)]
        usual = 0.5 * (pace[between - 1] + pace[between + 1])
        calm = (np.abs(pace[between - 1] - pace[between + 1]) < 0.3 * usual) & (usual > 0.0)
        if np.count_nonzero(calm) < 4:
            return None
        at = between[calm]
        surplus = np.diff(self.time)[at] / (self.whole[at] * self.beat) - 1.0
        moved = pace[at] / usual[calm] - 1.0
        return float(surplus @ moved / (surplus @ surplus))

    @property
    def spikes(self) -> float:
        """How far off the stamps as they are make the speed [m/s]: 95th percentile of a moving boat's wrong speeds."""
        raw, right = (np.gradient(self.position, time, axis=0) for time in (self.time, self.retimed()))
        error = np.hypot(*(raw - right).T)[1:][self.moving]
        error = error[error > 0.0]
        return float(np.quantile(error, 0.95)) if error.size else 0.0

    @property
    def between(self) -> float:
        """Steps that are neither on the beat nor off it, for each that is off: none for late fixes, many for jitter."""
        steps = np.diff(self.time) / self.beat
        astray = np.abs(steps - np.maximum(np.rint(steps), 1.0))
        off = np.count_nonzero(self.off)
        return float(np.count_nonzero((astray > 0.5 * _OFF) & ~self.off) / off) if off else 0.0

    @property
    def noise_speed(self) -> float:
        """Speed that the noise of the fixes alone seems to be, on the beat [m/s]: its 95th percentile.

        From second differences; a central difference over two beats is 1/sqrt(2) /
        beat, and the length of two such has its 95th percentile at sqrt(-2 ln 0.05).
        """
        good = self.moving & ~self.off & (self.whole == 1)
        bend = np.diff(self.position, n=2, axis=0)[good[1:] & good[:-1]]
        if not bend.size:
            return 0.0
        sigma = noise_of_differences(bend, 2)
        return float(np.sqrt(-2.0 * np.log(0.05)) * sigma / np.sqrt(2.0) / self.beat)

    def retimed(self) -> Array:
        """When the fixes were taken, (k,) [s]: those that came late are put back on the beat, the others stay."""
        times = self.time.copy()
        bounds = np.flatnonzero(np.diff(self.time) > _BREAK * self.beat) + 1
        for start, stop in zip([0, *bounds], [*bounds, times.size], strict=True):
            times[start:stop] = _on_beat(self.time[start:stop], self.beat)
        return times


def fixes_of(channels: Channels) -> Fixes | None:
    """Find the fixes in the channels of a log; None without positions, or where x and y do not come together."""
    found = new_positions(channels)
    if found is None or found[0].size < _LEAST:
        return None
    row, time, position = found
    length = np.hypot(*np.diff(position, axis=0).T)
    # A boat at rest shows a new position now and then only: a fix is as fine as its last digit.
    moving = length > 0.3 * np.quantile(length, 0.9)
    spans = np.diff(row)
    steps = np.diff(time)
    # A late fix makes one step longer and the next one shorter; over four steps that is little.
    whole = np.convolve(moving, np.ones(_TOGETHER), "valid") == _TOGETHER
    if not whole.any():
        return None
    rows, beat = (
        float(np.median(np.convolve(part, np.ones(_TOGETHER), "valid")[whole])) / _TOGETHER for part in (spans, steps)
    )
    rows = max(1, round(rows))
    whole = np.maximum(np.rint(steps / beat), 1)
    # A step of one and a half beats is off, whichever way it is rounded.
    off = np.abs(steps / beat - whole) > _OFF
    # One that came late, or after a late one, is as many beats long as it is without what it is late by.
    whole = np.where(off, np.maximum(np.floor(steps / beat + _OFF), 1), whole).astype(np.int64)
    digits = np.array([_last_digit(column) for column in position.T])
    usual = np.median(np.abs(np.diff(position, axis=0))[moving].max(axis=1, initial=0.0, where=digits > 0.0))
    digit = float(digits.max()) if usual < 1.5 * digits.max() else 0.0  # one of them, not two
    return Fixes(row, time, position, rows, beat, channels["x"].period, moving, off, whole, digit)


def _last_digit(values: Array) -> float:
    """What all values (n,) are whole multiples of, but for where they begin; 0 where there is no such step."""
    unique = np.unique(values)
    gaps = np.diff(unique)
    gaps = gaps[gaps > 1e-6 * np.ptp(values)]  # not the rounding of a latitude
    if not gaps.size:
        return 0.0
    number = (unique - unique[0]) / gaps.min()
    return float(gaps.min()) if np.abs(number - np.rint(number)).max() < 0.1 else 0.0


def _on_beat(time: Array, beat: float) -> Array:
    """Put late fixes of one unbroken stretch back on the beat; a fix never comes before it was taken."""
    late = 0.0
    taken = time.copy()
    place = 1
    while place < time.size:
        since = late + time[place] - time[place - 1]
        ahead = since - max(1.0, np.floor(since / beat + _OFF)) * beat
        if ahead < -_OFF * beat and place <= _RESTART and taken[0] == time[0]:
            # Too short a step: the ones before were late, from the first on.
            taken[0], late, place = time[0] + ahead, -ahead, 1
            continue
        late = ahead if ahead > _OFF * beat else 0.0
        taken[place] = time[place] - late
        place += 1
    return taken


def at_fixes(channels: Channels, taken: Callable[[Fixes], Array]) -> dict[str, Channel]:
    """The same channels with x and y at the fixes only, taken at stamps (k,) that these tell.

    A boat at rest shows no new position for many beats; there the old one is repeated on every beat, which is what the
    receiver measured. Where it moved, beats without a fix stay empty.

    Parameters
    ----------
    channels : of the log
    taken : tells when each fix was taken (k,) [s]
    """
    fixes = fixes_of(channels)
    if fixes is None:
        return dict(channels)
    time = taken(fixes)
    idle = ~fixes.moving & (fixes.whole > 1) & (fixes.whole * fixes.beat < _LONGEST_REST)
    stamps, rows = [time], [fixes.row]
    for k in np.flatnonzero(idle):
        more = time[k] + fixes.beat * np.arange(1, fixes.whole[k])
        more = more[more < time[k + 1] - 0.5 * fixes.beat]
        stamps.append(more)
        rows.append(np.full(more.size, fixes.row[k]))
    every, row = np.concatenate(stamps), np.concatenate(rows)
    order = np.argsort(every, kind="stable")
    result = dict(channels)
    for name in ("x", "y"):
        result[name] = replace(result[name], time=every[order], value=result[name].value[row[order]])
    return result


def _held(records: Sequence[Record]) -> Found:
    """Count how often a position is new."""
    if not any({"x", "y"} <= set(record.log.channels) for record in records):
        return []
    about = About("held fixes", ("x", "y"))
    every = [fixes_of(record.log.channels) for record in records]
    found = [fixes for fixes in every if fixes is not None and np.count_nonzero(fixes.moving) >= _LEAST]
    if not found:
        return about.untold("the boat moves too little to tell how often its position is measured")
    digit = max(fixes.digit for fixes in found)
    if digit > 0.0:
        text = f"positions are rounded to {digit:.2g} m, as far as the boat goes from one new position to the next"
        return about.note(
            f"{text}: how often they are measured cannot be told",
            value=digit,
            unit="m",
            consequence="a speed made of them is as coarse",
            remedy="log positions to the centimetre, or log speeds",
        )
    beat, step, rows = np.median([(fixes.beat, fixes.step, fixes.rows) for fixes in found], axis=0).tolist()
    about = replace(about, value=1.0 / beat, unit="Hz")
    if rows < 2:
        return about.ok(f"positions are new in every row, {1.0 / beat:.3g} a second")
    return about.warning(
        f"positions are measured {1.0 / beat:.3g} times a second and held in between, over "
        f"{rows:.0f} rows of {step:.3g} s",
        consequence="a speed taken from row to row is zero, then too large",
        remedy="use a position only where it is new",
        fix=Fix("rows that repeat a position dropped from x and y", partial(at_fixes, taken=lambda fixes: fixes.time)),
        short=f"positions are held over {rows:.0f} rows",
    )


HELD_FIXES = Check("held fixes", _held)


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


def _late(records: Sequence[Record]) -> Found:
    """Look for steps between fixes that miss the beat, and whether the boat moved as the stamps say."""
    if not any({"x", "y"} <= set(record.log.channels) for record in records):
        return []
    every = [fixes_of(record.log.channels) for record in records]
    known = [fixes for fixes in every if fixes is not None and not fixes.digit]
    found = [fixes for fixes in known if np.count_nonzero(fixes.moving) >= _LEAST]
    about = About("late fixes", ("x", "y"))
    if not found:
        return about.untold("the boat moves too little, or positions are too coarse, to tell whether fixes come late")
    off = np.concatenate([fixes.off for fixes in found])
    share = float(off.mean())
    about = replace(about, value=share, unit="1")
    if share < _OFTEN:
        return about.ok(f"fixes come on their beat ({100.0 * share:.1f} % of the steps between them do not)")
    late = float(np.median(np.concatenate([np.abs(np.diff(f.time) - f.beat * f.whole)[f.off] for f in found])))
    slopes = [(s, np.count_nonzero(f.off & f.moving)) for f in found if (s := f.slope) is not None]
    each = {r.log.name: float(f.off.mean()) for r, f in zip(records, every, strict=True) if f in found}
    worst = sorted((name for name in each if each[name] > _OFTEN), key=lambda name: -each[name])[:_TOLD]
    where = f" ({', '.join(f'{name} {100.0 * each[name]:.0f} %' for name in worst)})" if len(records) > 1 else ""
    told = f"{100.0 * share:.0f} % of the steps between fixes{where} are {late:.2g} s too long or too short"
    row = max(_row(record.log.channels, f) for record, f in zip(records, every, strict=True) if f is not None)
    if late < _ROW * row:
        return about.note(f"{told}: the stamps jitter, and no fix is late by a row of {row:.2g} s")
    if not slopes:
        return about.untold(
            f"{told}; the boat moves too little there to tell whether the fixes or their stamps are off"
        )
    slope = sum(s * n for s, n in slopes) / sum(n for _, n in slopes)
    if slope > _REAL:
        return about.note(
            f"{told}, and the boat moves as the stamps say: the fixes are irregular, their stamps are right"
        )
    between = np.average([f.between for f in found], weights=[np.count_nonzero(f.off) for f in found])
    if between > _JITTER:
        return about.note(f"{told}, and more still by half of that: the stamps jitter, and no fix is late by a row")
    spikes, noise = max(f.spikes for f in found), min(f.noise_speed for f in found)
    if spikes < noise:
        return about.note(f"{told}; the noise of the positions hides what that does to speeds ({noise:.2g} m/s)")
    return about.finding(
        "defect",
        f"{told}, but the boat goes on evenly: these fixes came {late:.2g} s late",
        consequence=f"speeds from positions have false spikes of up to +-{spikes:.2g} m/s",
        remedy="put late fixes back on their beat",
        fix=Fix(f"late fixes put back on their beat of {found[0].beat:.3g} s", partial(at_fixes, taken=Fixes.retimed)),
        parts={"late": late, "spikes": spikes},
        short=f"position fixes come late ({100.0 * share:.0f} % of the steps between them)",
        reach=Reach.SECONDS,
    )


def _row(channels: Channels, fixes: Fixes) -> float:
    """Time from row to row of the logger [s]; 0 where only the positions show it, which may be without held rows."""
    periods = [channel.period for name, channel in channels.items() if name not in ("x", "y")]
    row = min((period for period in periods if period > 0.0), default=np.inf)
    return row if row < 1.1 * fixes.step else 0.0


LATE_FIXES = Check("late fixes", _late)
