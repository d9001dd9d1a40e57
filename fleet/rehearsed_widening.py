"""How much wider than it is the scatter of days must be taken for the watch to keep its budget: found by rehearsal.

Theory keeps the budget where scatter is normal, of a known covariance, and forgotten from day to day. A fleet's is none
of these. So the same fleet is rehearsed on the same days with nothing but its own scatter, drawn anew with its tails
and with what lasts from day to day; and its covariance is widened until false alarms are within the budget.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter
from scipy.stats import f as f_law

from ..physics.frames import Array
from .boat_days import BoatDays
from .causes import Ray
from .day_scatter import DayScatter, day_scatter
from .hull_changes import YEAR, WatchSettings, alarms, watched
from .odd_days import taken_back

AIM = 0.5
"""Share of the budget that may ring in rehearsals: they are of finite length, and draw from days that were seen, whose
tails are shorter than those of days to come. Of fleets with tails of six degrees of freedom, three quarters ring."""
BOAT_YEARS = 30.0
"""Rehearsed at least: with an aim of one alarm in two years, their number is then known to a quarter."""
MOST_REPEATS = 40
"""Of the fleet: some boats with some weeks each are rehearsed for fewer years, and the count is less sure."""
BLOCK = 7
"""Logged days that are drawn together, so that scatter which lasts from day to day does so in the rehearsal."""
NEAR = 15
"""Logged days whose median is the level about a day: it follows a hull that changes, and leaves a single day alone."""
TAILS = 6.0
"""Degrees of freedom of the widest scatter that is rehearsed: a day that is beyond what such scatter does once in a
year has had a cause, is told as an odd one, and would hide what lasts were it drawn again and again."""
WIDENINGS = tuple(float(1.25**k) for k in range(13))
"""Of the covariance, up to fifteen times; a step costs an eighth of the evidence at most."""


def rehearsed_widening(
    boats: Sequence[BoatDays], scatter: DayScatter, rays: Sequence[Ray], settings: WatchSettings
) -> float:
    """The least widening of the scatter's covariance that keeps the budget of false alarms; 1 for too few days."""
    pool = [series for boat in boats if (series := _residuals(boat, scatter)).shape[0] >= BLOCK]
    years = sum(float(boat.days[-1]) for boat in boats) / YEAR
    if not pool or years <= 0.0:
        return 1.0
    rng = np.random.default_rng([settings.seed, 20])
    repeats = int(np.clip(np.ceil(BOAT_YEARS / years), 1, MOST_REPEATS))
    fleets = [[_redrawn(boat, scatter, pool, rng) for boat in boats] for _ in range(repeats)]
    found = [day_scatter(fleet) for fleet in fleets]
    most = AIM * settings.budget * years * repeats

    def kept(widening: float) -> bool:
        count = 0
        for fleet, own in zip(fleets, found, strict=True):
            for boat in fleet:
                wide = widening * own.of(boat.boat)
                known, odd = alarms(watched(boat, wide, rays), settings.threshold, taken_back(boat, wide))
                count += len(known) + len(odd)  # an alarm that is taken back a day later was one
            if count > most:
                return False
        return True

    low, high = 0, len(WIDENINGS) - 1
    middle = 0  # most fleets need none
    while low < high:
        if kept(WIDENINGS[middle]):
            high = middle
        else:
            low = middle + 1
        middle = (low + high) // 2
    return WIDENINGS[low]


def _residuals(boat: BoatDays, scatter: DayScatter) -> Array:
    """Days less the level about them, in units of their scatter (n, p), but for those that no scatter explains."""
    level = median_filter(boat.values, size=(NEAR, 1), mode="nearest")
    root = np.linalg.cholesky(boat.covariance + scatter.of(boat.boat))
    found = np.linalg.solve(root, (boat.values - level)[..., None])[..., 0]
    size = found.shape[1]
    limit = size * (TAILS - 2.0) / TAILS * float(f_law.isf(1.0 / YEAR, size, TAILS))
    return found[(found**2).sum(axis=1) < limit]


def _redrawn(boat: BoatDays, scatter: DayScatter, pool: Sequence[Array], rng: np.random.Generator) -> BoatDays:
    """The same days with scatter that is drawn from the fleet's, and the noise of their logs in its share."""
    places = np.array([len(series) - BLOCK + 1 for series in pool], dtype=float)
    drawn: list[Array] = []
    while len(drawn) * BLOCK < boat.time.size:
        series = pool[rng.choice(len(pool), p=places / places.sum())]
        at = rng.integers(0, len(series) - BLOCK + 1)
        drawn.append(series[at : at + BLOCK])
    parts = np.concatenate(drawn)[: boat.time.size]
    root = np.linalg.cholesky(boat.covariance + scatter.of(boat.boat))
    return replace(boat, values=1.0 + np.einsum("npq,nq->np", root, parts))
