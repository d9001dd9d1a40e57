"""How far open-loop predictions may be off: 95 % bands, calibrated on rows that the model did not see.

A band is a conformal prediction interval (Angelopoulos and Bates 2023, arXiv:2107.07511). Errors on unseen rows hold
all that makes a prediction err: the spread of the parameters, since each fold has its own fit, the physics that the
model lacks, and the noise of the start. Each horizon has its own quantile, as in Stankeviciute, Alaa and van der
Schaar (2021), but no share of the level is set aside for all horizons together. Errors are divided by a scale that
knows where the boat is hard to predict (Lei et al. 2018, section 5.2): how far the prediction moves when its start
moves by the error of a prediction of one second. A straight run of a hull that does not hold its course then has a
wide band, and a boat that stops has a narrow one. Neighbouring predictions err alike, so the finite-sample correction
of the quantile counts independent ones.
"""

from collections.abc import Sequence

import numpy as np

from ..measurements.preparation.dataset import DataSet
from ..physics.file_records import Number, Whole
from ..physics.frames import Array
from ..physics.simulation import Legs
from .models.band_record import PREDICTED_SECONDS, QUANTITIES, PredictionBand, with_moved_state
from .models.base import Model
from .models.interval import LEVEL
from .scores import MOST_STARTS, SPACING, ByAxis

LEAST_LEVEL = 0.9
"""Share that a band holds at least: nine independent predictions, below which its largest error says too little."""
_FEWER = 2
"""Predictions of which an error counts each, a band one: it predicts five times from a start, as it is and moved."""
ROOM = 0.5
"""Share of the range of each speed by which a band is told beyond it. Farther off the model may lack a force that the
run never met, and no error of the run tells its size. Up to here bands hold as within the range (`benchmarks/bands.py
--room` tries others)."""
_SHIFTED_AT = PREDICTED_SECONDS.index(1.0)
_TINY = 1e-12
"""A scale that stands for none, in logs without noise."""


class HeldPredictions(ByAxis):
    """Share of predictions of 10 s whose last row lies in a band, by quantity, and how many predictions there were.

    They are those that stay near the speeds of the run; `beyond` counts the others, of which a band says nothing.
    """

    position: Number = float("nan")
    predictions: Whole = 0
    beyond: Whole = 0


def prediction_band(model: Model, data: DataSet) -> PredictionBand | None:
    """Calibrate the band of a model on data that it did not see; None where these are too few for `LEAST_LEVEL`.

    A vehicle that was fitted to the data answers for each fold with the fit that did not see it.
    """
    asked = _legs(data)
    if not asked:
        return None
    states = _at_seconds(model, asked)
    measured = _measured(asked)
    error = states - measured
    shift = np.median(np.abs(error[:, _SHIFTED_AT, 2:]), axis=0)
    spread = spread_of(states, [_at_seconds(model, _with(asked, k, by)) for k, by in enumerate(shift.tolist())])
    floor = np.median(spread, axis=0)
    scale = np.maximum(np.hypot(spread, floor), _TINY)
    score = _sizes(error) / scale
    independent = _independent(score[:, -1, 0])
    level = min(LEVEL, independent / (independent + 1.0))  # of few scores the largest is all that there is
    if level < LEAST_LEVEL:
        return None
    low, high = measured[..., 3:].min(axis=(0, 1)), measured[..., 3:].max(axis=(0, 1))
    factor = np.quantile(score, min(level * (1.0 + 1.0 / independent), 1.0), axis=0)
    return PredictionBand(
        level=level,
        predictions=len(score),
        independent=independent,
        shift=tuple(shift.tolist()),
        floor=_by_name(floor),
        factor=_by_name(factor),
        half_width=_by_name(factor * np.median(scale, axis=0)),
        lowest=tuple((low - ROOM * (high - low)).tolist()),
        highest=tuple((high + ROOM * (high - low)).tolist()),
    )


def held_predictions(model: Model, band: PredictionBand, data: DataSet) -> HeldPredictions:
    """Count how many predictions of 10 s on data end within a band; see `prediction_band`."""
    asked = _legs(data)
    if not asked:
        return HeldPredictions()
    states = _at_seconds(model, asked)
    known = band.knows(states[..., 3:]).all(axis=1)
    error = _sizes(states - _measured(asked))[:, -1:]
    spread = spread_of(states, [_at_seconds(model, _with(asked, k, by)) for k, by in enumerate(band.shift)])[:, -1:]
    inside = (error <= band.half_widths(spread, np.array(band.seconds[-1:])))[known, 0]
    counts = {"predictions": len(inside), "beyond": int((~known).sum())}
    shares = inside.mean(axis=0).tolist() if len(inside) else [float("nan")] * len(QUANTITIES)
    return HeldPredictions(**counts, **dict(zip(QUANTITIES, shares, strict=True)))


def spread_of(states: Array, moved: Sequence[Array]) -> Array:
    """How far predictions (..., 6) move with their starts, (..., 4), from the same with each state moved."""
    return np.sqrt(np.sum([_sizes(one - states) ** 2 for one in moved], axis=0))


def _legs(data: DataSet) -> list[Legs]:
    """Predictions over the longest horizon, spread over the data."""
    spacing, found = _FEWER * max(SPACING, data.seconds / MOST_STARTS), []
    for motion in data.motions:
        steps = round(PREDICTED_SECONDS[-1] / motion.time_step)
        starts = np.arange(0, motion.time.size - steps, max(1, round(spacing / motion.time_step)))
        found += [Legs(motion, starts, steps)] * bool(starts.size)
    return found


def _with(asked: Sequence[Legs], state: int, by: float) -> list[Legs]:
    return [legs._replace(motion=with_moved_state(legs.motion, state, by)) for legs in asked]


def _rows(legs: Legs) -> np.ndarray:
    return np.round(np.array(PREDICTED_SECONDS) / legs.motion.time_step).astype(int)


def _at_seconds(model: Model, asked: Sequence[Legs]) -> Array:
    """Predicted states at the horizons, (predictions, horizons, 6)."""
    found = model.rollouts(asked)
    return np.concatenate([one.states[:, _rows(legs)] for one, legs in zip(found, asked, strict=True)])


def _measured(asked: Sequence[Legs]) -> Array:
    """The same as they were measured."""
    truth = [np.column_stack([legs.motion.position, legs.motion.heading, legs.motion.velocity]) for legs in asked]
    return np.concatenate([one[legs.starts[:, None] + _rows(legs)] for one, legs in zip(truth, asked, strict=True)])


def _sizes(error: Array) -> Array:
    """Distances of positions and differences of velocities, (..., 4), of errors of states (..., 6)."""
    return np.concatenate([np.hypot(error[..., :1], error[..., 1:2]), np.abs(error[..., 3:])], axis=-1)


def _independent(score: Array) -> float:
    """As how many independent values a series counts: its length over the integral of its rank autocorrelation.

    The integral ends at the first lag that is not positive. Ranks, because a few large scores hide what lies between.
    """
    n = score.size
    rank = np.argsort(np.argsort(score)) - 0.5 * (n - 1)
    power, integral = float(rank @ rank), 1.0
    for lag in range(1, n // 2):
        alike = float(rank[lag:] @ rank[:-lag]) / max(power, _TINY)
        if alike <= 0.0:
            break
        integral += 2.0 * alike
    return n / integral


def _by_name(values: Array) -> dict[str, tuple[float, ...]]:
    """Values (horizons, 4) by quantity."""
    return dict(zip(QUANTITIES, map(tuple, values.T.tolist()), strict=True))
