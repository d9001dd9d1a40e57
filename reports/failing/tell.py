"""Everything about where two models fail, as `comparison.json` says it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...measurements.dataset import DataSet
from ...residuals.models import Model
from ..plotted import ENOUGH_SECONDS
from ..wording import AXES
from .along import Along
from .drift import over_time
from .frequency import NOISE, against_frequency
from .heading import against_heading
from .lag import against_lag
from .linking import Contributions, contributions
from .places import worst_places
from .scene import Array, Scene, scene
from .segments import segments

_FALLS = 0.9
"""Share of an error below which it is told why no effect is named for its fall."""


def where_they_fail(
    table: pd.DataFrame,
    before: Model,
    after: Model | None,
    parts: Sequence[DataSet],
    judge: str,
    *,
    link: bool = True,
) -> dict[str, list[dict[str, Any]]]:
    """Where the first and the last model of a series fail, in what their errors are alike, and what removes them.

    Parameters
    ----------
    table : as `series.csv`, all parts
    before, after : the models of its columns; None for no second one
    parts : train, validation and test, from which the table was made
    judge : the part that judges, or "all"; where it is shorter than a minute, the whole log does
    link : False where what distinguishes the last model is no effect that somebody added

    No place and no stretch of time is told on an axis whose error looks like sensor noise: noise has its worst, too.

    Returns
    -------
    `failures` and `structure` of `comparison.json`.
    """
    judged, rows_of = judged_rows(table, judge)
    names = [(before, "before"), *([(after, "after")] if after is not None else [])]
    whole = scene(table, "before")
    along = Along(parts)
    effects = contributions(before, after, along, whole) if after is not None and link else None
    later = np.square(scene(table, "after").error) if after is not None else None
    failures: list[dict[str, Any]] = []
    structure: list[dict[str, Any]] = []
    for model, which in names:
        stage = scene(table[judged], which)
        first = which == "before"
        fate = _Fate(whole, judged, effects if first else None, later if first else None)
        looks = structure_of(stage, along.thrust(model.vehicle)[judged])
        heard = [looks["frequency"][axis]["verdict"] not in NOISE for axis in AXES]
        for found in (place for place in worst_places(stage) if heard[place.axis]):
            told = {"model": model.name, **found.told(stage), "rows_of": rows_of}
            failures.append({**told, **fate.of(found.place.inside, found.axis)})
        seconds = [{**one.told(stage), **fate.of(one.rows, one.axis)} for one in segments(stage) if heard[one.axis]]
        structure.append({"model": model.name, "rows_of": rows_of, "segments": seconds, **looks})
    return {"failures": failures, "structure": structure}


def structure_of(stage: Scene, thrust: Array) -> dict[str, dict[str, Any]]:
    """The looks at one model's error by axis: `frequency`, `lag`, `heading`, `drift`.

    Parameters
    ----------
    thrust : (n, 3) the part of the modelled acceleration that the thrusters give
    """
    return {
        "frequency": against_frequency(stage),
        "lag": against_lag(stage, thrust),
        "heading": against_heading(stage),
        "drift": over_time(stage),
    }


def judged_rows(table: pd.DataFrame, judge: str) -> tuple[NDArray[np.bool_], str]:
    """The rows that judge, (n,), and the name of their part: all rows where the part is shorter than a minute."""
    rows = (table["part"] == judge).to_numpy(bool)
    step = float(np.median(np.diff(table["time"].to_numpy()[:50])))
    if judge == "all" or rows.sum() * step < ENOUGH_SECONDS:
        return np.ones(len(table), bool), "all"
    return rows, judge


class _Fate:
    """What becomes of the error of a place: how large it is in the last model, and which effects removed it."""

    def __init__(
        self, whole: Scene, judged: NDArray[np.bool_], effects: Contributions | None, later: Array | None
    ) -> None:
        self._whole, self._judged, self._effects, self._later = whole, np.flatnonzero(judged), effects, later

    def of(self, inside: NDArray[np.bool_], axis: int) -> dict[str, Any]:
        rows = np.zeros(len(self._whole.table), bool)
        rows[self._judged[inside]] = True
        removed, why = ([], "") if self._effects is None else self._effects.to(self._whole, rows, axis)
        if self._later is None:
            return {"removed_by": removed}
        after = float(np.sqrt(np.nanmean(self._later[rows, axis])))
        before = float(np.sqrt(np.nanmean(np.square(self._whole.error[rows, axis]))))
        told = {"rmse_after": round(after, 6), "removed_by": removed}
        return told | ({"unlinked": why} if why and after < _FALLS * before else {})
