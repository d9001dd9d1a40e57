"""Intervals by block bootstrap: whole blocks are drawn again, because residuals in time are not independent."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from ..physics.frames import Array
from .gram import GramScores
from .options import Option

_SMALL = 1e-12


@dataclass(frozen=True, slots=True)
class Interval:
    """95 % interval of one parameter's total value, in the parameter's unit."""

    lower: float
    upper: float


def block_bootstrap(scores: GramScores, chosen: Sequence[Option], seed: int, draws: int = 400) -> dict[str, Interval]:
    """95 % intervals of every free parameter of a model, by symbol; none for one whose limits leave it no room.

    Blocks are drawn with replacement and the model is fitted to each draw from the blocks' Gram matrices; the interval
    is the estimate -+ t standard deviations, with blocks - 1 degrees of freedom, cut at the physical limits (Efron and
    Tibshirani 1993, chapters 8 and 12).

    Parameters
    ----------
    scores : Gram matrices about the model, in which every chosen option stands at its start
    chosen : the options present in the model
    seed : of the draws
    """
    columns, left, right = scores.block_normal(chosen)
    found: dict[str, Interval] = {}
    if columns.size == 0:
        return found
    rng = np.random.default_rng(seed)
    counts = rng.multinomial(scores.blocks, np.full(scores.blocks, 1.0 / scores.blocks), size=draws).astype(float)
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("kii->i", left), _SMALL))
    normal = np.einsum("dk,kij->dij", counts, left) * (scale[:, None] * scale[None, :])
    normal += 1e-9 * np.eye(columns.size)
    pull = (counts @ right) * scale
    changes = np.linalg.solve(normal, pull[..., None])[..., 0] * scale
    spread = changes.std(axis=0, ddof=1) * np.sqrt(scores.blocks / (scores.blocks - 1))
    reach = float(student.ppf(0.975, scores.blocks - 1)) * spread
    size = {int(column): float(r) for column, r in zip(columns, reach, strict=True)}
    for option in chosen:
        rows = zip(option.symbols, option.start, option.free, option.lower, option.upper, strict=True)
        for symbol, start, index, lower, upper in rows:
            if index >= 0 and lower < upper:
                low, high = start - size[index], start + size[index]
                found[symbol] = Interval(max(low, start + min(lower, 0.0)), min(high, start + max(upper, 0.0)))
    return found


def share_of_draws(passes: Array) -> float:
    """Share of bootstrap draws that pass, never quite 0 or 1: (passed + 1/2) / (draws + 1)."""
    return float((passes.sum() + 0.5) / (passes.size + 1.0))
