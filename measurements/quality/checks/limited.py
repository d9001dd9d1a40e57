"""Whether the record of the commands is cut at a limit: at its largest, the boat is driven as if they went on.

While no command moves, the thrusters' force is constant, whatever it is, and the rest of the motion is hull, waves and
noise, wherever the commands stand. Where accelerations change much while they stand at their extremes and little while
they stand elsewhere, thrusters worked beyond their record. So they did where accelerations change by fits while they
stand at their extremes, with stillness between: a hidden step of a thruster is over in a moment, and waves never rest.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray

from ....physics.frames import Array
from ...statistics.quantiles import fisher
from ..fault_size import Share, blocks_of, share_explained
from ..finding import Check, Finding, Reach
from ..quick_motion import LEAST, STEP, Part, parts_of, unexplained
from ..record import Record
from ..resting import neutral_of

_NEAR = 0.02
"""Share of its range within which a command is at an end of it: what rounding takes from a limit."""
_PUSH = 0.2
"""Share of the largest command from which an end of its range is a push."""
_BAND = (0.01, 2.0)
"""What is kept of the motion [Hz]: nothing slower, so that what rings on in a filter after a command changed is a
straight line while it stands; nothing quicker than a boat answers."""
_ROWS = round(2.0 / STEP)
"""Of one straight line: short, for commands seldom stand for long, and of one length everywhere, for the shorter it is,
the more of waves it takes with it."""
_FREE = 4
"""Degrees of freedom of a piece of motion: it holds eight at 2 Hz in 2 s, and swell gives half of them."""
_CHANCE = 1e-3
"""Of calling waves a limit, which are as high by chance where commands stand at their extremes and low elsewhere."""
_PART, _TIMES, _NOISE = 0.15, 2.0, 2.0
"""Share of the boat's accelerations, times what is left elsewhere, and times the sensors' noise, from which it is sure:
records cut at a third of full thrust leave 0.2 to 0.35 in yaw, and 2.5 to 5 times as much as elsewhere; sound ones,
that lack effects too, up to 0.02 in calm water, and in waves the same everywhere."""
_FITFUL, _PIECES, _BURST = 0.2, 20, 0.1
"""Share of all that is left, its own noise apart, below which the quietest quarter of straight lines is still, how many
lines it takes to see that, and the share of the boat's accelerations from which fits are sure: waves leave 0.33 or more
in the quietest quarter, records cut at a third 0.00 to 0.26."""
_SLOWLY = (0.01, 0.2)
"""Slower than the waves that a small boat meets, and quicker than a current turns [Hz]."""
_CUT = "their record is cut at a limit, and the thrusters worked beyond it"


@final
class Limited(Check):
    """Compares what nothing explains at the extremes of the commands with what nothing explains elsewhere."""

    name: ClassVar[str] = "limited"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: one finding for all commands, or none where they hardly stand at an extreme."""
        having, names, parts = parts_of(records, _BAND)
        if not parts or not all(part.modelled for part in parts):
            return []  # without a model, what follows a change of the commands late would be taken for their doing
        parts, rows = zip(*(_stand_by_stand(part) for part in parts), strict=True)
        commands = np.concatenate([part.commands[use] for part, use in zip(parts, rows, strict=True)])
        rests = np.array([neutral_of(having, name) is not None for name in names])
        extreme = _extreme(commands, parts, rests)
        elsewhere = ~extreme.any(axis=1) & (np.abs(commands) >= _PUSH).any(axis=1)  # at rest, waves show less
        at = [k for k in range(len(names)) if extreme[:, k].sum() * STEP >= LEAST]
        if not at:
            return []
        left = unexplained(parts, rows, rows, driven=False)
        usual = np.sqrt((np.concatenate([part.rates for part in parts]) ** 2).mean(axis=0))
        noise = np.max([part.noise for part in parts], axis=0)
        size = np.sqrt([(left[extreme[:, k]] ** 2).mean(axis=0) for k in at])
        fitful = np.array([_by_fits(left[extreme[:, k]], noise) for k in at]) & (size > _BURST * usual)
        beyond = ((size > _PART * usual) | fitful) & (size > _NOISE * noise)
        share = float(np.max((size / np.where(usual > 0.0, usual, np.inf))[beyond], initial=0.0))
        seconds = float(extreme.any(axis=1).sum()) * STEP
        if not beyond.any():
            text = "while the commands stand at their largest, the boat hardly moves beyond what they say"
            return [Finding(check=self.name, verdict="ok", sentence=text, channels=tuple(names))]
        told = (
            f"while the commands stand at their largest, for {seconds:.0f} s, {100.0 * share:.0f} % of the quick "
            "motion has no cause in the log"
        )
        pieces = int(elsewhere.sum()) // _ROWS
        calm = np.sqrt((left[elsewhere] ** 2).mean(axis=0)) if pieces else np.zeros(2)
        many = (extreme[:, at].sum(axis=0) // _ROWS).tolist()
        ratio = np.sqrt([[fisher(_FREE * k, _FREE * max(pieces, 1), 1.0 - _CHANCE)] for k in many])
        surely = beyond & (fitful | (size >= np.maximum(_TIMES, ratio) * calm))
        if not surely.any():
            text = f"{told}, and no less while they stand elsewhere: waves, or a model that lacks much"
            return [
                Finding(check=self.name, verdict="note", sentence=text, value=share, unit="1", channels=tuple(names))
            ]
        alone = not pieces and not (surely & fitful).any()  # nothing to compare with: it may be waves as well
        if (surely & fitful).any():
            cause = "it comes by fits, with stillness between: " + _CUT
        elif pieces:
            cause = "much less while they stand elsewhere: " + _CUT
        else:
            cause = "they push nowhere else: their record is cut at a limit, or waves throw the boat about as much"
        size = _beyond(having)
        return [
            Finding(
                check=self.name,
                verdict="warning" if alone or not size.overwhelming else "defect",
                sentence=f"{told}, and {cause} (of the slow motion, the vehicle leaves {size} of what its thrust "
                "makes, in power)",
                value=share,
                unit="1",
                channels=tuple(names[k] for k, sure in zip(at, surely.any(axis=1), strict=True) if sure),
                consequence="what the thrusters do beyond their record would be laid at the door of thrust and hull",
                remedy="log the commands as they reach the motor controllers, in their full range, and drive with "
                "middling ones too",
                short="the record of the commands is cut at a limit",
                reach=Reach.LOG,
            )
        ]


def _beyond(records: Sequence[Record]) -> Share:
    """The power of what the vehicle leaves of the slow motion, over that of its thrust there, of the axis with more.

    Thrusters that worked beyond their record leave much of it, whatever they did; waves are quicker, and leave little.
    """
    parts = parts_of(records, _SLOWLY)[2]
    block = blocks_of([part.left.shape[0] for part in parts])
    left = np.concatenate([part.left for part in parts]) ** 2
    thrust = np.concatenate([part.pushes.sum(axis=1) for part in parts]) ** 2
    both = [share_explained(thrust[:, axis], thrust[:, axis] - left[:, axis], block) for axis in range(2)]
    return max(both, key=lambda one: one.low)


def _stand_by_stand(part: Part) -> tuple[Part, NDArray[np.bool_]]:
    """The part less a straight line for each time that no command moves, and which rows these are.

    A constant is the thrusters' force, known or not; a slope is what a wake, a current or a filter makes of them.
    """
    line = np.linalg.qr(np.vander(np.arange(_ROWS, dtype=float), 2))[0]
    left, states = part.left.copy(), tuple(table.copy() for table in part.states)
    stands = np.asarray(part.stands.all(axis=1))
    for first, last in np.flatnonzero(np.diff(stands, prepend=False, append=False)).reshape(-1, 2).tolist():
        whole = first + (last - first) // _ROWS * _ROWS
        stands[whole:last] = False
        if whole == first:
            continue
        for table in (left, *states):
            pieces = table[first:whole].reshape(-1, _ROWS, table.shape[1])
            table[first:whole] = (pieces - line @ (line.T @ pieces)).reshape(whole - first, -1)
    return replace(part, left=left, states=states), stands


def _by_fits(left: Array, noise: Array) -> NDArray[np.bool_]:
    """Whether what is left (n, 2) while a command stands comes by fits, (2,): a quarter of its lines is still."""
    lines = (left[: left.shape[0] // _ROWS * _ROWS].reshape(-1, _ROWS, 2) ** 2).mean(axis=1)
    if lines.shape[0] < _PIECES:
        return np.zeros(2, dtype=bool)
    still = np.sqrt(np.maximum(np.quantile(lines, 0.25, axis=0) - noise**2, 0.0))
    return np.asarray(still < _FITFUL * np.sqrt(lines.mean(axis=0)))


def _extreme(commands: Array, parts: Sequence[Part], rests: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether each command (n, c) stands at an end of its range: what never moves has none, and rest, if it is seen."""
    every = np.concatenate([part.commands for part in parts])
    largest, least = every.max(axis=0), every.min(axis=0)
    near = _NEAR * (largest - least)
    moves = largest > least
    ahead, astern = (moves & (~rests | (end >= _PUSH)) for end in (largest, -least))
    return ((commands >= largest - near) & ahead) | ((commands <= least + near) & astern)
