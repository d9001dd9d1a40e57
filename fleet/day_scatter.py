"""How far the days of a boat scatter beyond the noise within their logs: load, battery, waves.

The covariance of this scatter is found from differences between one logged day and the next, so that a hull that
changes once, or slowly, hardly moves it: by expectation and maximisation (Dempster, Laird and Rubin 1977), boats
together, each with a factor of its own that is drawn towards one (Smyth 2004, section 4).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from ..physics.frames import Array
from .boat_days import BoatDays

ROUNDS = 40
"""Of expectation and maximisation at most."""
SETTLED = 2e-3
"""Share by which no variance moves any more in the last round."""
LEAST = 1e-3
"""Deviation of a day that is taken as the least, in shares: no load, battery and sea are the same to a thousandth."""
OWN = 12.0
"""Numbers that the common scatter counts for beside those of a boat's own differences: as boats scatter whose
deviations differ by a quarter."""
_MEDIAN = float(chi2.median(1))
"""Of a squared standard normal number."""
BEYOND = 1e-3
"""Chance of a difference beyond which it is a change of the boat, and not scatter."""


@dataclass(frozen=True, slots=True, eq=False)
class DayScatter:
    """Scatter from day to day, in shares of the nominal values.

    Attributes
    ----------
    covariance : (p, p), of a usual boat
    factor : by boat, of its covariance over that of a usual boat
    differences : how many it was found from
    """

    covariance: Array
    factor: Mapping[str, float]
    differences: int

    @property
    def freedom(self) -> float:
        """Degrees of freedom: differences that share a day tell two thirds of what as many apart would."""
        return max(2.0 / 3.0 * self.differences, 1.0)

    def of(self, boat: str) -> Array:
        """The covariance of a boat's days, (p, p)."""
        return self.covariance * self.factor[boat]


def day_scatter(boats: Sequence[BoatDays]) -> DayScatter:
    """Find the scatter that days have in common."""
    steps = [np.diff(boat.values, axis=0) for boat in boats]
    noise = [boat.covariance[1:] + boat.covariance[:-1] for boat in boats]
    known = np.concatenate([boat.known[1:] & boat.known[:-1] for boat in boats])
    step, within = np.concatenate(steps), np.concatenate(noise)
    size = step.shape[1]
    if not step.shape[0]:
        return DayScatter(LEAST**2 * np.eye(size), {boat.boat: 1.0 for boat in boats}, 0)
    whose = np.repeat(np.arange(len(boats)), [one.shape[0] for one in steps])
    limit = float(chi2.isf(BEYOND, size))
    start = [0.5 * np.median(step[rows, k] ** 2) / _MEDIAN if rows.any() else 0.0 for k, rows in enumerate(known.T)]
    found, factor = np.diag(np.maximum(start, LEAST**2)), np.ones(len(boats))
    for _ in range(ROUNDS):
        total = 2.0 * factor[whose, None, None] * found
        inverse = np.linalg.inv(within + total)
        squares = np.einsum("np,npq,nq->n", step, inverse, step)
        usual = squares <= limit
        if not usual.any():
            break
        gain = total[usual] @ inverse[usual]
        mean = np.einsum("npq,nq->np", gain, step[usual])
        spread = 0.5 * (mean[:, :, None] * mean[:, None, :] + total[usual] - gain @ total[usual])
        spread = (spread / factor[whose[usual], None, None]).sum(axis=0)
        before = np.diag(found)
        # As many differences as there are parameters say that parameters scatter apart: few do not tell how together.
        found = (spread + size * np.diag(np.diag(found))) / (usual.sum() + size)
        found[np.diag_indices(size)] = np.maximum(np.diag(found), LEAST**2)
        kept = np.minimum(squares, limit)
        sums, counts = (np.bincount(whose, weights=w, minlength=len(boats)) for w in (kept, np.ones(kept.size)))
        if (np.abs(np.diag(found) - before) <= SETTLED * before).all():
            break
        factor = factor * (OWN / factor + sums) / (OWN + size * counts)
    return DayScatter(found, {one.boat: float(c) for one, c in zip(boats, factor, strict=True)}, int(step.shape[0]))
