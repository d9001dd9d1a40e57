"""Measured and predicted motion side by side, as `series.csv` holds it, and the 95 % band about open-loop predictions.

The band is a conformal prediction interval (Angelopoulos and Bates 2023, arXiv:2107.07511), calibrated on rows that the
model did not see; see `prediction_band`.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, BinaryIO, overload

import numpy as np
from numpy.typing import NDArray

from ..measurements.preparation.prepare import DataSet
from ..measurements.preparation.resampling import accelerations
from ..measurements.preparation.split import PARTS
from ..measurements.prepared_logs import Parts
from ..physics.file_records import Number, Whole
from ..physics.integration import Legs
from ..physics.motion import Array, Motion
from .models.band_record import PREDICTED_SECONDS, QUANTITIES, PredictionBand, with_moved_state
from .models.base import Model, VehicleModel, rolled_out
from .models.interval import LEVEL
from .scores import MOST_STARTS, SPACING, ByAxis, residual, same_filter

if TYPE_CHECKING:
    import pandas as pd


_AT_ONCE = 20_000
"""Rows that are text at one time: those of a long log never are together."""


@dataclass(frozen=True, slots=True, eq=False)
class SeriesTable:
    """Columns (n,) by name, all of one length."""

    columns: Mapping[str, NDArray[Any]]

    @classmethod
    def of(cls, frame: "pd.DataFrame") -> "SeriesTable":
        """The columns of a frame, as `RunFolder.series` has them."""
        found = {str(name): frame[name].to_numpy() for name in frame.columns}
        whole = {name for name, column in found.items() if column.dtype.kind in "iu" and name != "log"}
        return cls({name: column.astype(float) if name in whole else column for name, column in found.items()})

    def __len__(self) -> int:
        return next((column.size for column in self.columns.values()), 0)

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    @overload
    def __getitem__(self, wanted: str) -> NDArray[Any]: ...

    @overload
    def __getitem__(self, wanted: Sequence[str]) -> Array: ...

    def __getitem__(self, wanted: str | Sequence[str]) -> NDArray[Any]:
        """The column of a name (n,), or those of several as numbers (n, names)."""
        if isinstance(wanted, str):
            return self.columns[wanted]
        none = np.zeros((len(self), 0))
        return np.column_stack([none, *(self.columns[name].astype(float, copy=False) for name in wanted)])

    def rows(self, wanted: NDArray[Any] | slice) -> "SeriesTable":
        """Some of the rows."""
        return SeriesTable({name: column[wanted] for name, column in self.columns.items()})

    def frame(self) -> "pd.DataFrame":
        """The same as a frame of pandas, without a copy."""
        import pandas as pd

        return pd.DataFrame(dict(self.columns), copy=False)

    def write(self, stream: BinaryIO) -> None:
        """Write all as comma-separated text with a header; a number that is missing is an empty cell."""
        text = TextIOWrapper(stream, "utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for first in range(0, len(self), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            writer.writerows(zip(*(_cells(column[part]) for column in self.columns.values()), strict=True))
        text.detach()  # what remains is written, and the stream stays open


def _cells(column: NDArray[Any]) -> Sequence[object]:
    cells: list[object] = column.tolist()
    if column.dtype.kind == "f" and np.isnan(column).any():
        return ["" if cell != cell else cell for cell in cells]
    return cells


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


def prediction_band(
    held_out: Sequence[tuple[Model, DataSet]], far: Sequence[tuple[Model, DataSet]] = ()
) -> PredictionBand | None:
    """Calibrate the band of a model on data that it did not see; None where these are too few for `LEAST_LEVEL`.

    Errors on unseen rows hold all that makes a prediction err: the spread of the parameters, since each fold has its
    own fit, the physics that the model lacks, and the noise of the start. Each horizon has its own quantile, as in
    Stankeviciute, Alaa and van der Schaar (2021), but no share of the level is set aside for all horizons together.
    Errors are divided by a scale that knows where the boat is hard to predict (Lei et al. 2018, section 5.2): how far
    the prediction moves when its start moves by the error of a prediction of one second. Neighbouring predictions err
    alike, so the finite-sample correction of the quantile counts independent ones.

    A vehicle that was fitted to the data answers for each fold with the fit that did not see it. For a network its
    probes answer for the blocks of the training part, as in the CV+ of Barber et al. (2021, doi:10.1214/20-AOS1965).

    Parameters
    ----------
    held_out : the model and data that it did not see; also other fits of it, each with what that one did not see
    far : the same of data that are unlike what was seen: they tell how the band grows with the distance from it
    """
    asked = [(model, legs) for model, data in held_out if (legs := _legs(data))]
    if not asked:
        return None
    states, measured = _of_all(asked), np.concatenate([_measured(legs) for _, legs in asked])
    shift = np.median(np.abs((states - measured)[:, _SHIFTED_AT, 2:]), axis=0)
    spread = _spread(asked, states, shift)
    floor = np.median(spread, axis=0)
    scale = np.maximum(np.hypot(spread, floor), _TINY)
    score = _sizes(states - measured) / scale
    independent = _independent(score[:, -1, 0])
    level = min(LEVEL, independent / (independent + 1.0))  # of few scores the largest is all that there is
    if level < LEAST_LEVEL:
        return None
    low, high = measured[..., 3:].min(axis=(0, 1)), measured[..., 3:].max(axis=(0, 1))
    high[1:] = np.maximum(high[1:], -low[1:])  # a hull is to port what it is to starboard
    low[1:] = -high[1:]
    factor = np.quantile(score, min(level * (1.0 + 1.0 / independent), 1.0), axis=0)
    found = PredictionBand(
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
    return found.but(growth=_growth(found, [(model, legs) for model, data in far if (legs := _legs(data))]))


def _growth(band: PredictionBand, asked: Sequence[tuple[Model, list[Legs]]]) -> tuple[float, ...]:
    """By how much a band of its level grows with the distance from what was seen, by quantity; 0 where none is far."""
    beyond = np.concatenate([[], *(_beyond(model, legs)[:, -1] for model, legs in asked)])
    if not (far := beyond > 0.0).any():
        return band.growth
    states, measured = _of_all(asked), np.concatenate([_measured(legs) for _, legs in asked])
    spread = _spread(asked, states, np.array(band.shift))[:, -1:]
    widths = band.half_widths(spread, np.array(band.seconds[-1:]), np.zeros((len(beyond), 1)))[:, 0]
    excess = _sizes(states - measured)[:, -1] / widths - 1.0
    wanted = np.quantile(np.maximum(excess[far], 0.0) / beyond[far, None], band.level, axis=0)
    return tuple(wanted.tolist())


def _of_all(asked: Sequence[tuple[Model, list[Legs]]]) -> Array:
    return np.concatenate([_at_seconds(model, legs) for model, legs in asked])


def _spread(asked: Sequence[tuple[Model, list[Legs]]], states: Array, shift: Array) -> Array:
    moved = (_of_all([(model, _with(legs, k, by)) for model, legs in asked]) for k, by in enumerate(shift.tolist()))
    return spread_of(states, list(moved))


def held_predictions(model: Model, band: PredictionBand, data: DataSet) -> HeldPredictions:
    """Count how many predictions of 10 s on data end within a band; see `prediction_band`.

    Parameters
    ----------
    model : that predicts
    band : of the model
    data : on which predictions are counted
    """
    error, widths, known = errors_and_widths(model, band, data)
    if not known.size:
        return HeldPredictions()
    inside = (error <= widths)[known]
    counts = {"predictions": len(inside), "beyond": int((~known).sum())}
    shares = inside.mean(axis=0).tolist() if len(inside) else [float("nan")] * len(QUANTITIES)
    return HeldPredictions(**counts, **dict(zip(QUANTITIES, shares, strict=True)))


def errors_and_widths(model: Model, band: PredictionBand, data: DataSet) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Errors of predictions of 10 s on data, the half-widths of a band there, and whether it is told of them.

    Parameters
    ----------
    model : that predicts
    band : of the model
    data : on which predictions are asked

    Returns
    -------
    (error, widths, known)
        (predictions, 4) [m, m/s, m/s, rad/s], the same, and (predictions,)
    """
    asked = _legs(data)
    if not asked:
        return np.zeros((0, 4)), np.zeros((0, 4)), np.zeros(0, dtype=bool)
    states = _at_seconds(model, asked)
    known = np.all(band.knows(states[..., 3:]), axis=1)
    spread = spread_of(states, [_at_seconds(model, _with(asked, k, by)) for k, by in enumerate(band.shift)])[:, -1:]
    widths = band.half_widths(spread, np.array(band.seconds[-1:]), _beyond(model, asked)[:, -1:])
    return _sizes(states - _measured(asked))[:, -1], widths[:, 0], known


@np.errstate(over="ignore", invalid="ignore")  # a start whose prediction runs away has a width without end
def spread_of(states: Array, moved: Sequence[Array]) -> Array:
    """Sensitivity of predictions (..., 6) to their starts, (..., 4), from the same with each state moved."""
    return np.sqrt(np.sum([_sizes(one - states) ** 2 for one in moved], axis=0))


def _legs(data: DataSet) -> list[Legs]:
    """Predictions over the longest horizon, spread over the data."""
    spacing, result = _FEWER * max(SPACING, data.seconds / MOST_STARTS), []
    for motion in data.motions:
        steps = round(PREDICTED_SECONDS[-1] / motion.time_step)
        starts = np.arange(0, motion.time.size - steps, max(1, round(spacing / motion.time_step)))
        result += [Legs(motion, starts, steps)] * bool(starts.size)
    return result


def _with(asked: Sequence[Legs], state: int, by: float) -> list[Legs]:
    return [legs._replace(motion=with_moved_state(legs.motion, state, by)) for legs in asked]


def _beyond(model: Model, asked: Sequence[Legs]) -> Array:
    """Mean distance of predictions up to the horizons from what the model has seen, (predictions, horizons)."""
    result = []
    for legs in asked:
        total = np.cumsum(np.concatenate([[0.0], model.beyond(legs.motion)]))
        rows = _rows(legs) + 1
        result.append((total[legs.starts[:, None] + rows] - total[legs.starts][:, None]) / rows)
    return np.concatenate(result)


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


RESTART = 10.0
"""Open-loop rollouts in the series start again from the measured state every so often [s]."""
_DIGITS = 7
"""Decimals: a tenth of a micrometre, below any sensor, and far above what differs between machines."""
PREDICTED = ("u_dot", "v_dot", "r_dot", "north", "east", "psi", "u", "v", "r")
"""Columns of what a model says: accelerations filtered as the measured ones, and open-loop states."""
BANDS = ("position_band", "u_band", "v_band", "r_band")
"""Columns of the half-widths of a band, where there is one."""


def series(
    before: Model, after: Model, parts: Parts, channels: Sequence[str], band: PredictionBand | None = None
) -> SeriesTable:
    """Measured and predicted motion of two models along all parts of the logs, 10 Hz, as `series.csv` holds it.

    Columns: time [s], log, part, north, east [m], psi [rad], u, v [m/s], r [rad/s], commands, measured and modelled
    accelerations filtered alike, open-loop rollouts restarted every 10 s, and the residual force of the first model
    (X, Y [N], N [N m]) where it is a vehicle. `channels` names the command columns. With the `band` of the second
    model, half-widths of its rollouts: position_band [m], u_band, v_band [m/s], r_band [rad/s].
    """
    along = stretches(parts)
    found = [_measured_columns(stretch, channels) for stretch in along]
    both = list(dict.fromkeys((before, after)))
    said = dict(zip(both, predicted(both, along), strict=True))
    for name, model in (("before", before), ("after", after)):
        for columns, values in zip(found, said[model], strict=True):
            columns |= named([f"{column}_{name}" for column in PREDICTED], values)
    if band is not None:
        motions = [stretch.motion for stretch in along]
        for columns, widths in zip(found, half_widths(after, band, motions), strict=True):
            columns |= named(BANDS, widths)
    if isinstance(before, VehicleModel):
        for columns, stretch in zip(found, along, strict=True):
            force = residual(before.vehicle, stretch.motion, stretch.data).force
            columns |= named(["X_residual", "Y_residual", "N_residual"], force)
    return in_order(found)


def predicted(models: Sequence[Model], along: Sequence["Stretch"]) -> list[list[Array]]:
    """Predictions of each model along stretches, (n, 9) each, in the order of `PREDICTED`."""
    states = restarted(models, [stretch.motion for stretch in along])
    return [
        [np.column_stack([_modelled(model, stretch), rolled]) for stretch, rolled in zip(along, own, strict=True)]
        for model, own in zip(models, states, strict=True)
    ]


Columns = dict[str, NDArray[Any]]
"""A table by its columns (n,)."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A motion of the logs: its number of the log, the part that it belongs to, and that part's data."""

    motion: Motion
    log: int
    part: str
    data: DataSet

    @property
    def columns(self) -> Columns:
        """Time [s], log and part of each row."""
        n = self.motion.time.size
        return {"time": self.motion.time, "log": np.full(n, self.log), "part": np.full(n, self.part, object)}


def stretches(parts: Parts) -> list[Stretch]:
    """Every motion of every part."""
    logs: dict[str, int] = {}
    return [
        Stretch(motion, logs.setdefault(motion.source, len(logs)), part, parts.data(part))
        for part in PARTS
        for motion in parts.data(part).motions
    ]


def named(names: Sequence[str], values: NDArray[Any]) -> Columns:
    """The columns of values (n, names) by name."""
    return dict(zip(names, values.T, strict=True))


def in_order(found: Sequence[Columns], rounded: bool = True) -> SeriesTable:
    """The rows of all stretches in one table, by log and time, and `rounded` as `series.csv` holds them.

    What is joined is taken out of the stretches column by column: a long log is not in memory twice.
    """
    ordered = sorted(found, key=lambda columns: (columns["log"][0], columns["time"][0]))
    table = {}
    for name in list(ordered[0]):
        column = np.concatenate([columns.pop(name) for columns in ordered])
        table[name] = column.round(_DIGITS) if rounded and column.dtype.kind == "f" else column
    return SeriesTable(table)


def _measured_columns(stretch: Stretch, channels: Sequence[str]) -> Columns:
    motion = stretch.motion
    return {
        **stretch.columns,
        **named(["north", "east"], motion.position),
        "psi": motion.heading,
        **named(["u", "v", "r"], motion.velocity),
        **named(channels, motion.commands),
        **named(["u_dot", "v_dot", "r_dot"], accelerations(motion)),
    }


def _modelled(model: Model, stretch: Stretch) -> Array:
    """The acceleration that a model says along a stretch, filtered as the measured one, (n, 3)."""
    return same_filter(model.acceleration(stretch.motion), stretch.motion, stretch.data)


def restarted(models: Sequence[Model], motions: Sequence[Motion]) -> list[list[Array]]:
    """Open-loop states of each model along motions, put back on the measurement every 10 s.

    They are (n, 6): north, east, psi, u, v, r.
    """
    found: dict[tuple[Model, int], Array] = {}
    asked: list[Legs] = []
    for motion in motions:
        measured = np.column_stack([motion.position, motion.heading, motion.velocity])
        found |= {(model, id(motion)): measured.copy() for model in models}
        end, every = motion.time.size - 1, round(RESTART / motion.time_step)
        starts = np.arange(0, end + 1 - every, every)
        last = int(starts[-1]) + every if starts.size else 0
        whole, rest = Legs(motion, starts, every), Legs(motion, np.array([last]), end - last)
        asked += [legs for legs in (whole, rest) if legs.starts.size and legs.steps]
    for model, legs, states in rolled_out(models, asked):
        whole = legs.steps == round(RESTART / legs.motion.time_step)
        ahead = np.arange(1, legs.steps + (not whole))  # where one ends another starts, from the measurement
        found[model, id(legs.motion)][legs.starts[:, None] + ahead] = states[:, ahead]
    return [[found[model, id(motion)] for motion in motions] for model in models]


def half_widths(model: Model, band: PredictionBand, motions: Sequence[Motion]) -> list[Array]:
    """Half-widths of a band about the states that `restarted` gives, (n, 4) each, in the order of `BANDS`.

    NaN from where a prediction goes beyond the speeds of which the band knows.

    Parameters
    ----------
    model : that predicts
    band : of the model
    motions : along which it predicts
    """
    [states] = restarted([model], motions)
    moved = [restarted([model], versions)[0] for versions in zip(*map(band.moved, motions), strict=True)]
    result = []
    for motion, own, *others in zip(motions, states, *moved, strict=True):
        row, every = np.arange(motion.time.size), round(RESTART / motion.time_step)
        beyond = ~band.knows(own[:, 3:])
        begun = row - row % every
        before = (np.cumsum(beyond) - beyond)[begun]
        total = np.cumsum(model.beyond(motion))
        so_far = (total - np.where(begun > 0, total[begun - 1], 0.0)) / (row - begun + 1)
        widths = band.half_widths(spread_of(own, others), (row - begun) * motion.time_step, so_far)
        result.append(np.where((np.cumsum(beyond) > before)[:, None], np.nan, widths))
    return result
