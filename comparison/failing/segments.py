"""Failure in time: the seconds with the largest error, and its drift along the log."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import AliasChoices, Field

from ...discovery.findings import Removal
from ...physics.file_records import Number, Record, Whole, absent
from ...physics.motion import AXES
from ...physics.presentation import number, percent, unit_text
from ...residuals.scores import ACCELERATION_UNITS
from .block_fit import Fitted, contiguous, fit_with_nuisances, static_columns
from .features import doing
from .rows import Array, Scene, mean_square, shorter

LIMIT = 5
"""Segments that are told: what a person will look at."""
LENGTH = 5.0
"""Length of a segment [s]."""
_STRIDE = 0.5
"""Distance between the segments that are tried [s]: a tenth of one."""
_TIMES = 1.5
"""A segment's mean square error is so many times that of the whole log on its axis."""
_PLAIN, _MATERIAL = 0.35, 0.2
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


def segments(stage: Scene, limit: int = LIMIT) -> list[Segment]:
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
            if square > _TIMES * whole[axis] and (share > _PLAIN or (share > _MATERIAL and square > noisy)):
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


_SHORTEST = 60.0
"""Span of time [s] over which a drift can be told."""
_CLEAR, _CLEARLY_GROWN = 3.5, 5.0
"""Standard errors from which a trend of the error, and of its size, is told; the size changes with all that is done."""
_MATERIAL_DRIFT, _GROWTH = 0.1, 0.3
"""Change over the log, as a share of the usual acceleration, and of the size of the error, that matters."""
_FREE = 0.1
"""Share of a column that the others must leave free: with less, its error is over three times that of one alone."""


class Drift(Record):
    """The trend of the error on one axis along the log, at equal motion and commands.

    Attributes
    ----------
    per_minute, ci95 : of the error, modelled minus measured [`unit`]; None, as the next, where this log cannot tell
    size_per_minute, size_ci95 : of its size, as shares of the mean size
    verdict : "drifts", "grows", "shrinks", "steady", "this log cannot tell"
    sentence : the same in words
    """

    per_minute: Number | None = None
    ci95: tuple[Number, Number] | None = None
    size_per_minute: Number | None = None
    size_ci95: tuple[Number, Number] | None = None
    unit: str
    verdict: str = "this log cannot tell"
    sentence: str


def over_time(stage: Scene) -> dict[str, Drift]:
    """The trend of the error and of its size along each log, by axis, at equal motion and commands.

    Linear fits beside what the present speeds and commands explain (for the size: beside how much the boat moved),
    with errors that are robust to the autocorrelation within and between blocks.

    Returns
    -------
    By axis.
    """
    time, span = _minutes(stage)
    moved = np.abs(static_columns(stage)[:, :12])
    beside = np.column_stack([_logs(stage), static_columns(stage)[:, 1:]])
    told = {}
    for k, axis in enumerate(AXES):
        error = stage.error[:, k]
        mean = fit_with_nuisances(stage, error, time[:, None], beside)
        size = np.abs(error)
        grown = fit_with_nuisances(
            stage, size, time[:, None], np.column_stack([_logs(stage), moved[:, 1:], np.abs(stage.measured[:, k])])
        )
        told[axis] = _judged(
            mean,
            grown,
            span,
            float(stage.spread[k]),
            float(np.sum(np.nan_to_num(size)) / max(int(np.isfinite(size).sum()), 1)),
            k,
        )
    return told


def _judged(mean: Fitted | None, grown: Fitted | None, span: float, usual: float, size: float, axis: int) -> Drift:
    unit = ACCELERATION_UNITS[AXES[axis]]
    if mean is None or grown is None or 60.0 * span < _SHORTEST or min(mean.free[0], grown.free[0]) < _FREE:
        return Drift(
            unit=unit,
            sentence="this log cannot tell: too short for a drift"
            if 60.0 * span < _SHORTEST or mean is None
            else "this log cannot tell: what the boat did changed along with the time",
        )
    slope, growth = float(mean.values[0]), float(grown.values[0]) / max(size, 1e-300)
    ends, size_ends = shorter(mean.interval(0)), shorter(np.array(grown.interval(0)) / max(size, 1e-300))
    found = Drift(
        per_minute=shorter([slope])[0],
        ci95=(ends[0], ends[1]),
        size_per_minute=shorter([growth])[0],
        size_ci95=(size_ends[0], size_ends[1]),
        unit=unit,
        sentence="",
    )
    drifts = abs(slope) > _CLEAR * mean.errors[0] and abs(slope) * span > _MATERIAL_DRIFT * usual
    grows = (
        abs(grown.values[0]) > _CLEARLY_GROWN * grown.errors[0]
        and abs(growth) * span > _GROWTH
        and size > _MATERIAL_DRIFT * usual
    )
    if drifts:
        sentence = f"the error drifts by {number(slope, 2)} {unit_text(unit)} a minute at equal speeds and commands"
        return found.but(verdict="drifts", sentence=sentence)
    if grows:
        verdict = "grows" if growth > 0.0 else "shrinks"
        return found.but(verdict=verdict, sentence=f"the error {verdict} by {percent(abs(growth))} a minute")
    reach = max(abs(end) for end in mean.interval(0)) * span
    if reach > 2.0 * max(_MATERIAL_DRIFT * usual, size):
        sentence = f"this log cannot tell: the error may drift by {number(reach, 2)} {unit_text(unit)} over the log"
        return found.but(sentence=sentence)
    bound = f"{number(reach, 2)} {unit_text(unit)}"
    return found.but(verdict="steady", sentence=f"no drift: less than {bound} over the log")


def _minutes(stage: Scene) -> tuple[Array, float]:
    """Time since the beginning of each log, and the longest log [min]."""
    time = stage.column("time") / 60.0
    since = time.copy()
    for log in np.unique(stage.log):
        since[stage.log == log] -= time[stage.log == log].min()
    return since, float(since.max())


def _logs(stage: Scene) -> Array:
    """A constant for each log."""
    return (stage.log[:, None] == np.unique(stage.log)).astype(float)
