"""Statistics of rows that err together: robust fits, draws of whole blocks, and paired comparison of two errors.

Also quantiles of Student's t and Fisher's F, for which SciPy is loaded when they are asked for; and a size weighed with
its prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from math import exp, hypot, log, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array

_NORMAL = 1e6
"""Degrees of freedom from which Student's t is normal."""


@cache
def student(freedom: float, probability: float) -> float:
    """The quantile of Student's t of so many degrees of freedom.

    >>> round(student(10, 0.975), 6)
    2.228139
    """
    from scipy.special import stdtrit

    return float(stdtrit(freedom, probability))


def largest_mean_square(tests: float, probability: float = 0.975) -> float:
    """The quantile of the mean square of so many independent normal numbers of variance 1.

    The cube root of a chi-squared number is nearly normal (Wilson and Hilferty 1931, doi:10.1073/pnas.17.12.684).

    >>> round(largest_mean_square(10), 2), round(largest_mean_square(400), 3)
    (2.05, 1.143)
    """
    spread = 2.0 / (9.0 * tests)
    return (1.0 - spread + student(_NORMAL, probability) * sqrt(spread)) ** 3


def beyond_student(freedom: float, value: float) -> float:
    """The chance that Student's t of so many degrees of freedom exceeds a value.

    >>> round(beyond_student(10, 2.228139), 6), beyond_student(10, 0.0)
    (0.025, 0.5)
    """
    from scipy.special import stdtr

    return float(stdtr(freedom, -value))


@cache
def fisher(above: float, below: float, probability: float) -> float:
    """The quantile of Fisher's F of so many degrees of freedom above and below.

    >>> round(fisher(2, 10, 0.95), 6)
    4.102821
    """
    from scipy.special import fdtri

    return float(fdtri(above, below, probability))


_APART = 3.0
"""Standard deviations between the two from which the measurement is a poor fit, and not a rare boat: 3 in 1000."""


def weighed(measured: float, error: float, usual: float, spread: float) -> tuple[float, float] | None:
    """The size that both speak for, and the factor within which it is sure (95 %); None for one not to be believed.

    Sizes are compared by their logarithms, for they differ by factors.

    Parameters
    ----------
    measured : a positive size
    error : its standard error as a share of it, what the model of the measurement does wrong included
    usual : what is usual, positive
    spread : standard deviation of the logarithm of what is usual

    Examples
    --------
    >>> size, factor = weighed(40.0, 0.4, 20.0, 0.4)
    >>> round(size, 1), round(factor, 1)
    (28.3, 1.7)
    >>> weighed(4000.0, 0.4, 20.0, 0.4) is None
    True
    """
    apart = log(measured / usual)
    if abs(apart) > _APART * hypot(error, spread):
        return None
    share = spread**2 / (spread**2 + error**2)
    return usual * exp(share * apart), exp(1.96 * error * share**0.5)


def block_scores(columns: Array, errors: Array, block: NDArray[np.int64]) -> Array:
    """Gradient of half the squared error of a fit in each block, (blocks, p).

    Parameters
    ----------
    columns : (n, p)
    errors : (n,) that the fit leaves, each times the weight of its row
    block : (n,) number of the block that each row belongs to
    """
    return np.array([np.bincount(block, errors * column) for column in columns.T], dtype=float).T


def numbered_on(parts: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Numbers of the blocks of several records, counted on from one record to the next.

    >>> numbered_on([np.array([0, 0, 1]), np.array([0, 1])]).tolist()
    [0, 0, 1, 2, 3]
    """
    begun = np.cumsum([0, *(int(part.max(initial=-1)) + 1 for part in parts)])
    moved = (part + first for part, first in zip(parts, begun, strict=False))
    return np.concatenate([np.zeros(0, dtype=np.int64), *moved])


def sandwich(
    inverse: Array, scores: Array, spare: int | None = None, neighbours: NDArray[np.bool_] | None = None
) -> Array:
    """Covariance (p, p) of the coefficients of a fit whose rows err together in blocks (Liang and Zeger 1986, eq. 8).

    Parameters
    ----------
    inverse : (p, p) of the normal matrix
    scores : (blocks, p) see `block_scores`
    spare : degrees of freedom that are left; default: one less than the blocks
    neighbours : (blocks - 1,) True where a block and the next one follow each other in time and may err alike: their
        products count with weight one half (Newey and West 1987); default: blocks err alone
    """
    meat = scores.T @ scores
    if neighbours is not None:
        beside = scores[:-1].T @ (scores[1:] * neighbours[:, None])
        meat = meat + 0.5 * (beside + beside.T)
    count = scores.shape[0]
    return inverse @ meat @ inverse * count / (count - 1 if spare is None else spare)


@lru_cache(maxsize=2)
def block_draws(blocks: int, draws: int, seed: int | tuple[int, ...]) -> Array:
    """How often each block is drawn in each resample of a bootstrap, (draws, blocks): with replacement, as many.

    The latest are kept; nobody writes into them.

    Parameters
    ----------
    blocks, draws : numbers of both
    seed : of the draws
    """
    rng = np.random.default_rng(seed)
    result = rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), size=draws).astype(float)
    result.flags.writeable = False
    return result


@lru_cache(maxsize=2)
def block_weights(blocks: int, draws: int, seed: int | tuple[int, ...]) -> Array:
    """Weights of blocks in each draw of a Bayesian bootstrap, (draws, blocks), of mean 1 (Rubin 1981).

    Their first two moments are those of draws with replacement, less by 2 in `blocks` + 1, but no block is ever without
    any: what one block alone tells of stays told.

    Parameters
    ----------
    blocks, draws : numbers of both
    seed : of the draws
    """
    result = blocks * np.random.default_rng(seed).dirichlet(np.ones(blocks), size=draws)
    result.flags.writeable = False
    return result


def share_of_draws(passes: NDArray[np.bool_]) -> float:
    """Share of bootstrap draws that pass, never quite 0 or 1: (passed + 1/2) / (draws + 1)."""
    return float((passes.sum() + 0.5) / (passes.size + 1.0))


CI = 1.96
"""Standard errors in half a 95 % interval."""


def interval(value: float, error: float) -> tuple[float, float]:
    """The 95 % interval of a number with a standard error."""
    return value - CI * error, value + CI * error


_ROUNDS = 6
_LEAST_SPREAD = 1e-12
"""Spread that stands for none, so that what is left can be divided by it."""


def spread(values: Array, axis: int | None = None) -> Array:
    """Standard deviation of errors about zero, told by their median modulus: false rows do not sway it.

    Half of all normal numbers lie within 1/1.4826 of a standard deviation.
    """
    return 1.4826 * np.median(np.abs(values), axis=axis)


def robust_squares(
    columns: Array, target: Array, held: Array | None = None, weight: Array | None = None
) -> tuple[Array, Array, Array]:
    """Least squares with weights that grow small for outliers (soft-L1), or with given weights.

    Parameters
    ----------
    columns, target : the problem, (n, p) and (n,)
    held : (p,) one over the usual size of each coefficient, 0 for one that may have any size; default: all zero
    weight : (n,) given weights

    Returns
    -------
    coefficients (p,), weights (n,), inverse normal matrix (p, p)
    """
    w = np.ones(target.size) if weight is None else weight
    found, inverse = np.zeros(columns.shape[1]), np.zeros((columns.shape[1],) * 2)
    size = float(np.std(target))
    for _ in range(_ROUNDS if weight is None else 1):
        normal = (columns * w[:, None]).T @ columns
        if held is not None:
            normal = normal + size**2 * np.diag(held**2)
        inverse = np.asarray(np.linalg.pinv(normal, rcond=1e-10, hermitian=True), dtype=float)
        found = inverse @ (columns.T @ (w * target))
        if weight is None:
            left = target - columns @ found
            size = max(float(spread(left)), _LEAST_SPREAD)
            w = 1.0 / np.sqrt(1.0 + (left / (2.0 * size)) ** 2)
    return found, w, inverse


@dataclass(frozen=True, slots=True)
class Fit:
    """Coefficients of a fit (p,), their standard errors (p,), and the share of the target's variance that it explains.

    The errors are infinite where there are too few stretches to count.
    """

    values: Array
    errors: Array
    explained: float

    def interval(self, place: int) -> tuple[float, float] | None:
        """The 95 % interval of one coefficient, None where it is unknown."""
        value, error = float(self.values[place]), float(self.errors[place])
        return interval(value, error) if np.isfinite(error) else None

    def certain(self, place: int, times: float) -> bool:
        """True when a coefficient is at least `times` its standard error."""
        return bool(abs(self.values[place]) > times * self.errors[place])


def robust_fit(columns: Array, target: Array, stretch: NDArray[np.int64]) -> Fit:
    """Fit `target` (n,) by `columns` (n, p) with soft-L1 weights.

    Parameters
    ----------
    columns, target : the problem
    stretch : (n,) number of the stretch of a log that each row belongs to; rows of one stretch err together
    """
    _, stretch = np.unique(stretch, return_inverse=True)
    count, size = int(stretch.max()) + 1 if stretch.size else 0, columns.shape[1]
    if target.size <= size or count < 3:
        return Fit(np.zeros(size), np.full(size, np.inf), 0.0)
    scale = np.sqrt((columns**2).mean(axis=0))
    alive = scale > 0.0
    unit = np.where(alive, scale, 1.0)
    scaled = columns / unit
    found, weight, inverse = robust_squares(scaled, target)
    left = target - scaled @ found
    covariance = sandwich(inverse, block_scores(scaled, weight * left, stretch))
    # A direction that the pseudo-inverse dropped is not known at all, whatever the sandwich says.
    values, vectors = np.linalg.eigh((scaled * weight[:, None]).T @ scaled)
    lost = values < 1e-8 * max(float(values[-1]), 1e-300)
    unknown = (vectors[:, lost] ** 2).sum(axis=1) > 1e-6
    errors = np.where(alive & ~unknown, np.sqrt(np.diag(covariance).clip(0.0)), np.inf)
    total = float((weight * (target - np.average(target, weights=weight)) ** 2).sum())
    explained = 1.0 - float((weight * left**2).sum()) / total if total > 0.0 else 0.0
    return Fit(found / unit, errors / unit, explained)


Verdict = Literal["better", "worse", "no difference", "too short to tell"]

FEWEST = 2.0
"""Blocks below which nothing is said: one spread cannot be judged by itself."""
_SHORTEST = 3.0
"""Blocks that autocorrelation alone leaves at least."""
MATERIAL = 0.01
"""Share of the error below which a difference, however sure, is none."""
ROWS = 30
"""Rows below which nothing is said: fewer do not show how alike neighbours are."""
_MOST = 6
"""Blocks at most: longer blocks cost a little width, and keep an interval honest where the error goes slowly."""
_LONGER = 5.0
"""Length of a block, in times of what the rule for autocorrelation asks for: a judgement. Longer blocks cost width, and
shorter ones are not yet independent."""
LEVEL = 0.975
"""Quantile of either end of a 95 % interval."""
_LEAST = 1e-24
"""Mean square that stands for none, so that there is a logarithm."""
BY_CHANCE, _ODDS = 0.01, 1000.0
"""Chance, and odds against it, from which an explanation is ruled out: few stretches may give great odds by chance, and
many may agree on little."""
_FLOOR = 1e-3
"""Share of what a usual stretch leaves that is nothing: a stretch without noise weighs no more than its signal."""


@dataclass(frozen=True, slots=True)
class Difference:
    """How the error of a model differs from that of a reference.

    Attributes
    ----------
    difference : model minus reference
    relative : the same over the reference's error
    ci95 : 95 % interval of `difference`, the reference's error taken as measured; None where the rows are too few
    error : standard error of `difference`; None where the rows are too few
    blocks : how many blocks long the rows are
    """

    difference: float
    relative: float
    ci95: tuple[float, float] | None
    error: float | None
    blocks: int

    @property
    def verdict(self) -> Verdict:
        """What may be said: only a difference that is sure and material is one."""
        if self.ci95 is None:
            return "too short to tell"
        low, high = self.ci95
        if low <= 0.0 <= high or abs(self.relative) < MATERIAL:
            return "no difference"
        return "better" if high < 0.0 else "worse"


def paired_difference(model: Array, reference: Array, shortest: int = 1) -> Difference:
    """Compare the root mean square errors of two models on the same rows.

    Both models are judged on the same rows, so that what is hard for both cancels; rows near each other err alike, so
    whole blocks count (moving-block bootstrap; Kuensch 1989). The logarithm of the ratio of the errors is linearised;
    its standard error with endless draws is known in closed form, the spread of the means of all overlapping blocks
    (Meketon and Schmeiser 1984). Few blocks give Student's t. The length of a block comes from the autocorrelation of
    the difference (Politis and White 2004; Patton, Politis and White 2009), times five, and at least a sixth of the
    rows, since intervals that cover need longer blocks than the variance. `benchmarks/paired.py` prints how often the
    intervals cover.

    Parameters
    ----------
    model, reference : squared errors (n,), evenly spaced in the order of time, stretch after stretch
    shortest : rows that a block has at least, where neighbours share what they are made from

    Raises
    ------
    ValueError
        when the two have different rows.
    """
    found = paired_ratio(model[:, None], reference[:, None], shortest)
    error = float(np.sqrt(reference.mean()))
    gap = error * found.relative
    if found.ci95 is None or found.error is None:
        return Difference(gap, found.relative, None, None, found.blocks)
    ends = error * float(np.expm1(found.ci95[0])), error * float(np.expm1(found.ci95[1]))
    return Difference(gap, found.relative, ends, error * found.error, found.blocks)


def paired_ratio(model: Array, reference: Array, shortest: int = 1, fewest: int = ROWS) -> Difference:
    """The same over several quantities at once: the mean of the logarithms of the ratios of their errors.

    Parameters
    ----------
    model, reference : squared errors (n, k), see `paired_difference`
    fewest : rows below which nothing is said

    Returns
    -------
    Difference
        `difference` and `ci95` are of the mean logarithm; `relative` is the error saved or lost as a share.
    """
    ours, theirs = (np.maximum(x.mean(axis=0), _LEAST) for x in (model, reference))
    gap = 0.5 * float(np.log(ours / theirs).mean())
    error, blocks = _error(0.5 * (model / ours - reference / theirs).mean(axis=1), shortest, fewest)
    if error is None:
        return Difference(gap, float(np.expm1(gap)), None, None, int(blocks))
    half = student(blocks - 1.0, LEVEL) * error
    return Difference(gap, float(np.expm1(gap)), (gap - half, gap + half), error, int(blocks))


def _error(series: Array, shortest: int, fewest: int) -> tuple[float | None, float]:
    """Standard error of a mean, None where the rows are too few; and how many blocks long they are."""
    rows = series.size
    wanted = min(_LONGER * block_length(series), rows / _SHORTEST)
    length = max(int(wanted), int(np.ceil(rows / _MOST)), shortest)
    blocks = rows / length
    if rows < fewest or blocks < FEWEST or not np.isfinite(series).all():
        return None, blocks
    total = np.concatenate([[0.0], np.cumsum(series - series.mean())])
    means = (total[length:] - total[:-length]) / length
    few, many = sorted((length, means.size))
    # The weights of the rows in the mean of all blocks rise to `few` at one end and fall at the other: their squares.
    covered = (few - 1.0) * few * (2.0 * few - 1.0) / 3.0 + (many - few + 1.0) * few**2
    unbiased = 1.0 - covered / (length * float(means.size) ** 2)  # of rows that err alone
    unbiased *= 1.0 - (shortest - 1.0) / (3.0 * length)  # of neighbours that share rows: a triangle of correlation
    return float(np.sqrt(float(means.var()) / (blocks * unbiased))), blocks


def block_length(series: Array) -> int:
    """Rows of a block for the mean of an evenly spaced series, at most a third of them.

    The rule of Politis and White (2004, section 3.2) for the circular bootstrap, which is the moving blocks', too.
    """
    n = series.size
    x = series - series.mean()
    quiet = max(5, round(np.sqrt(np.log10(max(n, 2)))))
    lags = min(int(np.ceil(np.sqrt(n))) + quiet, n - 1)
    covariance = np.array([x[k:] @ x[: n - k] for k in range(lags + 1)]) / n
    if covariance[0] <= 0.0 or lags < quiet:
        return 1
    small = np.abs(covariance[1:] / covariance[0]) < 2.0 * np.sqrt(np.log10(n) / n)
    starts = [k for k in range(small.size - quiet + 1) if small[k : k + quiet].all()]
    band = min(2 * max(starts[0] if starts else lags, 1), lags)
    k = np.abs(np.arange(-band, band + 1))
    weighted = np.clip(2.0 * (1.0 - k / band), 0.0, 1.0) * covariance[k]
    level, bend = float(weighted.sum()), float((k * weighted).sum())
    most = int(np.ceil(min(3.0 * np.sqrt(n), n / 3.0)))
    if level <= 0.0:
        return 1  # neighbours err against each other: single rows are blocks enough
    return int(np.clip(np.ceil((1.5 * (bend / level) ** 2 * n) ** (1.0 / 3.0)), 1, most))


def surely_more(left: Array, other: Array) -> bool:
    """True when one explanation of a record leaves more than another, by great odds and not by chance.

    The difference in log likelihood, each stretch with its own variance and no more than two independent values, gives
    the odds. Its mean over stretches by its standard error is the statistic of Vuong (1989) for two models of which
    neither need be true.

    Parameters
    ----------
    left, other : (stretches,) power that the two leave, in the same stretches
    """
    if left.size < 2:
        return False
    more = _log_ratio(left, other)
    return bool(more.sum() > np.log(_ODDS)) and chance_of_no_more(left, other) < BY_CHANCE


def chance_of_no_more(left: Array, other: Array) -> float:
    """Chance with which stretches like these show so much more of one explanation where neither leaves more.

    Parameters
    ----------
    left, other : (stretches,) power that the two leave, in the same stretches; see `surely_more`
    """
    if left.size < 2:
        return 1.0
    more = _log_ratio(left, other)
    error = float(more.std(ddof=1)) / np.sqrt(more.size)
    return beyond_student(more.size - 1, float(more.mean()) / error) if error > 0.0 else float(more.mean() <= 0.0)


def _log_ratio(left: Array, other: Array) -> Array:
    floor = max(_FLOOR * float(other.mean()), 1e-300)
    return np.asarray(np.log((left + floor) / (other + floor)))
