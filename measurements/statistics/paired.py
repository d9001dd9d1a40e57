"""Is one model's error smaller than another's? Paired moving-block bootstrap of the difference of two RMS errors.

Both models are judged on the same rows, so that what is hard for both cancels; and rows near each other in time err
alike, so that whole blocks of time are drawn (Kuensch 1989). What is asked for is the ratio of the errors, which may be
far from one by all that is known though nobody can say how far. Its logarithm is linearised about its value; the
standard error that the bootstrap then has with endless draws is known in closed form, the spread of the means of all
blocks that overlap (Meketon and Schmeiser 1984), so nothing is drawn. Few blocks give Student's t, not a normal
quantile. The length of a block comes from the autocorrelation of the difference (Politis and White 2004, with the
correction of Patton, Politis and White 2009). Their length is best for the variance; intervals that cover need a longer
one, and a length that a noisy autocorrelation cannot make too short: five times as long, and a sixth of the rows at
least. `benchmarks/paired.py` prints how often the intervals cover.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...physics.frames import Array
from .quantiles import beyond_student, student

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
_LEVEL = 0.975
"""Quantile of the upper end of a 95 % interval."""
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
    half = student(blocks - 1.0, _LEVEL) * error
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
    """Whether one explanation of a record leaves more than another, by great odds and not by chance.

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
