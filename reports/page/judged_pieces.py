"""The judged stretches of a run, each with the model that was fitted without it, and these models moved by hand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...discovery.findings import Findings
from ...physics.stated_values import values_of
from ...physics.vehicle import Vehicle
from .figures.figure_data import held_out_rows

_ROWS = 3000
"""Rows that are predicted, five minutes: more would not follow a slider."""


class Piece(NamedTuple):
    """A stretch of rows without a gap, and the number of the model that predicts it."""

    rows: pd.DataFrame
    model: int


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
    """

    nominal: Vehicle
    models: tuple[Vehicle, ...]
    pieces: tuple[Piece, ...]
    step: float
    seconds: float

    @classmethod
    def of(
        cls, findings: Findings, series: pd.DataFrame, nominal: Vehicle, corrected: Vehicle, horizon: float
    ) -> "JudgedPieces":
        """The pieces of a run for predictions over a horizon [s]."""
        judged = held_out_rows(series)[0]
        folds = findings.folds.models if findings.folds else ()
        changed = {symbol: nominal.value(symbol) for symbol in corrected.values if ":" in symbol}
        models = tuple(nominal.with_values(changed | dict(fold.values)) for fold in folds) or (corrected,)
        step = float(np.median(np.diff(judged["time"]))) if len(judged) > 1 else 1.0
        pieces = _pieces(judged, _model_of_rows(judged, findings), step, round(horizon / step))
        return cls(nominal, models, pieces, step, len(judged) * step)

    @property
    def rows(self) -> pd.DataFrame:
        """The rows of all pieces."""
        return pd.concat([piece.rows for piece in self.pieces]) if self.pieces else pd.DataFrame({"time": []})

    @property
    def some(self) -> str:
        """How much of what was judged they are, as the end of a phrase; empty where they are nearly all of it."""
        here = len(self.rows) * self.step
        return f" over {here:.0f} of {self.seconds:.0f} s" if here < self.seconds - 0.5 * self.step else ""

    def changes(self, model: Vehicle) -> list[tuple[str, float, float]]:
        """What a model changes of the nominal one: symbol, value before and after."""
        both = ((symbol, self.nominal.value(symbol), after) for symbol, after in model.values.items())
        return [
            one for one in both if one[1] != one[2] and not apart(self.nominal, one[0]) and not apart(model, one[0])
        ]

    def moved(self, shares: Mapping[str, float]) -> tuple[Vehicle, ...]:
        """The models with a share of each of their changes: none of it before, all of it after.

        Parameters
        ----------
        shares : by symbol; what only some of the models change has the mean of them
        """
        mean = float(np.mean(list(shares.values()))) if shares else 1.0
        return tuple(
            model.with_values({s: low + shares.get(s, mean) * (high - low) for s, low, high in self.changes(model)})
            for model in self.models
        )


def apart(vehicle: Vehicle, symbol: str) -> bool:
    """Whether thrusters differ in what all share as a rule: no single number moves that."""
    return len(values_of(vehicle, symbol)) > 1


def _pieces(judged: pd.DataFrame, model: NDArray[np.intp], step: float, horizon: int) -> tuple[Piece, ...]:
    """The stretches of rows of one model without a gap that are longer than a horizon, as many as are followed."""
    time, log = judged["time"].to_numpy(), judged["log"].to_numpy()
    apart = (np.diff(log) != 0) | (np.diff(model) != 0) | (np.abs(np.diff(time) - step) > 0.5 * step)
    found, left = [], _ROWS
    for begin, end in pairwise([0, *(np.flatnonzero(apart) + 1).tolist(), time.size]):
        last = min(end, begin + left)
        if last - begin > horizon and model[begin] >= 0:
            found.append(Piece(judged.iloc[begin:last], int(model[begin])))
            left -= last - begin
    return tuple(found)


def _model_of_rows(judged: pd.DataFrame, findings: Findings) -> NDArray[np.intp]:
    """The number of the model that was fitted without each row; -1 where every model saw it."""
    folds = findings.folds.models if findings.folds else ()
    found = np.full(len(judged), -1 if folds else 0, dtype=np.intp)
    for k, fold in enumerate(folds):
        for log, begin, end in fold.stretches:
            found[(judged["log"] == log) & judged["time"].between(begin, end)] = k
    return found


def begun(series: pd.DataFrame, pieces: Sequence[Piece]) -> list[float]:
    """Minutes from the first row of its log to each piece."""
    first = series.groupby("log")["time"].min()
    return [float(one.rows["time"].iloc[0] - first[one.rows["log"].iloc[0]]) / 60.0 for one in pieces]
