"""Check of commands cut at a limit: at its largest recorded command, the boat is driven as if they went on.

While no command moves, the thrusters' force is constant, and the rest of the motion is hull, waves and noise. Where
accelerations change much, or by fits, while commands stand at their extremes, and little while they stand elsewhere,
thrusters worked beyond their record; waves never rest between.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ....physics.motion import Array
from ...statistics.blocks import student
from ..faults import BLOCK, FEWEST, Fault, Kind, Share, Size, blocks_of, ratio_by_blocks, size_of
from ..quick_motion import LEAST, Part, neutral_of, parts_of, push_range, unexplained
from ..record import RATE, STEP, About, Check, Found, Record

_NEAR = 0.02
"""Share of its range within which a command is at an end of it: what rounding takes from a limit."""
_BAND = (0.01, 2.0)
"""Band in which differentiated speeds are compared [Hz]: nothing slower, so that what rings on in a filter after a
command changed is a straight line while it stands; nothing quicker than a boat answers."""
_SLOWLY = (0.01, 0.2)
"""Band in which differentiated speeds are compared with thrust [Hz]: slower than the waves that a small boat meets, and
quicker than a current turns."""
_ROWS = round(2.0 / STEP)
"""Length of a piece, one straight line: short, for commands seldom stand for long, and of one length everywhere, for
the shorter it is, the more of waves it takes with it."""


def _examine(records: Sequence[Record]) -> Found:
    """Compare what nothing explains at the extremes of the commands with what nothing explains elsewhere.

    One finding for all commands, or none where they hardly stand at an extreme.
    """
    having, names, every = parts_of(records, _BAND)
    if not every or not all(part.modelled for part in every):
        return []  # without a model, what follows a change of the commands late would be taken for their doing
    logged = [record.log.channels[name].period for record in having for name in "ur" if name in record.log.channels]
    if 2.0 * _BAND[1] * max(logged, default=0.0) > 1.0:
        return []  # two samples a period at least (Nyquist): fewer do not hold the band
    parts, rows = zip(*(_stand_by_stand(part) for part in every), strict=True)
    commands = np.concatenate([part.commands[use] for part, use in zip(parts, rows, strict=True)])
    rests = np.array([neutral_of(having, name) is not None for name in names])
    extreme = _extreme(commands, parts, rests)[::_ROWS]
    # At rest, waves show less.
    elsewhere = np.asarray(~extreme.any(axis=1) & (np.abs(commands[::_ROWS]) > _NEAR).any(axis=1))
    at = [k for k in range(len(names)) if extreme[:, k].sum() * _ROWS * STEP >= LEAST]
    if not at:
        return []
    rates = np.concatenate([part.rates[use] for part, use in zip(parts, rows, strict=True)])
    left, motion = ((table.reshape(-1, _ROWS, 2) ** 2).mean(axis=1) for table in (unexplained(parts, rows), rates))
    block = blocks_of([part.residual.shape[0] for part in parts])[np.concatenate(rows)][::_ROWS]
    noise = np.max([part.noise for part in parts], axis=0) ** 2
    ranges = [push_range(having, name) for name in names]
    most = np.sum([newtons * np.abs(made) for newtons, made in ranges], axis=0) ** 2
    slowly, found = _slow_weight(having), []
    for k in at:
        for axis in range(2):
            power = np.minimum(motion[:, axis], most[axis] + noise[axis])
            told = _beyond(left[:, axis], power, extreme[:, k], elsewhere, float(noise[axis]), block)
            if told is not None:
                found.append((Size(told[0], slowly), told[1], names[k]))
    if not any(size.likely for size, *_ in found):
        text = "while the commands stand at their largest, the boat hardly moves beyond what they say"
        return About("limited", tuple(names)).ok(text)
    size, cause, _ = max(found, key=lambda one: (one[0].share.low, one[0].share.value))
    facts = {"seconds": float(extreme.any(axis=1).sum()) * _ROWS * STEP, "cause": cause}
    sure = tuple(dict.fromkeys(name for one, _, name in found if one.likely))
    return Fault(Kind.CUT, sure, size, facts).ruled()


_CUT = "their record is cut at a limit, and the thrusters worked beyond it"


def _beyond(
    left: Array,
    motion: Array,
    extreme: NDArray[np.bool_],
    elsewhere: NDArray[np.bool_],
    noise: float,
    block: NDArray[np.int64],
) -> tuple[Share, str] | None:
    """How much of what is left at an extreme is more than elsewhere, or comes by fits, and the words for it.

    None where it is little of the motion while the command stands there, or more than all of it, or than thrusters can
    make: a vehicle that leaves more than there is answers to noise and waves, and what it leaves is its own.

    Parameters
    ----------
    left, motion : (pieces,) power of what is left of accelerations, and of all of them, as far as thrusters can make it
    extreme, elsewhere : (pieces,) whether the command stands at an extreme, and whether none does
    noise : power that the sensors' noise makes of it
    """
    there, apart = left[extreme] - noise, left[elsewhere] - noise
    if not noise < there.mean() <= motion[extreme].mean() - noise:
        return None
    usual = {"it comes by fits, with stillness between: " + _CUT: np.inf}
    if there.size * _ROWS / RATE >= FEWEST * BLOCK:
        # Of the square of one normal number, the quarter's quantile over the mean: motion of one degree of freedom a
        # piece, as swell is at least, is no quieter in its quietest quarter.
        quarter = student(1e6, 0.625) ** 2
        usual = dict.fromkeys(usual, float(np.quantile(there, 0.25)) / quarter)
    if apart.size:
        calm = ratio_by_blocks(apart, np.ones(apart.size), block[elsewhere]).high
        usual["much less while they stand elsewhere: " + _CUT] = calm
    cause, least = min(usual.items(), key=lambda one: one[1])
    if np.isfinite(least):
        size = size_of(there, np.full(there.size, max(least, 0.0)), motion[extreme] - noise, block[extreme])
        if size.likely:
            return size.share, cause
    if not apart.size and size_of(there, 0.0 * there, motion[extreme] - noise, block[extreme]).likely:
        return Share(1.0, np.inf), f"they push nowhere else: {_CUT}, or waves throw the boat about as much"
    return None


def _slow_weight(records: Sequence[Record]) -> Share:
    """The power of what the vehicle leaves of the slow motion, over that of its thrust there, of the axis with more.

    Thrusters that worked beyond their record leave much of it, whatever they did; waves are quicker, and leave little.
    An axis in which thrust makes less than the sensors' noise, as yaw of a boat whose screws turn alike, tells nothing.
    """
    parts = parts_of(records, _SLOWLY)[2]
    block = blocks_of([part.residual.shape[0] for part in parts])
    left = np.concatenate([part.residual for part in parts]) ** 2
    thrust = np.concatenate([part.pushes.sum(axis=1) for part in parts]) ** 2
    pushed = np.flatnonzero(thrust.mean(axis=0) > np.max([part.noise for part in parts], axis=0) ** 2)
    told = (ratio_by_blocks(left[:, k], thrust[:, k], block) for k in pushed)
    return max(told, key=lambda one: one.low, default=Share(0.0, np.inf))


def _stand_by_stand(part: Part) -> tuple[Part, NDArray[np.bool_]]:
    """The part less a straight line for each time that no command moves, and which rows these are.

    A constant is the thrusters' force, known or not; a slope is what a wake, a current or a filter makes of them.
    """
    line = np.linalg.qr(np.vander(np.arange(_ROWS, dtype=float), 2))[0]
    left, rates, states = part.residual.copy(), part.rates.copy(), tuple(table.copy() for table in part.states)
    stands = np.asarray(part.stands.all(axis=1))
    for first, last in np.flatnonzero(np.diff(stands, prepend=False, append=False)).reshape(-1, 2).tolist():
        whole = first + (last - first) // _ROWS * _ROWS
        stands[whole:last] = False
        if whole == first:
            continue
        for table in (left, rates, *states):
            pieces = table[first:whole].reshape(-1, _ROWS, table.shape[1])
            table[first:whole] = (pieces - line @ (line.T @ pieces)).reshape(whole - first, -1)
    return replace(part, residual=left, rates=rates, states=states), stands


def _extreme(commands: Array, parts: Sequence[Part], rests: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether each command (n, c) stands at an end of its range: what never moves has none, and rest, if it is seen."""
    every = np.concatenate([part.commands for part in parts])
    largest, least = every.max(axis=0), every.min(axis=0)
    near = _NEAR * (largest - least)
    moves = largest > least
    ahead, astern = (moves & (~rests | (end > _NEAR)) for end in (largest, -least))
    return ((commands >= largest - near) & ahead) | ((commands <= least + near) & astern)


LIMITED = Check("limited", _examine)
