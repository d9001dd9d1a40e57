"""Sparse regression on factors: pysindy's optimizers, on as many rows as there are columns.

An optimizer that asks of its rows only how far a model is from them gives on a factor what it gives on all rows.
Ensembles draw whole blocks, as residuals in time are not independent (Fasel et al. 2022, doi:10.1098/rspa.2021.0904,
with blocks in place of rows).
"""

import warnings
from dataclasses import dataclass

import numpy as np

from ...measurements.statistics.blocks import block_draws
from ...measurements.statistics.single_threaded import single_threaded
from ...physics.errors import RequestError
from ...physics.frames import Array
from .factors import Column, Factors

_LEAST_BLOCKS = 4
"""Blocks below which draws of them say nothing of chance."""


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """Sparse models of many draws.

    Attributes
    ----------
    columns, targets : what was regressed on what
    coefficients : (draws, targets, columns), each in its target's unit over its column's
    """

    columns: tuple[Column, ...]
    targets: tuple[Column, ...]
    coefficients: Array

    @property
    def inclusion(self) -> Array:
        """Share of the draws that keep each column, (targets, columns)."""
        return (self.coefficients != 0.0).mean(axis=0)

    @property
    def median(self) -> Array:
        """Median coefficient of the draws, (targets, columns); zero where fewer than half keep a column."""
        return np.asarray(np.median(self.coefficients, axis=0))


def forward(factors: Factors, target: int, most: int) -> list[int]:
    """Columns that forward orthogonal regression takes for a target (Billings 2013, chapter 3), in their order here."""
    import pysindy  # here, because it takes a third of a second and few logs ask for terms

    size = _sizes(factors)
    rows, y = _parted(factors.whole, size)
    optimizer = pysindy.FROLS(max_iter=min(most, size.size - 1), alpha=0.0, unbias=False)
    optimizer.fit(rows, y[:, target])
    return np.flatnonzero(optimizer.history_[-1][0]).tolist()


@single_threaded
def ensemble(factors: Factors, threshold: float, *, ridge: float = 0.0, draws: int = 100, seed: int = 0) -> Ensemble:
    """Sequentially thresholded least squares (Brunton, Proctor and Kutz 2016) on many draws of the blocks.

    Parameters
    ----------
    threshold : share of a target's root mean square; a column whose part of the target is smaller is left out
    ridge : penalty of the squared parts of the columns, as a share of the squared rows
    draws : models
    seed : of the draws

    Raises
    ------
    RequestError
        when there are fewer than four blocks.
    """
    if factors.blocks < _LEAST_BLOCKS:
        raise RequestError(
            f"ensemble: expected at least {_LEAST_BLOCKS} blocks to draw from, got {factors.blocks}; give a longer log"
        )
    size = _sizes(factors)
    found = np.zeros((draws, len(factors.targets), len(factors.columns)))
    for models, counts in zip(found, block_draws(factors.blocks, draws, seed), strict=True):
        count = float(counts @ factors.rows)
        rows, y = _parted(factors.drawn(counts), size)
        level = np.sqrt((y**2).sum(axis=0) / count)
        for target in np.flatnonzero(level):
            told = _thresholded(rows, y[:, target] / level[target], threshold, ridge * count)
            models[target] = told * level[target] / size
    return Ensemble(factors.columns, factors.targets, found)


def _sizes(factors: Factors) -> Array:
    """Root mean square of each column over all blocks, (p,); one for a column of zeros."""
    whole = factors.whole[:, : len(factors.columns)]
    size = np.sqrt((whole**2).sum(axis=0) / float(factors.rows.sum()))
    return np.where(size > 0.0, size, 1.0)


def _parted(whole: Array, size: Array) -> tuple[Array, Array]:
    """Columns, divided by their sizes, and targets of a factor: (k, p) and (k, targets)."""
    return whole[:, : size.size] / size, whole[:, size.size :]


def _thresholded(rows: Array, y: Array, threshold: float, ridge: float) -> Array:
    """Coefficients (p,) of rows (k, p)."""
    import pysindy

    optimizer = pysindy.STLSQ(threshold=threshold, alpha=ridge, max_iter=rows.shape[1] + 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no column is an answer, too
        optimizer.fit(rows, y)
    return np.asarray(optimizer.coef_[0], dtype=float)
