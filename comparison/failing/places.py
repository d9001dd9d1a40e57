"""Places and seconds of failure: the few that hold far more of the squared error than of the time.

One half of the log proposes them by a regression tree (Breiman et al. 1984, section 8.4), the other half tests them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import AliasChoices, Field

from ...discovery.findings import FailingPlace, Removal
from ...physics.file_records import Number, Record, Whole, absent
from ...physics.motion import AXES
from ...residuals.scores import ACCELERATION_UNITS
from .features import Feature, doing, features, merged, splits
from .rows import Array, Scene, contiguous, lower_end, mean_square, squared

_APART = 1e-7
"""Two values that are nearer than this are one: single precision, in which trees are usually grown."""
_EQUAL = 1e-9
"""Share of what a cut tells within which two are alike, and the first is taken: a quantity that is nowhere negative and
its modulus part the rows alike, and rounding is not to choose between them."""


def best_cut(columns: Array, target: Array, least: int) -> tuple[int, float] | None:
    """The column and the threshold by which rows are best parted (Breiman et al. 1984, section 8.4).

    Parameters
    ----------
    columns : (n, k) quantities
    target : (n,) what the means of both sides should tell
    least : fewest rows on a side

    Returns
    -------
    Column and threshold, half-way between two values; None where there are too few rows, or nothing is to be parted.

    >>> best_cut(np.array([[0.0, 5.0], [1.0, 5.0], [2.0, 5.0], [3.0, 6.0]]), np.array([1.0, 1.0, 9.0, 9.0]), 1)
    (0, 1.5)
    """
    n = target.size
    if n < 2 * least or not np.ptp(target):
        return None
    order = np.argsort(columns, axis=0, kind="stable")
    values, below = np.take_along_axis(columns, order, axis=0), np.cumsum(target[order], axis=0)[:-1]
    count = np.arange(1, n)[:, None]
    told = below**2 / count + (target.sum() - below) ** 2 / (n - count)
    parted = (np.diff(values, axis=0) > _APART) & (count >= least) & (n - count >= least)
    if not parted.any():
        return None
    told = np.where(parted, told, -np.inf)
    column, row = np.argwhere((1.0 - _EQUAL) * told.max() <= told.T)[0]
    return int(column), float(0.5 * (values[row, column] + values[row + 1, column]))


LIMIT = 4
"""Places told of one model."""
_RATIO, _EXCESS = 1.5, 0.1
"""A place holds so many times as much of the error as of the time, and so much more of it."""
_LEAST_SHARE, _MOST_SHARE, _LEAST_SECONDS = 0.02, 0.5, 3.0
"""Share of the time, and time [s], that a place may be."""
_MATERIAL = 0.1
"""Slow error in a place, as a share of the usual acceleration on its axis, below which nobody needs to know of it."""
_A_WORD = 0.03
"""Excess that each further quantity in the words must earn."""
_TRIED = 8
"""Places of an axis that may be put to the test on the other half."""
_FEWEST_BLOCKS = 6
"""Blocks in the half that tests, below which no place is told."""
_FEWEST_VISITS = 3
"""Blocks of that half in which the boat must have been in the place."""


DEPTH = 3
"""Conditions in a place at most: more are no place that a person could find on the water."""
_CLIP = 0.98
"""Quantile at which squared errors are cut for the tree, so that it looks for regimes and not for single spikes."""

Range = tuple[float, float]


class Place(NamedTuple):
    """A place in the log: words, the rows in it (n,), and the number of quantities that the words name."""

    where: str
    inside: NDArray[np.bool_]
    parts: int


def regimes(squares: Array, rows: NDArray[np.bool_], found: Sequence[Feature], least: int) -> Iterator[Place]:
    """Grow a regression tree of the squared error and read every node of it but the root as a place.

    Parameters
    ----------
    squares : (n,) squared error of one axis, finite
    rows : (n,) the rows that the tree may see
    found : quantities of each row
    least : fewest of those rows in a place

    Yields
    ------
    Places whose thresholds are those of the words, rounded.
    """
    if rows.sum() < 2 * least or not squares[rows].any():
        return
    seen, columns = squares[rows], np.column_stack([one.values for one in found])[rows]
    for ranges in _nodes(columns, np.minimum(seen, np.quantile(seen, _CLIP)), found, least, {}):
        inside = np.logical_and.reduce([one.inside(*ranges[one.name]) for one in found if one.name in ranges])
        parts = merged(ranges, found)
        yield Place(", ".join(one.phrase(*ends) for one, ends in parts), inside, len(parts))


def _nodes(
    columns: Array, target: Array, found: Sequence[Feature], least: int, ranges: dict[str, Range], depth: int = DEPTH
) -> Iterator[dict[str, Range]]:
    """The ranges by name of quantity that lead to every node of the tree below one, the sides above a cut first."""
    split = best_cut(columns, target, least) if depth else None
    if split is None:
        return
    one = found[split[0]]
    cut, (low, high) = one.rounded(split[1]), ranges.get(one.name, (-np.inf, np.inf))
    if low < cut < high:
        above = columns[:, split[0]] > split[1]
        for side, ends in ((above, (cut, high)), (~above, (low, cut))):
            inner = {**ranges, one.name: ends}
            yield inner
            yield from _nodes(columns[side], target[side], found, least, inner, depth - 1)


def _plain_places(stage: Scene) -> Iterator[Place]:
    """Ranges of surge speed and yaw rate, with and without a state of the thrusters, such states, and headings."""
    speed, rate, command, heading = splits(stage.table)
    states = [Place(label, command.codes == code, 1) for code, label in enumerate(command.labels)]
    for split in (speed, rate):
        for first, last in combinations_with_replacement(range(len(split.labels)), 2):
            if last - first + 1 < len(split.labels):
                one = Place(split.phrase(first, last), split.inside(first, last), 1)
                yield one
                for state in states:
                    yield Place(f"{one.where}, {state.where}", one.inside & state.inside, 2)
    yield from states
    for first, last in product(range(len(heading.labels)), range(4)):
        yield Place(heading.phrase(first, first + last), heading.inside(first, first + last), 1)


class FailingSeconds(Record):
    """Some seconds with a large error, as `comparison.json` has them.

    Attributes
    ----------
    log : its number
    begin, end : times [s]; `from` and `to` in the file
    axis, rmse, unit : of the error
    share_of_error : of the squared error of the axis in the whole log
    doing : what the boat was doing
    rmse_after, removed_by, unlinked : as of a `FailingPlace`
    """

    log: Whole
    begin: Number = Field(validation_alias=AliasChoices("begin", "from"), serialization_alias="from")
    end: Number = Field(validation_alias=AliasChoices("end", "to"), serialization_alias="to")
    axis: str
    rmse: Number
    unit: str = ""
    share_of_error: Number
    doing: str
    rmse_after: Number | None = absent()
    removed_by: tuple[Removal, ...] = ()
    unlinked: str | None = absent()


@dataclass(frozen=True, slots=True)
class Failure:
    """The rows (n,) in which a model fails on an axis (0 to 2), and the place in words; none of some seconds."""

    rows: NDArray[np.bool_]
    axis: int
    where: str = ""

    def place(self, stage: Scene, model: str) -> FailingPlace:
        """As `comparison.json` has a place, without what becomes of the error."""
        usable = np.isfinite(stage.error[:, self.axis])
        inside = self.rows & usable
        rows, share = int(inside.sum()), round(float(inside.sum() / usable.sum()), 4)
        error = self._error(stage, inside)
        return FailingPlace(model=model, where=self.where, rows=rows, share_of_rows=share, **error)

    def seconds(self, stage: Scene) -> FailingSeconds:
        """As `comparison.json` has some seconds, without what removes their error."""
        index = np.flatnonzero(self.rows)
        begin, end = (round(float(time), 2) for time in stage.table["time"][index[[0, -1]]])
        log, error = int(stage.log[index[0]]), self._error(stage, self.rows)
        return FailingSeconds(log=log, begin=begin, end=end, doing=doing(stage, self.rows), **error)

    def _error(self, stage: Scene, inside: NDArray[np.bool_]) -> dict[str, Any]:
        """Root mean square error in the rows with its axis and unit, and their share of the squared error of all."""
        squares, axis = squared(stage.error[:, self.axis]), AXES[self.axis]
        share = round(float(squares[inside].sum() / squares.sum()), 4)
        rmse = round(float(np.sqrt(squares[inside].mean())), 6)
        return {"axis": axis, "rmse": rmse, "unit": ACCELERATION_UNITS[axis], "share_of_error": share}


def worst_places(stage: Scene, limit: int = LIMIT, axes: Sequence[int] = (0, 1, 2)) -> list[Failure]:
    """The places where a model fails, worst first.

    A place is a node of a shallow tree grown on the squared error, or a range of surge speed or yaw rate, a state of
    the thrusters, both together, or a range of headings. Places are chosen by the error in one half of the log's
    blocks. One is told when it holds at least 1.5 times as much of the squared error of its axis as of the time, and a
    tenth more; when the error there, as a mean over a second, is a tenth of the usual acceleration; and when the other
    half agrees: the 95 % interval of the mean square error there, from a bootstrap of its blocks in the place, lies
    above the mean square of that half. Axes that the model predicts badly come first, and a place that repeats an
    earlier one is passed over.

    Parameters
    ----------
    limit : most of them
    axes : that are looked at
    """
    if not len(stage.table) or stage.block[-1] + 1 < 2 * _FEWEST_BLOCKS:
        return []
    halves = {axis: _Halves(stage, axis) for axis in axes if squared(stage.error[:, axis]).any()}
    plain, quantities = list(_plain_places(stage)), features(stage)
    trials = [(score, axis, one) for axis, own in halves.items() for score, one in own.proposed(plain, quantities)]
    result: list[Failure] = []
    taken, tried = np.zeros(stage.error.shape, bool), [0, 0, 0]
    for _, axis, place in sorted(trials, key=lambda trial: (-trial[0], trial[2].where)):
        own = halves[axis]
        if len(result) == limit:
            break
        inside = place.inside & own.usable
        repeats = own.squares[inside & taken[:, axis]].sum() > 0.5 * own.squares[inside].sum()
        if sum(one.axis == axis for one in result) == 2 or tried[axis] == _TRIED or repeats:
            continue
        tried[axis] += 1
        if own.holds(inside):
            result.append(Failure(place.inside, axis, place.where))
            taken[:, axis] |= inside
    return result


class _Halves:
    """The squared error of one axis, in the half of the log's blocks that chooses places, and in that which tests."""

    def __init__(self, stage: Scene, axis: int) -> None:
        self._stage, self._axis = stage, axis
        self.usable = np.isfinite(stage.error[:, axis])
        self.squares = squared(stage.error[:, axis])
        # Blocks are drawn evenly, but in no step with a manoeuvre.
        self._chooses = (stage.block * 0.6180339887498949) % 1.0 < 0.5

    def proposed(self, plain: Sequence[Place], quantities: Sequence[Feature]) -> Iterator[tuple[float, Place]]:
        """The places that the choosing half proposes, with their scores: excess times how badly the axis is predicted.

        Parameters
        ----------
        plain : the places that are tried on every axis
        quantities : of which a tree makes more
        """
        stage, seen = self._stage, self.usable & self._chooses
        least = max(round(0.5 * _LEAST_SECONDS / stage.step), round(_LEAST_SHARE * seen.sum()), 1)
        size = np.sqrt(self.squares.sum() / self.usable.sum())
        badness = min(float(size / max(stage.spread[self._axis], 1e-12)), 1.0)
        for place in (*plain, *regimes(self.squares, seen, quantities, least)):
            inside = place.inside & seen
            of_error = inside @ self.squares / max(self.squares[self._chooses].sum(), 1e-300)
            of_rows = np.count_nonzero(inside) / max(int(seen.sum()), 1)
            excess = of_error - of_rows - _A_WORD * (place.parts - 1)
            if _LEAST_SHARE <= of_rows <= _MOST_SHARE and of_error >= _RATIO * of_rows and excess >= _EXCESS:
                yield float(excess) * badness, place

    def holds(self, inside: NDArray[np.bool_]) -> bool:
        """True when a place is a failure on all rows, and the half that did not choose it agrees."""
        stage, squares = self._stage, self.squares
        of_error, of_rows = squares[inside].sum() / squares.sum(), inside.sum() / self.usable.sum()
        if of_error < _RATIO * of_rows or of_error - of_rows < _EXCESS or inside.sum() * stage.step < _LEAST_SECONDS:
            return False
        slow, usual = (values[..., self._axis] for values in stage.slow())
        if np.sqrt(np.square(slow[inside]).mean()) < _MATERIAL * usual:
            return False
        here = inside & ~self._chooses
        blocks = np.unique(stage.block[here])
        if blocks.size < _FEWEST_VISITS:
            return False
        tested = squares[self.usable & ~self._chooses].mean()
        return bool(lower_end(stage, squares * here, here.astype(float), blocks) > tested)


MOST_SEGMENTS = 5
"""Segments that are told: what a person will look at."""
LENGTH = 5.0
"""Length of a segment [s]."""
_STRIDE = 0.5
"""Distance between the segments that are tried [s]: a tenth of one."""
_TIMES = 1.5
"""A segment's mean square error is so many times that of the whole log on its axis."""
_PLAIN, _LARGE = 0.35, 0.2
"""Its error, as a share of the usual acceleration on its axis: plainly a failure, or one if it stands out of noise."""
_DEVIATIONS = 7.0
"""Standard deviations by which it then lies above what even noise of the error's colour would have."""
_MEMORY = 3.0
"""Lags [s] up to which the error's colour is looked at."""


def segments(stage: Scene, limit: int = MOST_SEGMENTS) -> list[Failure]:
    """The stretches of 5 s with the largest slow error, worst first: those that stand out of even noise of its colour.

    They do not overlap on an axis; those on an axis that the model predicts badly come first.
    """
    length, stride = round(LENGTH / stage.step), max(1, round(_STRIDE / stage.step))
    slow, usual = stage.slow()
    whole = mean_square(slow)
    badness = np.minimum(np.sqrt(whole) / np.maximum(usual, 1e-12), 1.0)
    trials: list[tuple[float, int, int]] = []
    starts = [int(first) for rows in contiguous(stage) for first in rows[: max(rows.size - length + 1, 0) : stride]]
    if not starts:
        return []
    for axis in range(3):
        error = slow[:, axis]
        if whole[axis] <= 0.0:
            continue
        noisy = whole[axis] * (1.0 + _DEVIATIONS * _even(stage, error, length))
        total = np.concatenate([[0.0], np.cumsum(error**2)])
        there = (total[np.array(starts) + length] - total[np.array(starts)]) / length
        for start, square in zip(starts, there, strict=True):
            share = np.sqrt(square) / max(usual[axis], 1e-12)
            if square > _TIMES * whole[axis] and (share > _PLAIN or (share > _LARGE and square > noisy)):
                trials.append((float(square / whole[axis] * badness[axis]), axis, start))
    result: list[Failure] = []
    for _, axis, start in sorted(trials, key=lambda trial: (-trial[0], trial[1:])):
        rows = np.zeros(stage.stretch.size, bool)
        rows[start : start + length] = True
        if len(result) < limit and not any(one.axis == axis and (one.rows & rows).any() for one in result):
            result.append(Failure(rows, axis))
    return result


def _even(stage: Scene, error: NDArray[np.float64], length: int) -> float:
    """Relative standard deviation of the mean square of a window of even Gaussian noise with the error's colour.

    For a Gaussian series with autocorrelation rho_k it is sqrt(2 / n sum_k (1 - |k| / n) rho_k^2) (Isserlis 1918).
    """
    lags = min(round(_MEMORY / stage.step), length - 1)
    # In units of the local size, lest a single burst make the colour of everything.
    size = np.sqrt(np.convolve(error**2, np.ones(length) / length, "same")) + 1e-300
    even = error / size
    power = float((even**2).mean())
    rho = [float((even[k:] * even[: even.size - k]).mean()) / max(power, 1e-300) for k in range(1, lags + 1)]
    weight = 1.0 - np.arange(1, lags + 1) / length
    return float(np.sqrt(2.0 / length * (1.0 + 2.0 * (weight * np.square(rho)).sum())))
