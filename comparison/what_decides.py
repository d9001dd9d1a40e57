"""What decides between models on the same rows: their rollouts where these are enough, else their acceleration."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..measurements.statistics.blocks import paired_ratio
from ..physics.motion import Array
from ..residuals.scores import Errors
from .differences import rolled, rows_of, squares

_AXES = 3
"""Of the columns of rollout errors, the speeds; the position follows from them."""
_HORIZONS, _BLOCKS = ("10", "2"), 3
"""Rollouts that may decide [s], and how many of them the judged rows must hold one after the other."""
_NOISE_KNOWN = 0.1
"""Share of a squared error that stays where all of it may be noise of the sensors, whose size is known to a tenth or
so: an error is then told as smaller by no more than two thirds of what the noise makes."""


class Decides(NamedTuple):
    """What is compared.

    Attributes
    ----------
    what : in words; empty where the rows are too few for anything
    shortest : rows of a block
    squares : squared errors (n, 3) of each model, those of speeds less the noise of the sensors, which is no model's
    horizon : of the predictions [s]; empty for accelerations
    """

    what: str
    shortest: int
    squares: list[Array]
    horizon: str = ""


def what_decides(every: Sequence[Errors]) -> Decides:
    """What decides between models by their errors: speeds over 10 s, over 2 s where these are too few, acceleration."""
    for horizon in _HORIZONS:
        if horizon in every[0].rollouts:
            found = _over(horizon, every)
            if found.squares[0].shape[0] >= _BLOCKS * found.shortest and _can_tell(found.squares, found.shortest):
                longer = f" (the rows are too few for {_HORIZONS[0]} s)" if horizon != _HORIZONS[0] else ""
                return found._replace(what=f"{found.what}{longer}")
    table = [squares(errors) for errors in every]
    return Decides("acceleration" if _can_tell(table, 1) else "", 1, table)


def _over(horizon: str, every: Sequence[Errors]) -> Decides:
    """The speeds of rollouts over a horizon, however few these are."""
    table = [_less_noise(rolled(errors, horizon)[:, :_AXES], errors.noise) for errors in every]
    return Decides(f"the speeds predicted over {horizon} s", rows_of(every[0], horizon), table, horizon)


def _less_noise(squares: Array, noise: Array) -> Array:
    """Squared errors (n, 3) without what the noise of the sensors adds to their mean."""
    return squares - np.minimum(noise, (1.0 - _NOISE_KNOWN) * squares.mean(axis=0))


def _can_tell(table: list[Array], shortest: int) -> bool:
    """Whether the rows are enough for an interval, without which nothing beats anything."""
    return any(paired_ratio(other, table[0], shortest).ci95 is not None for other in table[1:] or table)


def share_of_error(errors: Errors, nominal: Errors, motion: Array) -> float:
    """Squared error of a model on rows as a share of the nominal model's, each speed in units of how much it varies.

    Of predictions over 10 s, of 2 s or of the acceleration where the rows hold no longer ones. No end of it where the
    model runs away within that time and the nominal one does not.

    Parameters
    ----------
    motion : (3,) mean square of each measured speed [m^2/s^2, m^2/s^2, rad^2/s^2]
    """
    horizon = next((horizon for horizon in _HORIZONS if horizon in errors.rollouts), None)
    if horizon in _diverged(errors) - _diverged(nominal):
        return float(np.inf)
    own, before = (
        np.mean(squares(e) if horizon is None else rolled(e, horizon)[:, :_AXES], axis=0) for e in (errors, nominal)
    )
    unit = np.maximum(motion, np.finfo(float).tiny)
    return float((own / unit).sum() / max(float((before / unit).sum()), np.finfo(float).tiny))


def _diverged(errors: Errors) -> set[str]:
    """Horizons over which a rollout runs away."""
    return {horizon for horizon, found in errors.rollouts.items() if found.score.diverged}
