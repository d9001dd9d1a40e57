"""Whether the record of the commands is cut at a limit: at its largest, the boat is driven as if they went on.

While no command moves, quick motion is waves and noise, wherever the commands stand. Where it is large while they stand
at their extremes and small while they stand elsewhere, thrusters worked beyond their record.
"""

from collections.abc import Sequence
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray

from ....physics.frames import Array
from ..finding import Check, Finding, Reach
from ..quick_motion import LEAST, STEP, Part, parts_of, unexplained
from ..record import Record
from ..resting import neutral_of

_NEAR = 0.02
"""Share of its range within which a command is at an end of it: what rounding takes from a limit."""
_PUSH = 0.2
"""Share of the largest command from which an end of its range is a push."""
_ELSEWHERE = 5.0
"""Time that commands must stand elsewhere to be compared with [s]: a third of what the extremes need, for only the size
of what waves and noise do is asked of it."""
_PART, _TIMES, _NOISE = 0.3, 2.0, 3.0
"""Share of the boat's accelerations, times what is left elsewhere, and times the sensors' noise, from which it is sure:
records cut at a third of full thrust leave 0.45 to 0.65, and 2.5 to 4 times as much as elsewhere; sound ones, of
simulated boats that lack effects too, up to 0.23 in noise and 0.05 without, the same everywhere."""


@final
class Limited(Check):
    """Compares what nothing explains at the extremes of the commands with what nothing explains elsewhere."""

    name: ClassVar[str] = "limited"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: one finding for all commands, or none where they hardly stand at an extreme."""
        having, names, parts = parts_of(records)
        if not parts or not all(part.modelled for part in parts):
            return []  # without a model, what follows a change of the commands late would be taken for their doing
        rows = [np.asarray(part.stands.all(axis=1)) for part in parts]
        commands = np.concatenate([part.commands[use] for part, use in zip(parts, rows, strict=True)])
        rests = np.array([neutral_of(having, name) is not None for name in names])
        extreme = _extreme(commands, parts, rests)
        elsewhere = ~extreme.any(axis=1)
        at = [k for k in range(len(names)) if extreme[:, k].sum() * STEP >= LEAST]
        if not at:
            return []
        left = unexplained(parts, rows, rows, driven=False)
        usual = np.sqrt((np.concatenate([part.rates for part in parts]) ** 2).mean(axis=0))
        noise = np.max([part.noise for part in parts], axis=0)
        size = np.sqrt([(left[extreme[:, k]] ** 2).mean(axis=0) for k in at])
        beyond = (size > _PART * usual) & (size > _NOISE * noise)
        share = float(np.max((size / np.where(usual > 0.0, usual, np.inf))[beyond], initial=0.0))
        seconds = float(extreme.any(axis=1).sum()) * STEP
        if not beyond.any():
            text = "while the commands stand at their largest, the boat hardly moves beyond what they say"
            return [Finding(check=self.name, verdict="ok", sentence=text, channels=tuple(names))]
        told = (
            f"while the commands stand at their largest, for {seconds:.0f} s, {100.0 * share:.0f} % of the quick "
            "motion has no cause in the log"
        )
        if elsewhere.sum() * STEP < _ELSEWHERE:
            return [
                Finding(
                    check=self.name,
                    verdict="cannot tell",
                    sentence=f"{told}, and they hardly stand elsewhere: it may be waves, or commands cut at a limit",
                    value=share,
                    unit="1",
                    channels=tuple(names),
                    short="whether the commands are cut at a limit",
                )
            ]
        calm = np.sqrt((left[elsewhere] ** 2).mean(axis=0))
        surely = beyond & (size >= _TIMES * calm)
        if not surely.any():
            text = f"{told}, and no less while they stand elsewhere: waves, or a model that lacks much"
            return [
                Finding(check=self.name, verdict="note", sentence=text, value=share, unit="1", channels=tuple(names))
            ]
        return [
            Finding(
                check=self.name,
                verdict="defect",
                sentence=f"{told}, and much less while they stand elsewhere: their record is cut at a limit, and the "
                "thrusters worked beyond it",
                value=share,
                unit="1",
                channels=tuple(names[k] for k, sure in zip(at, surely.any(axis=1), strict=True) if sure),
                consequence="what the thrusters do beyond their record would be laid at the door of thrust and hull",
                remedy="log the commands as they reach the motor controllers, and in their full range",
                short="the record of the commands is cut at a limit",
                reach=Reach.LOG,
            )
        ]


def _extreme(commands: Array, parts: Sequence[Part], rests: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether each command (n, c) stands at an end of its range: what never moves has none, and rest, if it is seen."""
    every = np.concatenate([part.commands for part in parts])
    largest, least = every.max(axis=0), every.min(axis=0)
    near = _NEAR * (largest - least)
    moves = largest > least
    ahead, astern = (moves & (~rests | (end >= _PUSH)) for end in (largest, -least))
    return ((commands >= largest - near) & ahead) | ((commands <= least + near) & astern)
