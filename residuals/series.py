"""Measured and predicted motion side by side, along all parts of the logs, as `series.csv` holds it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..measurements.preparation.dataset import DataSet
from ..measurements.preparation.derive import accelerations
from ..measurements.preparation.split import PARTS
from ..measurements.prepared_logs import Parts
from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.simulation import Legs
from .models.band_record import PredictionBand
from .models.base import Model, VehicleModel, rolled_out
from .prediction_band import spread_of
from .residual import residual, same_filter
from .series_table import SeriesTable

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
    found = [_measured(stretch, channels) for stretch in along]
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
    """What each model says along stretches, (n, 9) each, in the order of `PREDICTED`."""
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


def _measured(stretch: Stretch, channels: Sequence[str]) -> Columns:
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
    """
    [states] = restarted([model], motions)
    moved = [restarted([model], versions)[0] for versions in zip(*map(band.moved, motions), strict=True)]
    found = []
    for motion, own, *others in zip(motions, states, *moved, strict=True):
        row, every = np.arange(motion.time.size), round(RESTART / motion.time_step)
        beyond = ~band.knows(own[:, 3:])
        before = (np.cumsum(beyond) - beyond)[row - row % every]
        widths = band.half_widths(spread_of(own, others), row % every * motion.time_step)
        found.append(np.where((np.cumsum(beyond) > before)[:, None], np.nan, widths))
    return found
