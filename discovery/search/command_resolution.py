"""What a coarse record of the commands leaves open: by up to half of its step, each level may not be what drove.

A boat that is steered by a few levels is driven by a few constant errors then, and those look like a thruster's curve,
and like drag that goes with the speeds they make. So an effect must earn its price beside an error of each level.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...physics.frames import Array
from ...physics.motion import Motion
from .beside_errors import Beside
from .floating import Search, State

_COARSE, _DESIGNED = 0.01, 0.1
"""Share of the largest command from which a step is coarse, and above which levels were chosen by whoever drove."""
_LEVELS, _MOST = 5, 48
"""Levels that tell a step, not two numbers that happen to fit; and so many that their errors are as good as noise."""
_HELD = 20
"""Rows on which a level is held: on others commands are the mean of two."""
_SAME = 1e-5
"""Share of the largest command by which two levels are one, and a remainder is none."""


@dataclass(frozen=True, slots=True, eq=False)
class CoarseRecord:
    """Levels that the record of some commands is made of.

    Attributes
    ----------
    columns : of the commands that have them; a level of two thrusters is one number, rounded once
    levels : (n,) at which commands were held, in their unit
    step : of which all levels are multiples
    """

    columns: tuple[int, ...]
    levels: Array
    step: float


def coarse_records(motions: Sequence[Motion]) -> tuple[CoarseRecord, ...]:
    """The coarse steps in which commands were recorded: one for all thrusters, or those of each; none where fine."""
    every = tuple(range(len(motions[0].thrusters)))
    together = _coarse(motions, every)
    return (together,) if together else tuple(filter(None, (_coarse(motions, (column,)) for column in every)))


def leaves_structure(search: Search, state: State) -> bool:
    """Whether a model leaves force that neither sensor noise nor the resolution of the commands' record explains."""
    if not search.leaves_structure(state.fit.held_out):
        return False
    records = coarse_records(search.balance.motions)
    if not records:
        return True
    return search.leaves_structure(Beside(search, _errors_of_levels(search, records, state), state).error)


def _errors_of_levels(search: Search, records: Sequence[CoarseRecord], state: State) -> Array:
    """What half a step of each level adds to the balance of a model, (tests, 3, levels)."""
    balance, vehicle = search.balance, state.vehicle
    levels = [(record, at) for record in records for at in range(record.levels.size)]
    moved = ([_displaced(motion, *level) for motion in balance.motions] for level in levels)
    rest = balance.balance(vehicle)
    return np.stack([rest - balance.recorded(motions, vehicle) for motions in moved], axis=2)


def _coarse(motions: Sequence[Motion], columns: tuple[int, ...]) -> CoarseRecord | None:
    every = [motion.commands[:, column] for motion in motions for column in columns]
    largest = float(np.ptp(np.concatenate(every)))
    if largest == 0.0:
        return None
    held = np.concatenate([column[_held(column, _SAME * largest)] for column in every])
    rounded, counts = np.unique(np.round(held / (_SAME * largest)), return_counts=True)
    levels = rounded[counts >= _HELD] * _SAME * largest
    if not _LEVELS <= levels.size <= _MOST:
        return None
    step = 0.0
    for gap in np.diff(levels):
        step = _common(float(gap), step, 4.0 * _SAME * largest)
    return CoarseRecord(columns, levels, step) if _COARSE * largest <= step <= _DESIGNED * largest else None


def _held(commands: Array, same: float) -> NDArray[np.bool_]:
    """Rows on which a command is what it is on the row before and on the row after: no mean of two levels."""
    still = np.abs(np.diff(commands)) <= same
    return np.concatenate([[False], still[:-1] & still[1:], [False]])


def _common(one: float, other: float, least: float) -> float:
    """The greatest common measure of two lengths, to within the least one that counts (Euclid)."""
    while other > least:
        one, other = other, abs(one - other * round(one / other))
    return one


def _displaced(motion: Motion, record: CoarseRecord, at: int) -> Motion:
    """The motion under commands of which one level is displaced by half a step.

    A row on which no level is held has a share of the level before it and of the one after it.
    """
    past = np.empty((0, motion.commands.shape[1])) if motion.run_up is None else motion.run_up
    commands = np.concatenate([past, motion.commands])
    row = np.arange(len(commands))
    for column in (commands[:, k] for k in record.columns):
        rows = np.flatnonzero(_held(column, _SAME * float(np.ptp(record.levels))))
        if not rows.size:
            continue
        before = rows[np.maximum(np.searchsorted(rows, row, side="right") - 1, 0)]
        after = rows[np.minimum(np.searchsorted(rows, row), rows.size - 1)]
        gap = column[after] - column[before]
        share = np.clip((column - column[before]) / np.where(gap == 0.0, 1.0, gap), 0.0, 1.0)
        nearest = np.abs(column[:, None] - record.levels).argmin(axis=1) == at
        column += 0.5 * record.step * ((1.0 - share) * nearest[before] + share * nearest[after])
    run_up = None if motion.run_up is None else commands[: len(past)]
    return replace(motion, commands=commands[len(past) :], run_up=run_up)
