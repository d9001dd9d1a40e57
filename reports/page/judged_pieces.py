"""Judged pieces of a run for the figures: each with the model that was fitted without it."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...comparison.failing.rows import ENOUGH_SECONDS
from ...discovery.findings import Findings
from ...measurements.prepared_logs import FOLDS
from ...physics.momentum_balance import values_of
from ...physics.vehicle import Vehicle
from ...residuals.scores import MOST_STARTS, SPACING

SHOWN_SECONDS = 120.0  # longest stretch of held-out motion drawn as lines
SHOWN_POINTS = 600  # points per line after thinning
ACCELERATIONS = {"surge": "u_dot", "sway": "v_dot", "yaw": "r_dot"}  # columns of the series
PREDICTED = ("u", "v", "r", "north", "east")
MODELS = ("before", "after")
_GAP = 0.5  # share of a step by which rows are farther apart, or nearer, where a record is interrupted


def liveliest_stretch(series: pd.DataFrame) -> pd.DataFrame:
    """The `SHOWN_SECONDS` of a log with the most motion, from a start of predictions on.

    Held-out rows, or all where none is marked as held out. The motion is the sum of the squared speeds, each in units
    of its mean square over these rows.
    """
    test, _ = held_out_rows(series)
    speeds = test[["u", "v", "r"]].to_numpy() ** 2
    motion = (speeds / np.maximum(speeds.mean(axis=0), 1e-12)).sum(axis=1)
    starts, log, time = restarts(test), test["log"].to_numpy(), test["time"].to_numpy()
    found = [(0.0, test[log == log[0]])]
    for one in pd.unique(log):
        rows = np.flatnonzero(log == one)
        first = rows[starts[rows]] if starts[rows].any() else rows[:1]
        until = rows[0] + np.searchsorted(time[rows], time[first] + SHOWN_SECONDS, "right")
        total = np.concatenate([[0.0], np.cumsum(motion)])
        worth = total[until] - total[first]
        best = int(np.argmax(worth))
        found.append((float(worth[best]), test.iloc[first[best] : until[best]]))
    return max(found, key=lambda pair: pair[0])[1]


def held_out_rows(series: pd.DataFrame) -> tuple[pd.DataFrame, bool]:
    """The rows that no fit saw, and True; the whole series and False when nothing is marked as held out."""
    test = series[series["part"] == "test"]
    return (series, False) if test.empty else (test, True)


def regime_rows(series: pd.DataFrame) -> tuple[pd.DataFrame, bool]:
    """The rows for the map of errors, and whether they are held out: the test rows when they last `ENOUGH_SECONDS`."""
    test = series[series["part"] == "test"]
    step = float(np.median(np.diff(series["time"]))) if len(series) > 1 else 0.0
    return (test, True) if len(test) * step >= ENOUGH_SECONDS else (series, False)


def rollouts(series: pd.DataFrame) -> pd.DataFrame:
    """Thin a stretch for drawing, mark the restarts of its predictions and break lines there and at gaps.

    Parameters
    ----------
    series : DataFrame
        Rows of one log of `series.csv`, in order.

    Returns
    -------
    DataFrame
        The same columns with `restart` (bool); the predictions are NaN in an extra row before each restart, so that
        no line is drawn from the end of one rollout to the start of the next, and what was measured is NaN there, too,
        where the record has a gap.
    """
    restart, time = restarts(series), series["time"].to_numpy()
    step = float(np.median(np.diff(time))) if len(series) > 1 else 0.0
    gap = interrupted(time, step)
    stride = max(1, len(series) // SHOWN_POINTS)
    keep = restart | gap | np.append(gap[1:], True) | (np.arange(len(series)) % stride == 0)  # and the row before a gap
    thinned = series.assign(restart=restart, gap=gap)[keep]
    breaks = thinned[thinned["restart"] | thinned["gap"]].copy()
    breaks[[f"{name}_{model}" for name in PREDICTED for model in MODELS]] = np.nan
    breaks.loc[breaks["gap"], list(PREDICTED)] = np.nan
    breaks["restart"] = False
    joined = pd.concat([breaks.assign(order=0), thinned.assign(order=1)])
    return joined.sort_values(["time", "order"], kind="stable").drop(columns=["order", "gap"]).reset_index(drop=True)


def interrupted(time: np.ndarray, step: float) -> np.ndarray:
    """Rows (n,) that do not follow the row before in time."""
    return np.append(False, np.abs(np.diff(time) - step) > _GAP * step)


def restarts(series: pd.DataFrame) -> np.ndarray:
    """Rows (n,) at which the predictions of both models are put back on the measurement."""
    gaps = [np.abs(series[f"{name}_{model}"] - series[name]) for name in PREDICTED for model in MODELS]
    restart = np.max(gaps, axis=0) < 1e-9
    # Two neighbouring rows that agree are a boat at rest, not two rollouts.
    restart[1:] &= ~restart[:-1]
    return restart


_SECONDS = MOST_STARTS * SPACING
"""Length of what is predicted [s], five minutes: of longer logs the errors of a run, too, count no more predictions."""


class Piece(NamedTuple):
    """A stretch of rows without a gap, the number of the model that predicts it, and minutes since the log began."""

    rows: pd.DataFrame
    model: int
    begins: float


@dataclass(frozen=True, slots=True, eq=False)
class JudgedPieces:
    """What is predicted when a number is moved by hand.

    Attributes
    ----------
    nominal : the vehicle before
    models : one fitted without each fold, or the corrected one where a part of the logs was kept aside
    pieces : none shorter than a prediction
    step : time between rows [s]
    seconds : of all rows that were judged [s]
    seen : the one model was fitted to these rows, so that its errors are smaller than those the run tells
    """

    nominal: Vehicle
    models: tuple[Vehicle, ...]
    pieces: tuple[Piece, ...]
    step: float
    seconds: float
    seen: bool

    @classmethod
    def of(
        cls, findings: Findings, series: pd.DataFrame, nominal: Vehicle, corrected: Vehicle, horizon: float
    ) -> "JudgedPieces":
        """The pieces of a run for predictions over a horizon [s]."""
        judged, held_out = held_out_rows(series)
        folds = findings.folds.models if findings.folds else ()
        changed = {symbol: nominal.value(symbol) for symbol in corrected.values if ":" in symbol}
        models = tuple(nominal.with_values(changed | dict(fold.values)) for fold in folds) or (corrected,)
        step = float(np.median(np.diff(judged["time"]))) if len(judged) > 1 else 1.0
        begins = series.groupby("log")["time"].min()
        pieces = _pieces(judged, _model_of_rows(judged, findings), begins, step, round(horizon / step))
        seen = not folds and (not held_out or findings.data.split == FOLDS)
        return cls(nominal, models, pieces, step, len(judged) * step, seen)

    @property
    def rows(self) -> pd.DataFrame:
        """The rows of all pieces."""
        return pd.concat([piece.rows for piece in self.pieces]) if self.pieces else pd.DataFrame({"time": []})

    @property
    def some(self) -> str:
        """What of what was judged they are, as the end of a phrase; empty where they are nearly all, and unseen."""
        here = len(self.rows) * self.step
        part = f" over {here:.0f} of {self.seconds:.0f} s" if here < self.seconds - 0.5 * self.step else ""
        return f"{part}{', on rows that the fit saw' * self.seen}"

    def moved(self, shares: Mapping[str, float]) -> tuple[Vehicle, ...]:
        """The models with a share of each of their changes: none of it before, all of it after.

        Parameters
        ----------
        shares : by symbol; what only some of the models change has the mean of them
        """
        mean = float(np.mean(list(shares.values()))) if shares else 1.0
        moved = []
        for model in self.models:
            changes = changed_numbers(self.nominal, model)
            values = {symbol: low + shares.get(symbol, mean) * (high - low) for symbol, low, high in changes}
            moved.append(model.with_values(values))
        return tuple(moved)


def changed_numbers(nominal: Vehicle, model: Vehicle) -> list[tuple[str, float, float]]:
    """What a model changes of another: symbol, value before and after.

    No single number moves what thrusters share as a rule and in which they differ here.
    """
    both = ((symbol, nominal.value(symbol), after) for symbol, after in model.values.items())
    moved = [(symbol, before, after) for symbol, before, after in both if before != after]
    return [one for one in moved if max(len(values_of(vehicle, one[0])) for vehicle in (nominal, model)) <= 1]


def _pieces(
    judged: pd.DataFrame, model: NDArray[np.intp], begins: "pd.Series[float]", step: float, horizon: int
) -> tuple[Piece, ...]:
    """The stretches of rows of one model without a gap that are longer than a horizon, as many as are followed."""
    time, log = judged["time"].to_numpy(), judged["log"].to_numpy()
    apart = (np.diff(log) != 0) | (np.diff(model) != 0) | interrupted(time, step)[1:]
    found, left = [], round(_SECONDS / step)
    for begin, end in pairwise([0, *(np.flatnonzero(apart) + 1).tolist(), time.size]):
        last = min(end, begin + left)
        if last - begin > horizon and model[begin] >= 0:
            minutes = float(time[begin] - begins[log[begin]]) / 60.0
            found.append(Piece(judged.iloc[begin:last], int(model[begin]), minutes))
            left -= last - begin
    return tuple(found)


def _model_of_rows(judged: pd.DataFrame, findings: Findings) -> NDArray[np.intp]:
    """The number of the model that was fitted without each row; -1 where every model saw it."""
    folds = findings.folds.models if findings.folds else ()
    result = np.full(len(judged), -1 if folds else 0, dtype=np.intp)
    for k, fold in enumerate(folds):
        for log, begin, end in fold.stretches:
            result[(judged["log"] == log) & judged["time"].between(begin, end)] = k
    return result
