"""Change detection over the days of a boat: an e-process with a budget of false alarms, and single odd days.

For every possible onset and watched direction, the days since are weighed by a likelihood ratio of change to none, with
mean one under no change and no baseline from outside. Their weighted sum is the detector of Shiryaev and Roberts (Shin,
Ramdas and Rinaldo 2024, definition 2.5). Scatter is not as the theory assumes, so its covariance is widened until
surrogate histories of the same fleet, with its own scatter drawn anew, keep the budget.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter
from scipy.special import log_ndtr
from scipy.stats import chi2
from scipy.stats import f as f_law

from ..discovery.calibration.change_watch import candidate_onsets, least_widening
from ..physics.errors import RequestError
from ..physics.motion import Array
from .boat_days import BEYOND, BoatDays, DayScatter, day_scatter
from .causes import SLOPE, STEP, Ray

Back = Callable[[Sequence[int], int, int], bool]
YEAR = 365.25  # [days]
_KEPT = ((6, 1), (24, 4), (120, 12))
"""Logged days back up to which every n-th may be the first of a change: to leave candidates out can only lower the sum,
and neighbours of so long ago tell the same."""
SUDDEN = float(np.log(20.0))
"""Growth of the logarithm of the detector by which a day raises an alarm alone: what grows for weeks does not."""


@dataclass(frozen=True, slots=True)
class WatchSettings:
    """What the watch may cost.

    Attributes
    ----------
    budget : false alarms that are expected at most, a boat and year, over all parameters together
    seed : of the rehearsal
    """

    budget: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 < self.budget < np.inf:
            raise RequestError(f"diary: expected a budget of false alarms above 0 a boat and year, got {self.budget:g}")

    @property
    def threshold(self) -> float:
        """Days that one false alarm may cost, which is what the detector must pass."""
        return YEAR / self.budget


@dataclass(frozen=True, slots=True, eq=False)
class Watch:
    """What is watched of one boat: a series a ray, each with its precision.

    Attributes
    ----------
    days : (n,) since the first
    series, precision : (n, r)
    rays : their directions
    """

    days: Array
    series: Array
    precision: Array
    rays: tuple[Ray, ...]

    def of(self, rows: Sequence[int]) -> "Watch":
        """The same of some days."""
        return Watch(self.days[rows], self.series[rows], self.precision[rows], self.rays)


def watched(boat: BoatDays, scatter: Array, rays: Sequence[Ray]) -> Watch:
    """The sums of parameters that show each ray best, by the scatter of days and the usual noise of the logs."""
    whole = boat.covariance + scatter
    inverse = np.linalg.inv(scatter + np.median(boat.covariance, axis=0))
    directions = np.array([ray.direction for ray in rays])
    sums = directions @ inverse
    sums /= np.einsum("rp,rp->r", sums, directions)[:, None]
    variance = np.einsum("rp,npq,rq->nr", sums, whole, sums, optimize=True)
    return Watch(boat.days, boat.values @ sums.T, 1.0 / variance, tuple(rays))


def alarms(watch: Watch, threshold: float, back: Back | None = None) -> tuple[list[int], list[int]]:
    """Days after whose logs the detector passes its threshold, and odd days among them; it begins anew after each.

    Parameters
    ----------
    back : says of the days before an alarm that one day raised, its day and the day after whether that takes the alarm
        back: the detector then goes on as if the odd day were not there; default: no alarm is taken back
    """
    rows, start = list(range(watch.days.size)), 0
    known: list[int] = []
    odd: list[int] = []
    while start < len(rows) - 1:
        sums = detector(watch.of(rows[start:]))
        passed = np.flatnonzero(sums >= np.log(threshold))
        if not passed.size:
            break
        at = start + int(passed[0])
        sudden = float(sums[passed[0]] - sums[passed[0] - 1]) > SUDDEN
        if back is not None and sudden and at + 1 < len(rows) and back(rows[start:at], rows[at], rows[at + 1]):
            odd.append(rows.pop(at))
            continue
        known.append(rows[at])
        start = at
    return known, odd


def detector(watch: Watch) -> Array:
    """The logarithm of the detector's sum after each day, (n,)."""
    days, series, precision = watch.days, watch.series, watch.precision
    last, first = np.meshgrid(np.arange(days.size), np.arange(1, days.size), indexing="ij")
    kept = candidate_onsets(last, first, _KEPT)
    last, first = last[kept], first[kept]  # every last day with every first day of a change that is thought of then
    slope = np.array([ray.slope for ray in watch.rays])
    prior = np.log([ray.weight for ray in watch.rays])
    gap = np.log(np.diff(days, prepend=days[0] - 1.0))[first]
    best = np.full(last.size, -np.inf)
    for kind, deviation in ((False, STEP), (True, SLOPE)):
        of_kind = slope == kind
        information, score = _precision(days, series[:, of_kind], precision[:, of_kind], last, first, kind)
        weighed = prior[of_kind] + _ratio(information, score, deviation)
        best = np.logaddexp(best, np.logaddexp.reduce(weighed, axis=1))
    total = np.full(days.size, -np.inf)
    np.logaddexp.at(total, last, gap + best)
    return total


def _precision(
    days: Array, series: Array, precision: Array, last: np.ndarray, first: np.ndarray, slope: bool
) -> tuple[Array, Array]:
    """Information on the size of a change, and its score, where the level before is not known (pairs, rays)."""

    def sums(of: Array) -> tuple[Array, Array]:
        total = np.concatenate([np.zeros((1, of.shape[1])), np.cumsum(of, axis=0)])
        return total[last + 1], total[last + 1] - total[first]

    every, since = sums(precision)
    all_seen, seen = sums(precision * (series - series[0]))
    if not slope:
        return since * (every - since) / every, seen - since * all_seen / every
    time = days[:, None]
    begins = days[first - 1][:, None]
    moments = (precision * time, precision * time**2, precision * time * (series - series[0]))
    first_moment, second, product = (sums(moment)[1] for moment in moments)
    drive = first_moment - begins * since
    square = second - 2.0 * begins * first_moment + begins**2 * since
    return square - drive**2 / every, product - begins * seen - drive * all_seen / every


def _ratio(information: Array, score: Array, deviation: float) -> Array:
    """Log likelihood ratio of a change ahead, its size half-normal with a deviation, against none."""
    variance = 1.0 / (np.maximum(information, 0.0) + deviation**-2.0)
    place = score * np.sqrt(variance)
    return np.log(2.0) + log_ndtr(place) + 0.5 * place**2 + 0.5 * np.log(variance / deviation**2)


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
        away = _squares(boat.values[day] - level, whole[day] + doubt)
        home = _squares(boat.values[after] - level, whole[after] + doubt)
        stays = _squares(boat.values[after] - boat.values[day], whole[after] + whole[day])
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


def calibrate_scatter(
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

    return least_widening(WIDENINGS, kept)


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
