"""Structure in an error told from noise: draws of blocks, and linear fits whose errors count blocks, not rows."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.blocks import block_draws, block_scores, sandwich
from ...measurements.statistics.quantiles import student
from .rows import EDGE, Array, Scene

_DRAWS = 999
"""Resamples: with the estimate a thousand, so that the ends of 95 % are whole numbers of them."""
_RIDGE = 1e-9
"""Added to squares of columns of length one: two that are one can be solved, and no other is moved."""


def draws(blocks: int) -> Array:
    """Number of times each block is drawn in each bootstrap resample, (resamples, blocks); the same at every call."""
    return _counts(blocks).astype(float)


@lru_cache(maxsize=64)
def _counts(blocks: int) -> NDArray[np.uint16]:
    """The same in whole numbers, which are kept in a quarter of the memory: a long log has thousands of blocks."""
    return block_draws(blocks, _DRAWS, (0, blocks)).astype(np.uint16)


@dataclass(frozen=True, slots=True)
class Fitted:
    """A linear fit to rows that come in blocks.

    Attributes
    ----------
    values : (k,) coefficients of the columns that are asked for
    covariance : (k, k) of them, robust to whatever goes on within blocks and between neighbours
    sample : (resamples, k) of a block bootstrap, one step from the fit
    blocks : how many
    free : share of each column that the others do not explain, (k,)
    residual : (n,) what the whole fit leaves; zero on rows that took no part
    """

    values: Array
    covariance: Array
    sample: Array
    blocks: int
    free: Array
    residual: Array

    @property
    def errors(self) -> Array:
        """Standard errors, (k,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def interval(self, k: int) -> list[float]:
        """The 95 % interval of a coefficient."""
        reach = student(max(self.blocks - 2, 2), 0.975) * self.errors[k]
        return [float(self.values[k] - reach), float(self.values[k] + reach)]


def fit_with_nuisances(stage: Scene, target: Array, asked: Array, beside: Array) -> Fitted | None:
    """Fit a target to columns of interest beside others, with errors that are robust to autocorrelation.

    Blocks that follow each other in time may err alike, too. The bootstrap draws the blocks' scores (Kline and Santos
    2012), which costs one product of matrices.

    Parameters
    ----------
    target : (n,), NaN where missing
    asked : (n, k) columns whose coefficients are wanted
    beside : (n, m) columns that explain what is not asked for

    Returns
    -------
    None when there are too few blocks for the number of columns.
    """
    rows = np.isfinite(target)
    columns = np.column_stack([asked, beside])
    columns = np.where(rows[:, None], np.nan_to_num(columns), 0.0)
    scale = np.sqrt((columns**2).sum(axis=0))
    used = scale > 1e-12
    k = asked.shape[1]
    if not used[:k].all():
        return None
    kept = columns[:, used] / scale[used]
    beside_alone = span(kept[:, k:])
    inside = kept[:, :k] - beside_alone @ (beside_alone.T @ kept[:, :k])
    free = (inside**2).sum(axis=0)
    wanted = np.where(rows, target, 0.0)
    wanted = wanted - beside_alone @ (beside_alone.T @ wanted)
    gram = inside.T @ inside + _RIDGE * np.eye(k)
    blocks = np.unique(stage.block[rows])
    spare = blocks.size - k - beside_alone.shape[1] // 2
    if spare < 4:
        return None
    values = np.linalg.solve(gram, inside.T @ wanted)
    residual = np.where(rows, wanted - inside @ values, 0.0)
    scores = block_scores(inside, residual, stage.block)[blocks]
    inverse = np.linalg.inv(gram)
    covariance = sandwich(inverse, scores, spare, np.diff(blocks) == 1)
    wild = (draws(blocks.size) - 1.0) @ scores @ inverse * np.sqrt(blocks.size / spare)
    unit = scale[used][:k]
    return Fitted(values / unit, covariance / np.outer(unit, unit), (values + wild) / unit, blocks.size, free, residual)


def span(columns: Array) -> Array:
    """An orthonormal basis of some columns, (n, rank)."""
    if not columns.shape[1]:
        return columns
    base, triangle = np.linalg.qr(columns)  # a third of the time of the singular vectors of all rows
    left, size, _ = np.linalg.svd(triangle)
    return np.asarray(base @ left[:, size > 1e-8 * size[0]])


def static_columns(stage: Scene, *, sway: bool = True) -> Array:
    """Columns of a force that depends on the present motion and commands alone, (n, m).

    A constant, speeds, their products and moduli, commands and their squares with sign: everything that this explains
    is no lag, no heading dependence and no drift. `sway` is False where sway speed itself is in doubt.
    """
    u, v, r = (np.nan_to_num(stage.column(name)) for name in ("u", "v", "r"))
    moving = [np.ones_like(u), u, r, u * abs(u), r * abs(r), u * r, abs(u) * r]
    if sway:
        moving += [v, v * abs(v), u * v, v * r, abs(u) * v]
    pushed = [term for c in stage.commands.T for term in (c, c * abs(c), c * abs(u))]
    return np.column_stack([*moving, *pushed])


def earth_columns(stage: Scene) -> Array:
    """Columns that a current or a wind adds to that, (n, 8): harmonics of the heading, alone and times each speed."""
    psi = stage.column("psi")
    turned = np.column_stack([np.cos(psi), np.sin(psi)])
    speeds = [np.nan_to_num(stage.column(name))[:, None] for name in ("u", "v", "r")]
    return np.column_stack([turned, *(speed * turned for speed in speeds)])


def contiguous(stage: Scene) -> list[NDArray[np.intp]]:
    """The rows of each gap-free stretch, in order, without the edges of which nothing is said."""
    ends = np.flatnonzero(np.diff(stage.stretch)) + 1
    edge = round(EDGE / stage.step)
    return [rows[edge : rows.size - edge] for rows in np.split(np.arange(stage.stretch.size), ends)]
