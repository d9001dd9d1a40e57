"""When a model fails: the few seconds with the largest error, and what the boat was doing then."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import AliasChoices, Field

from ...discovery.findings import Removal
from ...physics.file_records import Number, Record, Whole, absent
from ...physics.frames import AXES
from ...residuals.scores import ACCELERATION_UNITS
from .block_fit import contiguous
from .features import doing
from .rows import Scene, mean_square

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

    def told(self, stage: Scene) -> FailingSeconds:
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
    found: list[Segment] = []
    for _, axis, start in sorted(trials, key=lambda trial: (-trial[0], trial[1:])):
        rows = np.zeros(stage.stretch.size, bool)
        rows[start : start + length] = True
        if len(found) < limit and not any(one.axis == axis and (one.rows & rows).any() for one in found):
            found.append(Segment(rows, axis))
    return found


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
