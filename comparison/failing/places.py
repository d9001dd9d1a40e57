"""Places and seconds of failure: the few that hold far more of the squared error than of the time.

One half of the log proposes them by a regression tree (Breiman et al. 1984, section 8.4), the other half tests them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement, product

import numpy as np
from numpy.typing import NDArray
from pydantic import AliasChoices, Field

from ...discovery.findings import FailingPlace, Removal
from ...physics.file_records import Number, Record, Whole, absent
from ...physics.motion import AXES
from ...residuals.scores import ACCELERATION_UNITS
from .features import Feature, Split, doing, features, merged, splits
from .rows import Array, Scene, contiguous, lower_end, mean_square

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


def regimes(
    squares: Array, rows: NDArray[np.bool_], found: Sequence[Feature], least: int
) -> Iterator[tuple[str, NDArray[np.bool_], int]]:
    """Grow a regression tree of the squared error and read every node of it but the root as a place.

    Parameters
    ----------
    squares : (n,) squared error of one axis, finite
    rows : (n,) the rows that the tree may see
    found : quantities of each row
    least : fewest of those rows in a place

    Yields
    ------
    (words, (n,) rows inside, how many quantities the words name); thresholds are those of the words, rounded
    """
    if rows.sum() < 2 * least or not squares[rows].any():
        return
    seen, columns = squares[rows], np.column_stack([one.values for one in found])[rows]
    for ranges in _nodes(columns, np.minimum(seen, np.quantile(seen, _CLIP)), found, least, {}):
        inside = np.logical_and.reduce([one.inside(*ranges[one.name]) for one in found if one.name in ranges])
        parts = merged(ranges, found)
        yield ", ".join(one.phrase(*ends) for one, ends in parts), inside, len(parts)


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


@dataclass(frozen=True, slots=True)
class Place:
    """A place in the log: words, the rows in it (n,), and the number of quantities that the words name."""

    where: str
    inside: NDArray[np.bool_]
    parts: int


@dataclass(frozen=True, slots=True)
class Failure:
    """A place and the axis (0 to 2) on which the model fails there."""

    place: Place
    axis: int

    def record(self, stage: Scene, model: str) -> FailingPlace:
        """As `comparison.json` has it, without what becomes of the error."""
        error = stage.error[:, self.axis]
        usable = np.isfinite(error)
        inside, squares = self.place.inside & usable, np.square(np.where(usable, error, 0.0))
        return FailingPlace(
            model=model,
            where=self.place.where,
            axis=AXES[self.axis],
            share_of_error=round(float(squares[inside].sum() / squares.sum()), 4),
            share_of_rows=round(float(inside.sum() / usable.sum()), 4),
            rows=int(inside.sum()),
            rmse=round(float(np.sqrt(squares[inside].mean())), 6),
            unit=ACCELERATION_UNITS[AXES[self.axis]],
        )


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
    chooses = _halves(stage.block)
    usable = np.isfinite(stage.error)
    squares = np.square(np.where(usable, stage.error, 0.0))
    with np.errstate(invalid="ignore"):
        badness = np.minimum(np.sqrt(mean_square(stage.error)) / np.maximum(stage.spread, 1e-12), 1.0)
    plain = list(_plain_places(stage))
    trials: list[tuple[float, int, Place]] = []
    for axis in axes:
        if squares[:, axis].any():
            places = [*plain, *_grown(stage, axis, squares[:, axis], chooses & usable[:, axis])]
            trials += _best(places, squares[:, axis], usable[:, axis], chooses, axis, float(badness[axis]))
    result: list[Failure] = []
    taken, tried = np.zeros(stage.error.shape, bool), [0, 0, 0]
    for _, axis, place in sorted(trials, key=lambda trial: (-trial[0], trial[2].where)):
        told = [one for one in result if one.axis == axis]
        if len(result) == limit:
            break
        inside = place.inside & usable[:, axis]
        repeats = squares[inside & taken[:, axis], axis].sum() > 0.5 * squares[inside, axis].sum()
        if len(told) == 2 or tried[axis] == _TRIED or repeats:
            continue
        tried[axis] += 1
        if _holds(stage, inside, squares[:, axis], usable[:, axis], ~chooses, axis):
            result.append(Failure(place, axis))
            taken[:, axis] |= inside
    return result


def _halves(block: NDArray[np.intp]) -> NDArray[np.bool_]:
    """The rows of the half that chooses: blocks drawn evenly, but in no step with a manoeuvre."""
    return (block * 0.6180339887498949) % 1.0 < 0.5


def _grown(stage: Scene, axis: int, squares: Array, rows: NDArray[np.bool_]) -> Iterator[Place]:
    least = max(round(0.5 * _LEAST_SECONDS / stage.step), round(_LEAST_SHARE * rows.sum()), 1)
    for where, inside, parts in regimes(squares, rows, features(stage), least):
        yield Place(where, inside, parts)


def _plain_places(stage: Scene) -> Iterator[Place]:
    """Ranges of surge speed and yaw rate, with and without a state of the thrusters, such states, and headings."""
    speed, rate, command, heading = splits(stage.table)
    for split in (speed, rate):
        size = len(split.labels)
        for first, last in combinations_with_replacement(range(size), 2):
            if last - first + 1 < size:
                inside, where = _inside(split, first, last), split.phrase(first, last)
                yield Place(where, inside, 1)
                for state in range(len(command.labels)):
                    both = inside & _inside(command, state, state)
                    yield Place(f"{where}, {command.phrase(state, state)}", both, 2)
    for split, widest in ((command, 1), (heading, 4)):
        for first, width in product(range(len(split.labels)), range(1, widest + 1)):
            yield Place(split.phrase(first, first + width - 1), _inside(split, first, first + width - 1), 1)


def _best(
    places: list[Place],
    squares: Array,
    usable: NDArray[np.bool_],
    chooses: NDArray[np.bool_],
    axis: int,
    badness: float,
) -> list[tuple[float, int, Place]]:
    """The places that the choosing half proposes, with their scores."""
    seen = usable & chooses
    error = np.array([(place.inside & seen) @ squares for place in places])
    of_error = error / max(squares[chooses].sum(), 1e-300)
    of_rows = np.array([np.count_nonzero(place.inside & seen) for place in places]) / max(int(seen.sum()), 1)
    words = np.array([place.parts - 1 for place in places])
    excess = of_error - of_rows - _A_WORD * words
    sized = (of_rows >= _LEAST_SHARE) & (of_rows <= _MOST_SHARE)
    kept = np.flatnonzero(sized & (of_error >= _RATIO * of_rows) & (excess >= _EXCESS))
    return [(float(excess[k]) * badness, axis, places[k]) for k in kept]


def _holds(
    stage: Scene,
    inside: NDArray[np.bool_],
    squares: Array,
    usable: NDArray[np.bool_],
    tests: NDArray[np.bool_],
    axis: int,
) -> bool:
    """True when a place is a failure on all rows, and the half that did not choose it agrees."""
    of_error, of_rows = squares[inside].sum() / squares.sum(), inside.sum() / usable.sum()
    if of_error < _RATIO * of_rows or of_error - of_rows < _EXCESS or inside.sum() * stage.step < _LEAST_SECONDS:
        return False
    slow, usual = stage.slow()
    if np.sqrt(np.square(slow[inside, axis]).mean()) < _MATERIAL * usual[axis]:
        return False
    here, all_rows = inside & tests, usable & tests
    blocks = np.unique(stage.block[here])
    if blocks.size < _FEWEST_VISITS:
        return False
    return bool(lower_end(stage, squares * here, here.astype(float), blocks) > squares[all_rows].mean())


def _inside(split: Split, first: int, last: int) -> NDArray[np.bool_]:
    return (split.codes - first) % len(split.labels) <= last - first


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
class Segment:
    """Some seconds on one axis (0 to 2): the rows in it (n,)."""

    rows: NDArray[np.bool_]
    axis: int

    def record(self, stage: Scene) -> FailingSeconds:
        """As `comparison.json` has it, without what removes its error."""
        index = np.flatnonzero(self.rows)
        time, error = stage.column("time"), stage.error[:, self.axis]
        squares = np.square(np.where(np.isfinite(error), error, 0.0))
        return FailingSeconds(
            log=int(stage.log[index[0]]),
            begin=round(float(time[index[0]]), 2),
            end=round(float(time[index[-1]]), 2),
            axis=AXES[self.axis],
            rmse=round(float(np.sqrt(squares[index].mean())), 6),
            unit=ACCELERATION_UNITS[AXES[self.axis]],
            share_of_error=round(float(squares[index].sum() / squares.sum()), 4),
            doing=doing(stage, self.rows),
        )


def segments(stage: Scene, limit: int = MOST_SEGMENTS) -> list[Segment]:
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
    result: list[Segment] = []
    for _, axis, start in sorted(trials, key=lambda trial: (-trial[0], trial[1:])):
        rows = np.zeros(stage.stretch.size, bool)
        rows[start : start + length] = True
        if len(result) < limit and not any(one.axis == axis and (one.rows & rows).any() for one in result):
            result.append(Segment(rows, axis))
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
