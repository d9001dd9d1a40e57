"""The test by size that a refusal must pass: how much of what the model leaves unexplained an alleged fault explains.

A model of a real boat is never exactly true, and waves and noise move it, too, so that something is left of every sound
log, and what is left is correlated with something. A log is refused only where the model with the fault explains much
of it: the squared error with the fault is compared with that without it, over the same rows, and the share that it
takes away has a standard error by blocks of time that are left out one at a time (Kuensch 1989,
doi:10.1214/aos/1176347265). Where the share is not surely large, the finding warns with the numbers, and work goes on.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...physics.forces import modelled_acceleration
from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..statistics.quantiles import student
from .quick_motion import rates_in_band
from .record import RATE, Record

OVERWHELMING = 0.25
"""Share of the squared error that a fault must surely take away. Calibrated: frozen records and foreign commands of
`benchmarks/spoiling.py` take away 0.3 and more for sure, sound logs of `benchmarks/sound_logs.py` (tuning seeds) less
than 0.2."""
WIDE = (0.05, 1.0)
"""The band in which the model is asked [Hz]: from the slowest manoeuvre to the quickest answer of a small boat. Short
waves and the noise of speeds, which grows with frequency, lie above it."""
BLOCK = 10.0
"""Length of a block [s], as in `lags`: longer than waves and than what a boat remembers of a command."""
_FEWEST = 4
"""Blocks below which a share has no error: leaving out one of three says little of the rest."""
_LEVEL = 0.975
"""Quantile of either end of a 95 % interval."""

Altered = Callable[[Vehicle, Motion], tuple[Vehicle, Motion]]
"""Puts a fault into a vehicle or into the commands that drive it."""


@dataclass(frozen=True, slots=True)
class Share:
    """A share of the squared error, and its 95 % interval by blocks.

    Attributes
    ----------
    value : 1 where nothing is left, 0 where nothing is explained, negative where the fault makes it worse
    error : half of the interval; infinite where the blocks are too few
    """

    value: float
    error: float

    @property
    def low(self) -> float:
        """What it surely is at least."""
        return self.value - self.error

    @property
    def high(self) -> float:
        """What it surely is at most."""
        return self.value + self.error

    @property
    def overwhelming(self) -> bool:
        """Whether a log may be refused for the fault."""
        return self.low > OVERWHELMING

    def __str__(self) -> str:
        """In percent, for a sentence."""
        if not np.isfinite(self.error):
            return f"{100.0 * self.value:.0f} %, by too few blocks of time to be sure"
        return f"{100.0 * self.value:.0f} % +- {100.0 * self.error:.0f} %"


def share_explained(without: Array, with_fault: Array, block: NDArray[np.int64]) -> Share:
    """Share of the squared error that a fault takes away, with a jackknife over blocks.

    Parameters
    ----------
    without, with_fault : (n,) squared errors of the model without and with the fault, in the same rows; of both, what
        noise makes of them may be subtracted
    block : (n,) number of the block of each row
    """
    number = np.unique(block, return_inverse=True)[1] if block.size else block
    total, gain = (np.bincount(number, rows) for rows in (without, without - with_fault))
    if not total.sum() > 0.0:
        return Share(0.0, np.inf)
    value, count = float(gain.sum() / total.sum()), total.size
    rest = total.sum() - total
    if count < _FEWEST or not np.all(rest > 0.0):
        return Share(value, np.inf)
    each = (gain.sum() - gain) / rest
    error = float(np.sqrt((count - 1) / count * ((each - each.mean()) ** 2).sum()))
    return Share(value, student(count - 1, _LEVEL) * error)


def squared_held_out(
    target: Array, columns: Array, block: NDArray[np.int64], within: tuple[float, float] = (-np.inf, np.inf)
) -> Array:
    """Squared error (n,) of a linear fit of columns (n, p) to a target (n,), of each block by a fit to the others.

    Parameters
    ----------
    block : (n,) number of the block of each row, in rising order
    within : ends between which the coefficients of the columns are kept
    """
    number = np.unique(block, return_inverse=True)[1]
    size = np.sqrt((columns**2).mean(axis=0))
    table = columns / np.where(size > 0.0, size, 1.0)
    pairs = table[:, :, None] * np.column_stack([table, target])[:, None, :]
    gram = np.add.reduceat(pairs, np.flatnonzero(np.diff(number, prepend=-1)))
    others = gram.sum(axis=0) - gram
    found = (np.linalg.pinv(others[:, :, :-1], rcond=1e-9, hermitian=True) @ others[:, :, -1:])[:, :, 0]
    return (target - (table * np.clip(found, within[0] * size, within[1] * size)[number]).sum(axis=1)) ** 2


def blocks_of(rows: Sequence[int]) -> NDArray[np.int64]:
    """Numbers of the blocks of stretches with so many rows at `RATE`, one after the other."""
    length, found, begun = round(BLOCK * RATE), [np.zeros(0, dtype=np.int64)], 0
    for count in rows:
        found.append(begun + np.arange(count, dtype=np.int64) // length)
        begun += count // length + 1
    return np.concatenate(found)


def share_by_model(records: Sequence[Record], altered: Altered, meanwhile: Altered | None = None) -> Share | None:
    """How much of the error of the vehicle's accelerations of surge and yaw a fault takes away, when it is put into it.

    Parameters
    ----------
    records : of logs with a vehicle
    altered : the fault
    meanwhile : another fault that is taken for given, with and without the one in question

    Returns
    -------
    Share or None
        None without a vehicle whose commands are all known, or without motion.
    """
    before = meanwhile or (lambda vehicle, motion: (vehicle, motion))
    squared, rows = [], []
    for record in records:
        for stretch in record.stretches:
            motion = record.driven(stretch)
            if motion is None or record.vehicle is None or motion.time.size < round(BLOCK * RATE):
                continue
            given = before(record.vehicle, motion)
            nothing, says, told = (
                np.zeros((motion.time.size, 2)),
                *(modelled_acceleration(*pair)[:, [0, 2]] for pair in (given, altered(*given))),
            )
            velocity = motion.velocity[:, [0, 2]]
            squared.append(np.column_stack([rates_in_band(velocity, one, WIDE) ** 2 for one in (nothing, says, told)]))
            rows.append(motion.time.size)
    if not rows:
        return None
    table = np.concatenate(squared)
    size = table[:, :2].mean(axis=0)
    if not np.all(size > 0.0):
        return None
    return share_explained((table[:, 2:4] / size).sum(axis=1), (table[:, 4:] / size).sum(axis=1), blocks_of(rows))


def delayed(seconds: float) -> Altered:
    """The fault that commands come so much later than they are stamped [s]."""

    def alter(vehicle: Vehicle, motion: Motion) -> tuple[Vehicle, Motion]:
        rows = np.arange(motion.time.size, dtype=float) - seconds * RATE
        given = np.arange(motion.time.size, dtype=float)
        commands = np.column_stack([np.interp(rows, given, column) for column in motion.commands.T])
        return vehicle, replace(motion, commands=commands)

    return alter


def misplaced(turned: frozenset[str], moved: frozenset[str]) -> Altered:
    """The fault that the thrusters of some channels push the other way, and those of some sit on the other side."""

    def alter(vehicle: Vehicle, motion: Motion) -> tuple[Vehicle, Motion]:
        thrusters = tuple(
            one.model_copy(
                update={
                    "scale": -one.scale if one.channel in turned else one.scale,
                    "y": -one.y if one.channel in moved else one.y,
                }
            )
            for one in vehicle.thrusters
        )
        return vehicle.model_copy(update={"thrusters": thrusters}), motion

    return alter
