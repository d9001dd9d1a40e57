"""Error against time: whether the model's error drifts, grows or shrinks along the log."""

import numpy as np

from ...physics.file_records import Number, Record
from ...physics.frames import AXES
from ...physics.in_words import number, percent, unit_text
from ...residuals.scores import ACCELERATION_UNITS
from .block_fit import Fitted, fit_beside, static_columns
from .rows import Array, Scene, shorter

_SHORTEST = 60.0
"""Span of time [s] over which a drift can be told."""
_CLEAR, _CLEARLY_GROWN = 3.5, 5.0
"""Standard errors from which a trend of the error, and of its size, is told; the size changes with all that is done."""
_MATERIAL, _GROWTH = 0.1, 0.3
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
        mean = fit_beside(stage, error, time[:, None], beside)
        size = np.abs(error)
        grown = fit_beside(
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
    drifts = abs(slope) > _CLEAR * mean.errors[0] and abs(slope) * span > _MATERIAL * usual
    grows = (
        abs(grown.values[0]) > _CLEARLY_GROWN * grown.errors[0]
        and abs(growth) * span > _GROWTH
        and size > _MATERIAL * usual
    )
    if drifts:
        sentence = f"the error drifts by {number(slope, 2)} {unit_text(unit)} a minute at equal speeds and commands"
        return found.but(verdict="drifts", sentence=sentence)
    if grows:
        verdict = "grows" if growth > 0.0 else "shrinks"
        return found.but(verdict=verdict, sentence=f"the error {verdict} by {percent(abs(growth))} a minute")
    reach = max(abs(end) for end in mean.interval(0)) * span
    if reach > 2.0 * max(_MATERIAL * usual, size):
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
