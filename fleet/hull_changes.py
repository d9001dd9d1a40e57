"""When a hull changed: an e-process over the days of a boat, under a budget of false alarms.

For every day on which something may have begun, and every direction that is watched, the days since are weighed by
their likelihood with the change over that without (both without regard to where the parameters were before, so that a
boat needs no baseline from outside). Each such ratio is an e-process: its mean is one while nothing happens. Their sum,
each weighed by the days in which its change may have begun, is the detector of Shiryaev and Roberts (Shin, Ramdas and
Rinaldo 2024, definition 2.5): while nothing happens its mean is at most the days gone by, so that it passes a year's
worth of days at most once a year.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from ..physics.errors import RequestError
from ..physics.frames import Array
from .boat_days import BoatDays
from .causes import SLOPE, STEP, Ray

Back = Callable[[Sequence[int], int, int], bool]
YEAR = 365.25  # [days]
RECENT, MIDDLE, OLDEST = 6, 24, 120
SPARSE = (4, 12)
"""Logged days back of which each may be the first of a change; of older ones every fourth, then every twelfth: to leave
candidates out can only lower the sum, and neighbours of so long ago tell the same."""


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
        sums = detector(watch.of(rows), start)
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


def detector(watch: Watch, start: int = 0) -> Array:
    """The logarithm of the detector's sum after each day from `start` on, (n - start,)."""
    days, series, precision = watch.days[start:], watch.series[start:], watch.precision[start:]
    size = days.size
    last, first = _pairs(size)
    slope = np.array([ray.slope for ray in watch.rays])
    prior = np.log([ray.weight for ray in watch.rays])
    gap = np.log(np.diff(days, prepend=days[0] - 1.0))[first]
    best = np.full(last.size, -np.inf)
    for kind, deviation in ((False, STEP), (True, SLOPE)):
        of_kind = slope == kind
        information, score = _told(days, series[:, of_kind], precision[:, of_kind], last, first, kind)
        weighed = prior[of_kind] + _ratio(information, score, deviation)
        best = np.logaddexp(best, np.logaddexp.reduce(weighed, axis=1))
    total = np.full(size, -np.inf)
    np.logaddexp.at(total, last, gap + best)
    return total


def _pairs(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Every last day with every first day of a change that is thought of then."""
    last, first = np.meshgrid(np.arange(size), np.arange(1, size), indexing="ij")
    back = last - first
    fourth, twelfth = SPARSE
    kept = (back >= 0) & (back < RECENT)
    kept |= (back >= RECENT) & (back < MIDDLE) & (first % fourth == 0)
    kept |= (back >= MIDDLE) & (back < OLDEST) & (first % twelfth == 0)
    return last[kept], first[kept]


def _told(
    days: Array, series: Array, precision: Array, last: np.ndarray, first: np.ndarray, slope: bool
) -> tuple[Array, Array]:
    """Information on the size of a change, and its score, where the level before is not known (pairs, rays)."""

    def sums(of: Array) -> tuple[Array, Array]:
        total = np.concatenate([np.zeros((1, of.shape[1])), np.cumsum(of, axis=0)])
        return total[last + 1], total[last + 1] - total[first]

    every, since = sums(precision)
    all_seen, seen = sums(precision * (series - series[0]))
    if not slope:
        information = since * (every - since) / every
        return information, seen - since * all_seen / every
    time = days[:, None]
    begins = days[first - 1][:, None]
    _, first_moment = sums(precision * time)
    _, second = sums(precision * time**2)
    _, product = sums(precision * time * (series - series[0]))
    drive = first_moment - begins * since
    square = second - 2.0 * begins * first_moment + begins**2 * since
    return square - drive**2 / every, product - begins * seen - drive * all_seen / every


def _ratio(information: Array, score: Array, deviation: float) -> Array:
    """Log likelihood ratio of a change ahead, its size half-normal with a deviation, against none."""
    variance = 1.0 / (np.maximum(information, 0.0) + deviation**-2.0)
    place = score * np.sqrt(variance)
    return np.log(2.0) + log_ndtr(place) + 0.5 * place**2 + 0.5 * np.log(variance / deviation**2)
