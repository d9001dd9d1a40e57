"""Everything about where two models fail, as `comparison.json` says it."""

from collections.abc import Mapping, Sequence
from typing import Annotated, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from ...discovery.findings import FailingPlace
from ...measurements.preparation.dataset import DataSet
from ...physics.file_records import Record
from ...physics.frames import AXES
from ...residuals.models.base import Model
from ...residuals.series_table import SeriesTable
from .attribution import Along, Contributions, contributions
from .drift import Drift, over_time
from .frequency import NOISE, Frequency, against_frequency
from .heading import Heading, against_heading
from .lag import Lag, against_lag
from .places import worst_places
from .rows import ENOUGH_SECONDS, Array, Scene, scene
from .segments import FailingSeconds, segments

_FALLS = 0.9
"""Share of an error below which it is told why no effect is named for its fall."""


def _of_every_axis(content: object) -> object:
    if isinstance(content, Mapping) and not set(AXES) <= set(content):
        raise ValueError(f"an entry for each of {', '.join(AXES)}")
    return content


_EVERY = BeforeValidator(_of_every_axis)


class Structure(Record):
    """In what the errors of a model are alike: the worst seconds, and the looks at its error by axis."""

    model: str
    rows_of: str = ""
    segments: tuple[FailingSeconds, ...] = ()
    frequency: Annotated[Mapping[str, Frequency], _EVERY]
    lag: Annotated[Mapping[str, Lag], _EVERY]
    heading: Annotated[Mapping[str, Heading], _EVERY]
    drift: Annotated[Mapping[str, Drift], _EVERY]


Fails = tuple[tuple[FailingPlace, ...], tuple[Structure, ...]]
"""Where models fail, and the structure of their errors."""
Told = TypeVar("Told", FailingPlace, FailingSeconds)


def where_they_fail(
    table: SeriesTable,
    before: Model,
    after: Model | None,
    parts: Sequence[DataSet],
    judge: str,
    *,
    link: bool = True,
) -> Fails:
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
    The failures, and the structure of the errors.
    """
    judged, rows_of = judged_rows(table, judge)
    names = [(before, "before"), *([(after, "after")] if after is not None else [])]
    table, along = table.rows(judged), Along(parts, rows_of)
    stages = {which: scene(table, which) for _, which in names}
    effects = contributions(before, after, along, stages["before"]) if after is not None and link else None
    later = np.square(stages["after"].error) if after is not None else None
    failures: list[FailingPlace] = []
    structure: list[Structure] = []
    known: Scene | None = None
    for model, which in names:
        stage = stages[which]
        fate = _Fate(stage, effects, later) if which == "before" else _Fate(stage)
        if known is None or not np.array_equal(stage.error, known.error, equal_nan=True):  # as where nothing is missing
            known = stage
            looks = structure_of(stage, along.thrust(model.vehicle), model.name, rows_of)
            heard = [k for k, axis in enumerate(AXES) if looks.frequency[axis].verdict not in NOISE]
            places, worst = worst_places(stage, axes=heard), segments(stage)
        for found in places:
            told = found.told(stage, model.name).but(rows_of=rows_of)
            failures.append(fate.of(told, found.place.inside, found.axis))
        seconds = [fate.of(one.told(stage), one.rows, one.axis) for one in worst if one.axis in heard]
        structure.append(looks.but(model=model.name, segments=tuple(seconds)))
    return tuple(failures), tuple(structure)


def structure_of(stage: Scene, thrust: Array, model: str, rows_of: str) -> Structure:
    """The looks at one model's error by axis, without its worst seconds.

    Parameters
    ----------
    thrust : (n, 3) the part of the modelled acceleration that the thrusters give
    model, rows_of : its name, and the part that was looked at
    """
    return Structure(
        model=model,
        rows_of=rows_of,
        frequency=against_frequency(stage),
        lag=against_lag(stage, thrust),
        heading=against_heading(stage),
        drift=over_time(stage),
    )


def judged_rows(table: SeriesTable, judge: str) -> tuple[NDArray[np.bool_], str]:
    """The rows that judge, (n,), and the name of their part: all rows where the part is shorter than a minute."""
    rows = table["part"] == judge
    step = float(np.median(np.diff(table["time"][:50])))
    if judge == "all" or rows.sum() * step < ENOUGH_SECONDS:
        return np.ones(len(table), bool), "all"
    return rows, judge


class _Fate:
    """What becomes of the error of a place: how large it is in the last model, and which effects removed it."""

    def __init__(self, stage: Scene, effects: Contributions | None = None, later: Array | None = None) -> None:
        self._stage, self._effects, self._later = stage, effects, later

    def of(self, told: Told, rows: NDArray[np.bool_], axis: int) -> Told:
        """What is told of a place, with that."""
        removed, why = ((), "") if self._effects is None else self._effects.to(self._stage, rows, axis)
        if self._later is None:
            return told.but(removed_by=removed)
        after = float(np.sqrt(np.nanmean(self._later[rows, axis])))
        before = float(np.sqrt(np.nanmean(np.square(self._stage.error[rows, axis]))))
        unlinked = why if why and after < _FALLS * before else None
        return told.but(rmse_after=round(after, 6), removed_by=removed, unlinked=unlinked)
