"""How often nothing looks as good: the search's first step, rehearsed on a log's own noise in place of the effect.

What the model without an effect leaves is replaced by copies that follow no column, see `noise_copies`. To each copy
every candidate is fitted beside the others, and the best of them counts: the share of copies in which it earns as much
as the effect did is the chance of naming anything from such noise, whatever its name. The guarantee is for noise like
the rehearsed.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from ...physics.file_records import Flag, Record, Whole
from ...physics.frames import Array
from ..candidates.linearisation import Linearisation, Option
from .gram import RIDGE, GramScores
from .noise_copies import REHEARSALS, NoiseCopies, Single
from .scoring import Scoring


class Chance(Record):
    """In how many rehearsals of nothing some effect looked as good: `better` of `of`.

    Attributes
    ----------
    of_noise : whether sensors make the noise of the log, so that a share of rehearsals is a chance
    """

    better: Whole
    of: Whole
    of_noise: Annotated[Flag, Field(exclude_if=bool)] = True

    @property
    def none(self) -> bool:
        """Whether none of them did."""
        return self.better == 0

    @property
    def in_words(self) -> str:
        """What it says of an effect that none of them reached, in a sentence."""
        if not self.of_noise:
            return f"In {self.of} rehearsals of what is left without it no effect looked as good."
        return f"In {self.of} rehearsals of this log's noise without it no effect looked as good: 1 in {self.of + 1:,}."


class _Trial(NamedTuple):
    """A candidate's option on the copies: columns that are free, one that is taken off, its price and limits."""

    free: np.ndarray
    offset: int
    sign: float
    price: float
    limits: tuple[float, float]


class Rehearsals:
    """Copies of what a model leaves, and every candidate fitted to each.

    Parameters
    ----------
    search : prices, floors and the balance
    linear, scores : columns and Gram matrices about the model
    now : the option in which each effect stands in it
    seed : of noise and phases
    """

    def __init__(
        self, search: Scoring, linear: Linearisation, scores: GramScores, now: Mapping[str, Option], seed: int
    ) -> None:
        self._search, self._linear, self._scores, self._now = search, linear, scores, now
        self._gram = scores.gram.sum(axis=0)
        self._noise = np.zeros_like(self._gram) if scores.noise is None else scores.noise.sum(axis=0)
        self._total, self._blur = (np.einsum("a,aij->ij", scores.weight, gram) for gram in (self._gram, self._noise))
        self._copies = NoiseCopies(search.balance, linear.vehicle, seed)

    @cached_property
    def _columns(self) -> Single:
        """(tests, 3, columns + 1), scaled; in single precision, half as much to multiply by copies."""
        return (self._linear.columns / self._scores.scale).astype(np.float32)

    def chance(self, key: str) -> Chance:
        """How often nothing would have looked as good as an effect that stands in the model."""
        gone = self._linear.options[key][1]
        rest = [*(option for name, option in self._now.items() if name != key), gone]
        own = self._trial(self._now[key], gone.offset)
        return self._of(rest, [own], [own, *self._others()])[1]

    def best(self) -> tuple[float, Chance]:
        """What the best effect that the model does not have earns, and how often nothing would have looked as good."""
        others = self._others()
        return self._of(list(self._now.values()), others, others)

    def _of(self, rest: Sequence[Option], own: Sequence[_Trial], every: Sequence[_Trial]) -> tuple[float, Chance]:
        """What the best of some trials earns on the log itself, and how often the best of all does so on a copy."""
        fit = self._scores.fit(rest)
        combination = self._scores.layout(rest)[3]
        combination[fit.columns] -= fit.change * self._scores.scale[fit.columns]
        columns = fit.columns[~fit.held]  # what a limit holds stays held
        share = self._scores.noise_taken(fit.columns)
        left: Single = np.tensordot(self._columns, combination.astype(np.float32), axes=(2, 0))
        square, pull = self._pulled(left.T[:, None])
        mine = self._gains(square, pull - (share * (self._noise @ combination))[:, None], columns, own).max()
        pulled = [self._pulled(copies) for copies in self._copies.of(left)]
        squares, pulls = (np.concatenate(part, axis=1) for part in zip(*pulled, strict=True))
        best = self._gains(squares, pulls, columns, every).max(axis=0)
        return float(mine), Chance(better=int((best >= mine).sum()), of=REHEARSALS, of_noise=self._copies.sensed)

    def _pulled(self, rests: Single) -> tuple[Array, Array]:
        """Squares (3, rests) of rests (3, rests, tests), and their products with the columns (3, rests, columns)."""
        pull = np.stack([rest @ self._columns[:, axis] for axis, rest in enumerate(rests)]).astype(float)
        square = (rests[:, :, None] @ rests[..., None])[..., 0, 0].astype(float)  # as exact as the copies are
        return square, pull

    def _others(self) -> list[_Trial]:
        """Every option of what is not in the model."""
        absent = [candidate.key for candidate in self._search.pool if candidate.key not in self._now]
        return [self._trial(option) for key in absent for option in self._linear.options[key] if option.present]

    def _trial(self, option: Option, gone: int = -1) -> _Trial:
        """An option beside the model; `gone` is the offset that took it out, where it stood there."""
        places = [k for k, index in enumerate(option.free) if index >= 0]
        free = np.array([option.free[k] for k in places], dtype=int)
        limits = (-np.inf, np.inf)
        if free.size == 1 and gone < 0:
            size = float(self._scores.scale[free[0]])
            limits = (option.lower[places[0]] * size, option.upper[places[0]] * size)
        offset, sign = (gone, -1.0) if gone >= 0 else (option.offset, 1.0)
        return _Trial(free, offset, sign, self._search.price_of(option), limits)

    def _solved(self, columns: np.ndarray, pull: Array, last: tuple[float, float] | None = None) -> tuple[Array, Array]:
        """Coefficients (rests, p) for pulls (p, rests), and the Gram matrices on each axis (3, p, p), cleared of noise.

        The last coefficient stays within limits, where there are any.
        """
        share = self._scores.noise_taken(columns)
        both = np.ix_(columns, columns)
        curve = self._total[both] - share * self._blur[both] + RIDGE * self._scores.tests * np.eye(columns.size)
        solved = np.linalg.solve(curve, pull).T if columns.size else np.zeros((pull.shape[1], 0))
        if last is not None:
            held = np.clip(solved[:, -1], *last)
            solved = solved + (held - solved[:, -1])[:, None] * _following(curve)
        rows = columns[:, None]
        return solved, self._gram[:, rows, columns] - share * self._noise[:, rows, columns]

    def _gains(self, square: Array, pull: Array, kept: np.ndarray, trials: Sequence[_Trial]) -> Array:
        """Log-likelihood that each option earns beside the kept columns on each rest, (options, rests).

        Parameters
        ----------
        square, pull : of the rests, see `_pulled`; of the log's own without what sensor noise makes of the products,
            which copies do not have, for they follow no column
        kept : columns of the model without the effect, fitted again to each rest
        """
        before = self._worth(self._left(square, pull[:, :, kept], kept))
        gains = np.empty((len(trials), square.shape[1]))
        for k, trial in enumerate(trials):
            columns, limits = np.concatenate([kept, trial.free]), trial.limits if trial.free.size == 1 else None
            squares, pulls = square, pull[:, :, columns]
            if trial.offset >= 0:
                by = self._scores.scale[trial.offset] * trial.sign
                gram = self._gram[:, trial.offset] - self._noise[:, trial.offset]
                squares = square - 2.0 * by * pull[:, :, trial.offset] + by**2 * gram[:, trial.offset, None]
                pulls = pulls - by * gram[:, None, columns]
            gains[k] = before - self._worth(self._left(squares, pulls, columns, limits)) - trial.price
        return gains

    def _left(self, square: Array, pull: Array, columns: np.ndarray, last: tuple[float, float] | None = None) -> Array:
        """Summed squared errors on each axis, (3, rests), of a fit of columns to rests, with these columns' pulls."""
        weighted = np.tensordot(self._scores.weight, pull, axes=1)
        solved, inner = self._solved(columns, weighted.T, last)
        return np.asarray(square + np.einsum("arp,rp->ar", solved @ inner - 2.0 * pull, solved))

    def _worth(self, left: Array) -> Array:
        error = np.maximum(left, 0.0) / self._scores.tests + self._search.floor[:, None]
        return np.asarray(0.5 * self._search.balance.independent * np.log(error).sum(axis=0))


def _following(curve: Array) -> Array:
    """How the other coefficients follow the last one (p,), itself 1."""
    others = -np.linalg.solve(curve[:-1, :-1], curve[:-1, -1]) if curve.shape[0] > 1 else np.zeros(0)
    return np.append(others, 1.0)
