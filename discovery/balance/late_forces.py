"""What thrusters make of the commands of a log, once for all delays.

A delay, and an offset of the record of the commands, shift forces in time and change nothing else: the force at a shift
by some rows and a share of one lies between the forces at whole rows, on a straight line. So does all that is linear in
it, such as the force passed through test functions. So a search that tries delays works out forces at whole rows, and
its columns are weighted sums of two of them.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import final

import numpy as np

from ...physics.forces import commands_known, thrust_left
from ...physics.motion import Array, Motion
from ...physics.sampled_series import Switches, first_order_lag, switches
from ...physics.thrusters import Thruster
from .column_cache import Remembered

_KEPT = 16_000_000
"""Bytes of forces, and as many of commands, that are kept: on 25 min of log at 20 Hz, of 16 shapes of two thrusters."""
_WHOLE = 1e-9
"""Share of a row that is rounding of a delay of whole rows."""


@final
class LateForces:
    """Forces and losses of thrusters along some motions, of a gain and a loss of one.

    Parameters
    ----------
    motions : gap-free stretches with their commands
    """

    def __init__(self, motions: Sequence[Motion]) -> None:
        self._motions = tuple(motions)
        self._steps = [motion.time_step for motion in self._motions]
        known = [commands_known(motion, 0) for motion in self._motions]
        self._edges = np.cumsum([0, *(series.size for series, _ in known)])
        self._rows = [np.arange(b - m.time.size, b) for m, b in zip(self._motions, self._edges[1:], strict=True)]
        self._lagged: Remembered[tuple[Array, ...]] = Remembered(_KEPT)
        self._prompt: Remembered[Array] = Remembered(_KEPT)

    def forget(self) -> None:
        """Keep no forces."""
        self._lagged.clear()
        self._prompt.clear()

    def late(self, unit: Thruster) -> tuple[tuple[int, ...], Array]:
        """By how many whole rows forces are late in each motion, and by which share of a row beyond."""
        rows = np.array([unit.late / step for step in self._steps])
        whole = np.floor(rows + _WHOLE)
        share = rows - whole
        return tuple(whole.astype(int).tolist()), np.where(share > _WHOLE, share, 0.0)

    def shifted(self, index: int, unit: Thruster, rows: Sequence[int]) -> Array:
        """Force [N] and load [N s/m] of a thruster along all motions, (2, n), by whole rows late; the ends hold."""
        series = self._prompt.of((index, unit.prompt_shape), lambda: self._at_once(index, unit))
        ends = zip(self._rows, rows, pairwise(self._edges), strict=True)
        places = [np.clip(own - by, first, last - 1) for own, by, (first, last) in ends]
        found = series.take(np.concatenate(places), axis=1)
        if unit.thrust_rate:
            found *= np.concatenate([thrust_left(unit, motion.minutes) for motion in self._motions])
        return found

    def between(self, unit: Thruster, at: Callable[[tuple[int, ...]], Array], times: Sequence[int]) -> Array:
        """What is linear in a force, from what it is at whole rows.

        Parameters
        ----------
        at : whole rows late in each motion -> (..., m), of all motions in turn
        times : how many of the m belong to each motion
        """
        whole, share = self.late(unit)
        found = at(whole)
        if not share.any():
            return found
        # So that of a force that stays, which is the same a row later, nothing changes to the bit.
        return found + np.repeat(share, times) * (at(tuple(k + 1 for k in whole)) - found)

    def _at_once(self, index: int, unit: Thruster) -> Array:
        """Force and load along the commands of all motions and their history, (2, rows)."""
        lagged, rows, share = self._lagged.of((index, unit.lag), lambda: self._commanded(index, unit.lag))
        return unit.prompt(lagged, Switches(rows, share))

    def _commanded(self, index: int, lag: float) -> tuple[Array, ...]:
        """A command with a lag along all motions and their history, and where it switches."""
        known = zip(self._motions, self._steps, strict=True)
        lagged = [first_order_lag(commands_known(m, index)[0], lag, step) for m, step in known]
        found = [switches(series) for series in lagged]
        rows = [first + one.rows for first, one in zip(self._edges, found, strict=False)]
        return np.concatenate(lagged), np.concatenate(rows), np.concatenate([one.share for one in found])
