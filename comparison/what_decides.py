"""What decides between models on the same rows: their rollouts where these are enough, else their acceleration."""

from collections.abc import Sequence
from typing import NamedTuple

from ..measurements.statistics.paired import MATERIAL, paired_ratio
from ..physics.frames import Array
from ..residuals.scores import Errors
from .differences import rolled, rows_of, squares

_AXES = 3
"""Of the columns of rollout errors, the speeds; the position follows from them."""
_HORIZONS, _BLOCKS = ("10", "2"), 3
"""Rollouts that may decide [s], and how many of them the judged rows must hold one after the other."""


class Decides(NamedTuple):
    """What is compared.

    Attributes
    ----------
    what : in words; empty where the rows are too few for anything
    shortest : rows of a block
    squares : squared errors (n, 3) of each model
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
    table = [rolled(errors, horizon)[:, :_AXES] for errors in every]
    return Decides(f"the speeds predicted over {horizon} s", rows_of(every[0], horizon), table, horizon)


def _can_tell(table: list[Array], shortest: int) -> bool:
    """Whether the rows are enough for an interval, without which nothing beats anything."""
    return any(paired_ratio(other, table[0], shortest).ci95 is not None for other in table[1:] or table)


def loses(after: Errors, before: Errors, than: str, *, by_chance_too: bool = False) -> str:
    """How a model errs more than another on the same rows, after "the model ..."; empty where it does not.

    Parameters
    ----------
    than : what the other is, in words
    by_chance_too : a loss that may be chance is one, too, and the longest rollouts tell it, however few they are
    """
    runs_away = _diverged(after) - _diverged(before)
    if runs_away:
        return f"runs away within {min(runs_away, key=float)} s, which it does not {than}"
    decides = what_decides([before, after])
    longest = next((horizon for horizon in _HORIZONS if horizon in after.rollouts), None)
    if by_chance_too and longest is not None:
        decides = _over(longest, [before, after])
    found = paired_ratio(decides.squares[1], decides.squares[0], decides.shortest)
    worse = found.relative > MATERIAL if by_chance_too or not decides.what else found.verdict == "worse"
    what = decides.what or "acceleration"
    return f"errs {100.0 * found.relative:.0f} % more in {what} than {than}" if worse else ""


def _diverged(errors: Errors) -> set[str]:
    """Horizons over which a rollout runs away."""
    return {horizon for horizon, found in errors.rollouts.items() if found.score.diverged}
