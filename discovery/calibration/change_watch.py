"""Change detection while a boat runs: an e-process over blocks of some seconds, with a budget of false alarms.

For every possible onset and parameter the rows since are weighed by a likelihood ratio of change to none; each has mean
one under no change. Their sum is the detector of Shiryaev and Roberts (Shin, Ramdas and Rinaldo 2024, definition 2.5).
Rows are neither independent nor normal, so the noise variance is widened until surrogate runs, made of the run-in's
own residual with random places and signs, keep the budget.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from ...measurements.statistics.blocks import CI
from ...physics.errors import RequestError
from ...physics.motion import Array
from .forgetting_fit import AdaptationPrior

_KEPT = ((6, 1), (24, 4), (120, 12), (960, 48))
"""Blocks back up to which every n-th may be the first of a change: to leave candidates out can only lower the sum, and
neighbours of so long ago tell the same. The last is an hour back."""
_VAGUE = 10.0
"""Deviation of the values before a change, in plausible amounts: as good as unknown, and matrices can be solved."""
_ALIKE = 0.1
"""Share of the weight of the likeliest parameter from which another may have changed as well."""
_SURE = 0.95
"""Weight of the blocks between which a change began."""


@dataclass(frozen=True, slots=True)
class AlarmSettings:
    """The budget of false alarms.

    Attributes
    ----------
    hours : under way, in which one false alarm may be expected, over all parameters together [h]
    block : rows in which a change may begin, by the time under way that they last [s]; neighbours overlap by one
        support of a test function
    scatter : deviation by which each parameter seems to be another from block to block, in plausible amounts, for no
        model is whole; what changes by less is hardly noticed
    seed : of the rehearsal

    Raises
    ------
    RequestError
        when a number is out of range.
    """

    hours: float = 24.0
    block: float = 4.0
    scatter: float = 0.1
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("hours", "block", "scatter"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise RequestError(f"adapt: expected {name} of the alarm above 0, got {getattr(self, name):g}")

    @property
    def threshold(self) -> float:
        """Blocks that one false alarm may cost, which is what the detector must pass."""
        return max(3600.0 * self.hours / self.block, 2.0)


@dataclass(frozen=True, slots=True)
class Alarm:
    """A change that was noticed.

    Attributes
    ----------
    time : when [s]
    symbol : the parameter that changed, as likely as any
    alike : others of which the rows tell no less that they changed
    since, earliest, latest : when it began, and between which instants it did so with 95 % [s]
    before, after : its value [its unit]
    half : of the 95 % interval of the difference, where nothing else changed
    """

    time: float
    symbol: str
    alike: tuple[str, ...]
    since: float
    earliest: float
    latest: float
    before: float
    after: float
    half: float


def candidate_onsets(last: int | np.ndarray, first: np.ndarray, spacing: Sequence[tuple[int, int]]) -> np.ndarray:
    """Which onsets of a change are thought of: every one of late, and ever fewer the longer ago.

    Parameters
    ----------
    last, first : numbers of the last block, and of the first with the change
    spacing : how far back up to which every n-th is kept, and n
    """
    kept, low = np.zeros(first.shape, dtype=bool), 0
    for high, every in spacing:
        kept |= (last - first >= low) & (last - first < high) & (first % every == 0)
        low = high
    return kept


class Detector:
    """The sum of Shiryaev and Roberts over several boats that are excited alike and see other noise.

    Parameters
    ----------
    amounts : (p,) plausible changes
    widening : of the variance of the noise

    Attributes
    ----------
    starts : number of the first block since each candidate, in turn
    logs : (candidates, p, boats) logarithm of each ratio after the last block
    """

    def __init__(self, amounts: Array, widening: float = 1.0, boats: int = 1) -> None:
        self._amounts, self._widening, self._boats = amounts, widening, boats
        self.reset()

    def reset(self) -> None:
        """Begin anew: nothing is known of where the parameters are."""
        p = self._amounts.size
        self.information, self.score = np.zeros((p, p)), np.zeros((p, self._boats))
        self.count, self.starts = 0, np.zeros(0, dtype=int)
        # What was known before each candidate.
        self._information, self._score = np.zeros((0, p, p)), np.zeros((0, p, self._boats))
        self.logs = np.zeros((0, p, self._boats))

    def take(self, information: Array, score: Array) -> Array:
        """Take a block: (p, p) squares of its columns, and (p, boats) their products with what is unexplained.

        Both over the noise, in units of the plausible amounts. Gives the logarithm of the sum, (boats,).
        """
        if self.count:
            self.starts = np.append(self.starts, self.count)
            self._information = np.concatenate([self._information, self.information[None]])
            self._score = np.concatenate([self._score, self.score[None]])
        self.count += 1
        self.information = self.information + information / self._widening
        self.score = self.score + score / self._widening
        self._prune()
        if not self.starts.size:
            return np.full(self._boats, -np.inf)
        precision, pull = self._precision()
        self.logs = 0.5 * pull**2 / precision[:, :, None] - 0.5 * np.log(precision)[:, :, None]
        return logsumexp(self.logs, axis=(0, 1)) - np.log(self._amounts.size)

    def _precision(self) -> tuple[Array, Array]:
        """Precision (candidates, p) of the size of a change of one parameter since each, and its score."""
        since = self.information - self._information
        whole = self.information + np.eye(self._amounts.size) / _VAGUE**2
        solved = np.linalg.solve(whole, since)
        precision = np.einsum("mjj->mj", since) - np.einsum("mij,mij->mj", since, solved) + 1.0
        level = np.linalg.solve(whole, self.score)
        pull = self.score - self._score - np.einsum("mij,ir->mjr", since, level)
        return np.maximum(precision, 1.0), pull

    def _prune(self) -> None:
        kept = candidate_onsets(self.count - 1, self.starts, _KEPT)
        self.starts, self._information, self._score = self.starts[kept], self._information[kept], self._score[kept]

    def change(self, candidate: int, parameter: int) -> tuple[float, float, float]:
        """Value before, change since a candidate, and its deviation, in plausible amounts from the start; of boat 0."""
        precision, pull = self._precision()
        size = float(pull[candidate, parameter, 0] / precision[candidate, parameter])
        since = (self.information - self._information[candidate])[:, parameter]
        whole = self.information + np.eye(self._amounts.size) / _VAGUE**2
        level = np.linalg.solve(whole, self.score[:, 0] - since * size)
        return float(level[parameter]), size, float(precision[candidate, parameter] ** -0.5)


class ChangeWatch:
    """Looks for changes in the rows that inform.

    Parameters
    ----------
    known : of the boat and its log, and what is followed
    settings : budget
    widening : of the variance of the noise, from the rehearsal
    """

    def __init__(self, known: AdaptationPrior, settings: AlarmSettings, widening: float) -> None:
        self._known, self._amounts, self._share = known, known.amounts[: known.watched], known.settings.share
        self._rows, self._settings = rows_of(settings, known), settings
        self.widening = widening
        self._detector = Detector(self._amounts, widening)
        self._begins: dict[int, float] = {}
        self._block()

    def _block(self) -> None:
        p = self._amounts.size
        self._information, self._score, self._taken = np.zeros((p, p)), np.zeros((p, 1)), 0
        self._squares, self._numbers = 0.0, 0

    def take(self, time: float, columns: Array, balance: Array) -> Alarm | None:
        """Take a row of each axis that informs, over the noise (see `ForgettingFit.take`); an alarm if it rings.

        Parameters
        ----------
        time : in the log [s]
        columns : derivative of the force by each parameter (3, p), over the noise
        balance : missing force (3,), over the noise
        """
        if not self._taken:
            self._begins[self._detector.count] = time
        moved = columns[:, : self._amounts.size] * self._amounts
        self._information += self._share * moved.T @ moved
        self._score += self._share * (moved.T @ balance)[:, None]
        self._squares, self._numbers = self._squares + float(balance @ balance), self._numbers + balance.size
        self._taken += 1
        if self._taken < self._rows:
            return None
        kept = with_scatter(self._information / self._misfit, self._settings.scatter) / self._misfit
        (total,) = self._detector.take(kept @ self._information, kept @ self._score)
        known = {*self._detector.starts.tolist(), self._detector.count}
        self._begins = {n: at for n, at in self._begins.items() if n in known}
        self._block()
        if total < np.log(self._settings.threshold):
            return None
        result = self._alarm(time)
        self._detector.reset()
        self._begins.clear()
        return result

    @property
    def _misfit(self) -> float:
        """Mean square of what no values explain of this block, 1 at least: rough water, or a change in its midst."""
        p = self._amounts.size
        level = np.linalg.solve(self._information + 1e-6 * np.eye(p), self._score)
        left = self._squares - float(self._score[:, 0] @ level[:, 0]) / self._share
        return max(1.0, left / max(self._numbers - p, 1))

    def _alarm(self, time: float) -> Alarm:
        logs = self._detector.logs[:, :, 0]
        weight = np.exp(logs - logs.max())
        each = weight.sum(axis=0)
        parameter = int(np.argmax(each))
        symbols, order = self._known.symbols, np.argsort(-each).tolist()
        alike = tuple(symbols[k] for k in order if k != parameter and each[k] >= _ALIKE * each[parameter])
        candidate = int(np.argmax(weight[:, parameter]))
        began = np.array([self._begins[n] for n in self._detector.starts.tolist()])
        passed = np.cumsum(weight[:, parameter]) / each[parameter]
        low, high = np.searchsorted(passed, [0.5 * (1.0 - _SURE), 0.5 * (1.0 + _SURE)])
        before, size, deviation = self._detector.change(candidate, parameter)
        unit, start = float(self._amounts[parameter]), float(self._known.start[parameter])
        return Alarm(
            time,
            symbols[parameter],
            alike,
            float(began[candidate]),
            float(began[low]),
            float(began[min(int(high), began.size - 1)]),
            start + unit * before,
            start + unit * (before + size),
            CI * unit * deviation,
        )


def rows_of(settings: AlarmSettings, known: AdaptationPrior) -> int:
    """Rows of a block."""
    return max(1, round(settings.block / known.settings.weak.stride))


def with_scatter(information: Array, scatter: float) -> Array:
    """Factor (..., p, p), from the left, that scatter between blocks leaves of their information and score.

    Each block has values of its own, which scatter about those of its time: y = C (theta + s) + e with s of a deviation
    `scatter`, integrated out (Woodbury's identity).
    """
    return np.asarray(np.linalg.inv(np.eye(information.shape[-1]) + scatter**2 * information), dtype=float)


WIDENINGS = tuple(float(1.25**k) for k in range(17))
"""Of the variance of the noise, up to 36 times; a step costs an eighth of the evidence at most."""
_BUDGETS = 4.0
"""How many times the hours of a false alarm are rehearsed."""
_ALLOWED = 0.5
"""False alarms in the hours that may cost one: half of the budget, for a rehearsal is of finite length and of a run-in
that is shorter still."""
_BLOCKS = 300
"""Blocks of a rehearsed run: twenty minutes, in which changes of some minutes ago are thought of."""
_RUNS = (16, 2000)
"""Fewest and most runs that are rehearsed at once."""
_STRETCH = 5
"""Blocks that are drawn together, so that what lasts longer than a block does so in the rehearsal."""
_FEWEST = 4
"""Blocks of a run-in from which something can be drawn."""


class SurrogateRuns:
    """Runs in which nothing happens, as the rows of some motion make them.

    Parameters
    ----------
    columns, balance : rows that inform, (n, 3, p) and (n, 3), over the noise
    known : of the boat and its log, and what is followed
    settings : of the watch
    runs : of twenty minutes each; as many as the budget asks for, where nobody says

    Attributes
    ----------
    hours : that are rehearsed
    """

    def __init__(
        self, columns: Array, balance: Array, known: AdaptationPrior, settings: AlarmSettings, runs: int | None = None
    ) -> None:
        rows, share, amounts = rows_of(settings, known), known.settings.share, known.amounts[: known.watched]
        blocks, p = len(columns) // rows, amounts.size
        self._amounts, self._threshold = amounts, settings.threshold
        self.runs = runs or int(np.clip(np.ceil(_BUDGETS * settings.threshold / _BLOCKS), *_RUNS))
        self.hours = self.runs * _BLOCKS * settings.block / 3600.0
        moved = (columns[:, :, :p] * amounts)[: blocks * rows].reshape(blocks, rows * 3, p)
        force = balance[: blocks * rows].reshape(blocks, rows * 3)
        squares = share * np.einsum("bki,bkj->bij", moved, moved)
        level = np.linalg.solve(squares.sum(axis=0) + 0.01 * np.eye(p), share * np.einsum("bki,bk->i", moved, force))
        left = force - moved @ level
        # The degrees of freedom that the fit took are given back.
        left *= np.sqrt(left.size * share / max(left.size * share - p, 1.0))
        kept = with_scatter(squares, settings.scatter)
        self._scores = share * np.einsum("bij,bkj,ck->bci", kept, moved, left, optimize=True)
        self._information = kept @ squares
        self._drawn = _drawn(np.random.default_rng([settings.seed, 21]), self.runs, blocks)

    def alarms(self, widening: float, most: float = np.inf) -> int:
        """Runs in which an alarm rings, with so much wider a noise; counted until there are more than `most`."""
        detector = Detector(self._amounts, widening, self.runs)
        rung = np.zeros(self.runs, dtype=bool)
        for k, (place, sign) in enumerate(zip(*self._drawn, strict=True)):
            here = k % len(self._information)
            total = detector.take(self._information[here], (self._scores[here, place] * sign[:, None]).T)
            rung |= total >= np.log(self._threshold)
            if rung.sum() > most:
                break
        return int(rung.sum())


def calibrate_widening(columns: Array, balance: Array, known: AdaptationPrior, settings: AlarmSettings) -> float | None:
    """The least widening of the noise's variance that keeps the budget; None of a run-in that tells too little.

    Parameters
    ----------
    columns, balance, known, settings : see `SurrogateRuns`
    """
    if len(columns) < _FEWEST * rows_of(settings, known):
        return None
    surrogate = SurrogateRuns(columns, balance, known, settings)
    allowed = _ALLOWED * surrogate.hours / settings.hours
    return least_widening(WIDENINGS, lambda widening: surrogate.alarms(widening, allowed) <= allowed)


def least_widening(widenings: Sequence[float], kept: Callable[[float], bool]) -> float:
    """The least of some widenings with which a budget is kept, by bisection; the largest where none is enough.

    Parameters
    ----------
    widenings : in order
    kept : whether the budget is kept with one
    """
    low, high = 0, len(widenings) - 1
    middle = 0  # most boats need none
    while low < high:
        if kept(widenings[middle]):
            high = middle
        else:
            low = middle + 1
        middle = (low + high) // 2
    return widenings[low]


def _drawn(rng: np.random.Generator, runs: int, blocks: int) -> tuple[np.ndarray, Array]:
    """Which block's noise is put on each block of each run, and with which sign, (blocks of a run, runs) each."""
    stretches = -(-_BLOCKS // _STRETCH)
    starts = rng.integers(0, blocks, (stretches, runs))
    signs = rng.choice([-1.0, 1.0], (stretches, runs))
    place = (np.repeat(starts, _STRETCH, axis=0) + np.tile(np.arange(_STRETCH), stretches)[:, None]) % blocks
    return place[:_BLOCKS], np.repeat(signs, _STRETCH, axis=0)[:_BLOCKS]
