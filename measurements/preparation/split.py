"""Chronological division of every log into train, validation and test, filtered only after the cut."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from ...physics.errors import LogError
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..log import Log
from .dataset import PAPER, DataSet, Recipe
from .derive import smooth
from .prepare import prepare

PARTS = ("train", "validation", "test")
LEAST_PIECE = 1.0
"""A piece shorter than this [s] is dropped: it holds no more than the ends of a filter."""


@dataclass(frozen=True, slots=True)
class Split:
    """Three data sets that share no sample and no filter window."""

    train: DataSet
    validation: DataSet
    test: DataSet


def split(data: DataSet, recipe: Recipe | None = None) -> Split:
    """Divide each log of a data set in the order of time, by the shares and the guard of its recipe.

    The first share of the usable seconds of *every* log is for training, the next for validation, the last for test.
    The guard is dropped around each boundary, half on either side. If the recipe has a cutoff, each piece is filtered
    on its own, from the unfiltered motions, so no value of one part reaches another.

    Parameters
    ----------
    recipe : in the place of that of the data, for motions that were left without the filter that it asks for

    Raises
    ------
    LogError
        when a part with a positive share ends up with no motion.
    """
    recipe = recipe or data.recipe
    pieces: dict[str, list[Motion]] = {part: [] for part in PARTS}
    dropped = 0.0
    for _, group in groupby(data.raw, key=lambda motion: motion.source):
        dropped += _divide(tuple(group), recipe, pieces)
    for part, share in zip(PARTS, recipe.shares, strict=True):
        if share > 0 and not pieces[part]:
            raise LogError(
                f"expected motion for the {part} part ({share:.0%} of each log), got none from {data.seconds:.1f} s "
                f"with a guard of {recipe.guard:g} s. Give a longer log, other shares or a shorter guard."
            )
    shares = "/".join(f"{100 * share:.0f}" for share in recipe.shares)
    notes = [*data.notes, f"split: chronological {shares} of each log, guard {recipe.guard:g} s"]
    if dropped:
        notes.append(f"split: pieces under {LEAST_PIECE:g} s dropped, {dropped:.1f} s in all")
    return Split(*(filtered(tuple(pieces[part]), tuple(notes), recipe) for part in PARTS))


def paper_preparation(logs: Log | Sequence[Log], vehicle: Vehicle, recipe: Recipe = PAPER) -> Split:
    """Prepare as the paper does, in the right order: resample, split, filter each part on its own.

    Standardise afterwards with `Standardisation.fit(split.train.motions)`, and differentiate with `accelerations`.

    Raises
    ------
    LogError, RequestError
        see `prepare` and `split`.
    """
    return split(prepare(logs, vehicle, recipe))


def _divide(motions: tuple[Motion, ...], recipe: Recipe, pieces: dict[str, list[Motion]]) -> float:
    """Cut the motions of one log; the clock counts usable seconds only, so that gaps do not shift the shares."""
    total = sum(motion.duration for motion in motions)
    ends = total * np.cumsum(recipe.shares)
    half = 0.5 * recipe.guard
    dropped = 0.0
    for part, low, high in zip(PARTS, (0.0, *ends[:-1]), ends, strict=True):
        low = low + half if low > 0 else low
        high = high - half if high < total - 1e-9 else np.inf
        begun = 0.0
        for motion in motions:
            clock = begun + motion.time - motion.time[0]
            begun += motion.duration
            start, stop = np.searchsorted(clock, (low - 1e-9, high - 1e-9))
            seconds = (stop - start - 1) * motion.time_step
            if seconds >= LEAST_PIECE:
                pieces[part].append(motion.slice(int(start), int(stop)))
            elif stop > start:
                dropped += max(seconds, 0.0)
    return dropped


def filtered(motions: tuple[Motion, ...], notes: tuple[str, ...], recipe: Recipe) -> DataSet:
    """Motions with the filter that a recipe asks for, each on its own."""
    if recipe.cutoff is None:
        return DataSet(motions, notes, recipe)
    smoothed = tuple(smooth(motion, recipe.cutoff, recipe.order) for motion in motions)
    return DataSet(smoothed, notes, recipe, motions)
