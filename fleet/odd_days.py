"""Days on which a boat was another for once: the day after is as those before, and takes the alarm back."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from ..physics.frames import Array
from .boat_days import BoatDays
from .day_scatter import BEYOND
from .hull_changes import Back

BEFORE = 7
"""Logged days before an odd one that say what is usual: a week, in which weed grows by little."""
SURELY = float(2.0 * np.log(20.0))
"""By how much better, in squared deviations, the day after must fit to the days before than to the odd one: twenty
times likelier."""


@dataclass(frozen=True, slots=True, eq=False)
class OddDay:
    """One odd day of a boat.

    Attributes
    ----------
    row : its index
    change, deviation : (p,) of each parameter from the days before, in shares
    """

    row: int
    change: Array
    deviation: Array


def taken_back(boat: BoatDays, scatter: Array) -> Back:
    """Whether the day after an alarm takes it back, for a boat with a scatter (p, p) of its days."""
    whole = boat.covariance + scatter
    limit = float(chi2.isf(BEYOND, scatter.shape[0]))

    def back(before: Sequence[int], day: int, after: int) -> bool:
        level, doubt = _level(boat, whole, before)
        away, home, stays = (
            _squares(boat.values[day] - level, whole[day] + doubt),
            _squares(boat.values[after] - level, whole[after] + doubt),
            _squares(boat.values[after] - boat.values[day], whole[after] + whole[day]),
        )
        return away > limit and stays - home > SURELY

    return back


def odd_day(boat: BoatDays, scatter: Array, row: int, others: Sequence[int]) -> OddDay:
    """What was odd on a day, beside the days before that are not odd themselves."""
    whole = boat.covariance + scatter
    level, doubt = _level(boat, whole, [k for k in range(row) if k not in others])
    return OddDay(row, boat.values[row] - level, np.sqrt(np.diag(whole[row] + doubt)))


def _level(boat: BoatDays, whole: Array, before: Sequence[int]) -> tuple[Array, Array]:
    rows = list(before)[-BEFORE:]
    inverse = np.linalg.inv(whole[rows])
    doubt = np.linalg.inv(inverse.sum(axis=0))
    return doubt @ np.einsum("npq,nq->p", inverse, boat.values[rows]), doubt


def _squares(off: Array, covariance: Array) -> float:
    return float(off @ np.linalg.solve(covariance, off))
