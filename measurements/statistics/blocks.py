"""Blocks of rows that err together: errors of a fit that count blocks instead of rows, and draws of whole blocks."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...physics.frames import Array


def block_scores(columns: Array, errors: Array, block: NDArray[np.int64]) -> Array:
    """Gradient of half the squared error of a fit in each block, (blocks, p).

    Parameters
    ----------
    columns : (n, p)
    errors : (n,) that the fit leaves, each times the weight of its row
    block : (n,) number of the block that each row belongs to
    """
    return np.array([np.bincount(block, errors * column) for column in columns.T], dtype=float).T


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
    """
    rng = np.random.default_rng(seed)
    found = rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), size=draws).astype(float)
    found.flags.writeable = False
    return found


@lru_cache(maxsize=2)
def block_weights(blocks: int, draws: int, seed: int | tuple[int, ...]) -> Array:
    """Weights of blocks in each draw of a Bayesian bootstrap, (draws, blocks), of mean 1 (Rubin 1981).

    Their first two moments are those of draws with replacement, less by 2 in `blocks` + 1, but no block is ever without
    any: what one block alone tells of stays told.
    """
    found = blocks * np.random.default_rng(seed).dirichlet(np.ones(blocks), size=draws)
    found.flags.writeable = False
    return found


def share_of_draws(passes: NDArray[np.bool_]) -> float:
    """Share of bootstrap draws that pass, never quite 0 or 1: (passed + 1/2) / (draws + 1)."""
    return float((passes.sum() + 0.5) / (passes.size + 1.0))
