"""Surrogate tests: how often pure noise looks as good as an effect, on 999 copies of a log's own residual.

A copy has the residual's colour and size and follows no column: sensor noise is drawn anew and passed through the
balance; of what exceeds it at each frequency, phases are randomised, alike for all axes, block by block (Theiler et al.
1992). To each copy every candidate is fitted, and the best counts, so the chance is that of naming anything. The
guarantee is for noise like the copies.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Annotated, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ...physics.file_records import Flag, Record, Whole
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..candidates.linearisation import Linearisation, Option
from .gram import RIDGE, GramScores
from .scoring import Scoring

Single = NDArray[np.float32]
SURROGATES = 999
"""How many draws are looked at: where none of them looks as good as the log, that is 1 in 1,000."""
_NUMBERS = 500_000
"""Numbers of the copies that are worked on at a time, in single precision: 2 MB."""
_SLOWEST = 4
"""Slowest waves of a rest that tell how large the mean of noise of its colour is: no number that decides."""
_LEAST_SIZE = 0.1
"""Least size of the rest in a block, as a share of its size in the whole log, a regulariser: no block is without
noise."""
_TOLD = 64
"""How many draws of sensor noise the spectrum is the mean of: it is then known to an eighth at each frequency."""
_BROAD, _FEW = 0.125, 12
"""Half the band in which spectra are compared: this share of the frequency, and never fewer frequencies than so
many."""


class NoiseCopies:
    """Copies of rests of a balance, drawn with the same noise and phases for every rest.

    Parameters
    ----------
    balance : whose tests the rests are of
    vehicle : model near which the rests are left, through whose balance the noise of sensors passes
    seed : of noise and phases
    """

    def __init__(self, balance: Balance, vehicle: Vehicle, seed: int) -> None:
        from scipy.fft import next_fast_len  # loaded where a search needs it

        self._balance, self._vehicle, self._seed, self._rows = balance, vehicle, seed, balance.bins
        places = max(balance.time.size // self._rows, 1)
        self._length = cast("int", next_fast_len(places, real=True))

    @property
    def sensed(self) -> bool:
        """True when noise of sensors is in them, passed through the balance."""
        return self._drawn is not None

    @property
    def _drawn(self) -> Single | None:
        return self._balance.propagated_noise(self._vehicle, SURROGATES, self._seed)

    def of(self, left: Single) -> Iterator[Single]:
        """Copies of a rest (tests, 3) as (3, copies, tests), some at a time, `SURROGATES` in all."""
        sensed = self._drawn
        if sensed is None:
            yield from self._by_phases(left)
            return
        # What passes through a model must not be louder than what it leaves.
        share = np.minimum(1.0, _size(left.T) / np.maximum(_size(sensed[:, :_TOLD]), np.finfo(np.float32).tiny))
        start = 0
        for drawn in self._by_phases(self._surplus(left, share * sensed[:, :_TOLD])):
            drawn += share * sensed[:, start : start + drawn.shape[1]]
            start += drawn.shape[1]
            yield drawn

    def _surplus(self, left: Single, sensed: Single) -> Single:
        """What a rest (tests, 3) has at each frequency beyond sensor noise (3, copies, tests)."""
        size = self._sizes(left).astype(float)
        spectrum = np.fft.rfft(left / size, axis=0)
        white = (np.abs(np.fft.rfft(sensed / size.T[:, None])) ** 2).mean(axis=1).T
        ratio = np.divide(np.abs(spectrum) ** 2, white, out=np.zeros(white.shape), where=white > 0.0)
        beyond = np.sqrt(1.0 - 1.0 / np.maximum(_near_by(ratio), 1.0))
        beyond[:, ~white.any(axis=0)] = 1.0  # no noise of sensors comes to this axis
        return np.asarray(np.fft.irfft(beyond * spectrum, left.shape[0], axis=0) * size, np.float32)

    def _by_phases(self, left: Single) -> Iterator[Single]:
        """Copies of a rest by its phases alone."""
        size = self._sizes(left)
        places = left.shape[0] // self._rows
        white = (left / size).reshape(places, self._rows * 3) * np.float32(np.sqrt(self._length / places))
        spectrum = np.asarray(np.fft.rfft(white, self._length, axis=0), np.complex64).T[:, None]
        step = max(1, _NUMBERS // (3 * left.shape[0]))
        for start in range(0, SURROGATES, step):
            turned = spectrum * self._turns[start : start + step]
            slowest = spectrum[..., 1 : _SLOWEST + 1]
            slowest = slowest * self._means[start : start + step, : slowest.shape[-1]]
            turned[..., 0] = np.sqrt(2.0 / max(slowest.shape[-1], 1)) * slowest.real.sum(axis=-1)
            drawn = np.asarray(np.fft.irfft(turned, self._length, axis=2), np.float32)[:, :, :places]
            drawn = drawn.reshape(self._rows, 3, -1, places).transpose(1, 2, 3, 0)
            yield drawn.reshape(3, drawn.shape[1], -1) * size.T[:, None]

    @cached_property
    def _turns(self) -> NDArray[np.complex64]:
        """By how much each frequency is turned in each copy, (copies, frequencies); the fastest has a sign only."""
        result = np.empty((SURROGATES, self._length // 2 + 1), np.complex64)
        rng = np.random.default_rng([self._seed, SURROGATES])
        for copy in result:
            angles = rng.random(copy.size, dtype=np.float32)
            if self._length % 2 == 0:
                angles[-1] = np.round(angles[-1]) / 2.0
            np.exp(np.complex64(2j * np.pi) * angles, out=copy)
        return result

    @cached_property
    def _means(self) -> NDArray[np.complex64]:
        """By how much the slowest waves are turned that the mean of each copy is made of, (copies, waves)."""
        angles = np.random.default_rng([self._seed, SURROGATES, _SLOWEST]).random((SURROGATES, _SLOWEST))
        return np.asarray(np.exp(2j * np.pi * angles), np.complex64)

    def _sizes(self, left: Single) -> Single:
        """Root mean square of the rest in the block of each test, (tests, 3)."""
        block = self._balance.block
        count = np.bincount(block)
        square = np.stack([np.bincount(block, left[:, axis] ** 2) / count for axis in range(3)], axis=1)
        least = _LEAST_SIZE**2 * np.maximum((left**2).mean(axis=0), np.finfo(np.float32).tiny)
        return np.sqrt(np.maximum(square, least))[block].astype(np.float32)


def _size(rest: Single) -> Single:
    """Root mean square on each axis (3, 1, 1)."""
    return np.asarray(np.sqrt((rest**2).reshape(3, -1).mean(axis=1)), np.float32)[:, None, None]


def _near_by(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Mean over frequencies (n, 3) near each; the slowest, which is the mean of the log, is no one's neighbour."""
    place = np.arange(len(values))
    reach = np.maximum(_FEW, (_BROAD * place).astype(int))
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(values, axis=0)])
    first, last = np.maximum(place - reach, 1), np.minimum(place + reach + 1, len(values))
    return np.asarray((sums[last] - sums[first]) / (last - first)[:, None])


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
        """True when none of them did."""
        return self.better == 0

    @property
    def in_words(self) -> str:
        """A sentence on an effect that none of the copies reached."""
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


class SurrogateTest:
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
        self._noise = scores.noise.sum(axis=0)
        self._total, self._blur = (np.einsum("a,aij->ij", scores.weight, gram) for gram in (self._gram, self._noise))
        self._copies = NoiseCopies(search.balance, linear.vehicle, seed)

    @cached_property
    def _columns(self) -> Single:
        """(tests, 3, columns + 1), scaled; in single precision, half as much to multiply by copies."""
        return (self._linear.columns / self._scores.scale).astype(np.float32)

    def chance(self, key: str) -> Chance:
        """Chance by which pure noise looks as good as an effect that stands in the model."""
        gone = self._linear.options[key][1]
        rest = [*(option for name, option in self._now.items() if name != key), gone]
        own = self._trial(self._now[key], gone.offset)
        return self._of(rest, [own], [own, *self._others()])[1]

    def best(self) -> tuple[float, Chance]:
        """Gain of the best effect that the model does not have, and the chance by which pure noise looks as good."""
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
        return float(mine), Chance(better=int((best >= mine).sum()), of=SURROGATES, of_noise=self._copies.sensed)

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
        before = self._worth(self._residual_squares(square, pull[:, :, kept], kept))
        gains = np.empty((len(trials), square.shape[1]))
        for k, trial in enumerate(trials):
            columns, limits = np.concatenate([kept, trial.free]), trial.limits if trial.free.size == 1 else None
            squares, pulls = square, pull[:, :, columns]
            if trial.offset >= 0:
                by = self._scores.scale[trial.offset] * trial.sign
                gram = self._gram[:, trial.offset] - self._noise[:, trial.offset]
                squares = square - 2.0 * by * pull[:, :, trial.offset] + by**2 * gram[:, trial.offset, None]
                pulls = pulls - by * gram[:, None, columns]
            gains[k] = before - self._worth(self._residual_squares(squares, pulls, columns, limits)) - trial.price
        return gains

    def _residual_squares(
        self, square: Array, pull: Array, columns: np.ndarray, last: tuple[float, float] | None = None
    ) -> Array:
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
