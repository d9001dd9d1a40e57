"""Failures of two models, as `comparison.json` has them, and how much of an error each effect removes.

An effect's share is computed by putting it into the model and taking it out again.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Annotated, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from ...discovery.findings import FailingPlace, Removal
from ...measurements.preparation.prepare import DataSet
from ...measurements.preparation.split import PARTS
from ...physics.effects import EFFECTS
from ...physics.errors import VehicleError
from ...physics.file_records import Record
from ...physics.forces import actuation, modelled_acceleration
from ...physics.momentum_balance import mass_matrix, thruster_matrix
from ...physics.motion import AXES, Motion
from ...physics.presentation import number, share_removed, unit_text, words
from ...physics.vehicle import Vehicle
from ...residuals.models.base import Model, VehicleModel
from ...residuals.scores import same_filter
from ...residuals.series import SeriesTable
from .frequency import NOISE, Frequency, Lag, against_frequency, against_lag
from .places import FailingSeconds, Failure, segments, worst_places
from .rows import ENOUGH_SECONDS, Array, Scene, lower_end, scene
from .trends import Drift, Heading, against_heading, over_time

_EXACT = 6
"""Up to so many effects every order of adding them counts; beyond, one order and its reverse."""
_LEAST = 0.1
"""Share of the error of a place that an effect must remove to be named there."""
_HELD_OUT_LEAST = 0.05
"""The same on its held-out rows, half as much: they are few, and only have to agree."""
_UNSEEN = "not seen on held-out rows ({seconds:.1f} s of this are, {least:g} s are needed)"
_NONE_ALONE = "no effect removes a tenth of it for sure, there and on held-out rows"
_HELD_OUT_SECONDS = 2.0
"""Held-out time [s] in a place, without which no effect is named for it."""
_SAME = 1e-6
"""Acceleration [m/s^2, rad/s^2] by which two models may differ and be the same."""


class Along:
    """The logs of a comparison, train, validation and test part, in the order in which `series.series` has them.

    Parameters
    ----------
    only : the part that is wanted
    """

    def __init__(self, parts: Sequence[DataSet], only: str = "all") -> None:
        logs = {source: k for k, source in enumerate(dict.fromkeys(m.source for data in parts for m in data.motions))}
        self._parts = [data for name, data in zip(PARTS, parts, strict=True) if only in ("all", name)]
        motions = [motion for data in self._parts for motion in data.motions]
        log = np.concatenate([np.full(m.time.size, logs[m.source]) for m in motions])
        self._order = np.lexsort((np.concatenate([m.time for m in motions]), log))

    def acceleration(self, vehicle: Vehicle) -> Array:
        """Modelled acceleration of a vehicle, (n, 3) [m/s^2, m/s^2, rad/s^2]."""
        return self._each(lambda motion: modelled_acceleration(vehicle, motion))

    def thrust(self, vehicle: Vehicle) -> Array:
        """The part of it that the thrusters give, (n, 3)."""
        push = np.linalg.solve(mass_matrix(vehicle), thruster_matrix(vehicle))
        return self._each(lambda motion: (push @ actuation(vehicle, motion).thrust).T)

    def _each(self, of: Callable[[Motion], Array]) -> Array:
        found = [same_filter(of(motion), motion, data) for data in self._parts for motion in data.motions]
        return np.concatenate(found)[self._order]


@dataclass(frozen=True, slots=True)
class Contributions:
    """Share of each effect, by which two vehicles differ, in the squared error of every row.

    Attributes
    ----------
    effects : their names in the catalogue (the symbol, for a parameter that belongs to none)
    changes : what changes, in words: "N_uv from 0 to -25 N s^2/m"
    removed : (effects, n, 3) squared error that each removes, as the mean over the orders in which they can be added,
        so that they sum to what all remove (the Shapley value)
    missed : (effects, n, 3) squared error that comes back when one alone is taken out of the corrected model
    """

    effects: tuple[str, ...]
    changes: tuple[str, ...]
    removed: Array
    missed: Array

    def to(self, stage: Scene, rows: NDArray[np.bool_], axis: int) -> tuple[tuple[Removal, ...], str]:
        """The effects that remove the error of a place on one axis; or why none.

        An effect is named when it removes a tenth of the squared error there and the 95 % interval of that share, over
        blocks, lies above zero; and when, on the held-out rows of the place alone, at least 2 s of them, it removes
        error and its loss brings error back.

        Parameters
        ----------
        stage : rows of the series
        rows : (n,) of the place
        axis : 0 to 2
        """
        usable = np.isfinite(stage.error[:, axis]) & np.isfinite(self.removed[..., axis]).all(axis=0)
        inside, unseen = rows & usable, rows & usable & stage.held_out
        square = np.where(usable, np.square(stage.error[:, axis]), 0.0)
        total, unseen_total = square[inside].sum(), square[unseen].sum()
        seconds = float(unseen.sum() * stage.step)
        if seconds < _HELD_OUT_SECONDS:
            return (), _UNSEEN.format(seconds=seconds, least=_HELD_OUT_SECONDS)
        if total <= 0.0 or unseen_total <= 0.0:
            return (), ""
        found: list[Removal] = []
        blocks = np.unique(stage.block[inside])
        for k, effect in enumerate(self.effects):
            removed, missed = self.removed[k, :, axis], self.missed[k, :, axis]
            share = removed[inside].sum() / total
            here = np.where(inside, removed, 0.0), np.where(inside, square, 0.0)
            sure = blocks.size == 1 or lower_end(stage, *here, blocks) > 0.0
            held = removed[unseen].sum() / unseen_total >= _HELD_OUT_LEAST and missed[unseen].sum() > 0.0
            if share >= _LEAST and sure and held:
                done = f"removes {share_removed(share)} of the squared error here"
                sentence = f"{words(effect)} ({self.changes[k]}) {done}"
                found.append(Removal(effect=effect, share_removed=round(float(share), 4), sentence=sentence))
        return tuple(sorted(found, key=lambda one: -one.share_removed)), "" if found else _NONE_ALONE


def contributions(before: Model, after: Model, along: Along, stage: Scene) -> Contributions | None:
    """Compute what each effect by which `after` differs from `before` does to the error along logs.

    Parameters
    ----------
    before, after : the models of the series' first and last columns
    along : those logs
    stage : the rows of the series along them, of the first model

    Returns
    -------
    None where the models are not two vehicles, or differ in more than parameters.
    """
    if not (isinstance(before, VehicleModel) and isinstance(after, VehicleModel)):
        return None
    groups = _differences(before.vehicle, after.vehicle)
    names = tuple(groups)
    if not names:
        return None
    nominal = before.vehicle

    def acceleration(subset: frozenset[str]) -> Array:
        """Modelled acceleration of the first vehicle with some of the effects."""
        return along.acceleration(nominal.with_values({s: v for name in subset for s, v in groups[name].items()}))

    whole = frozenset(names)
    try:
        if np.abs(acceleration(whole) - along.acceleration(after.vehicle)).max() > _SAME:
            return None  # other thrusters or curves: more than the catalogue can say
        removed, missed = (np.zeros((len(names), *stage.error.shape)) for _ in range(2))
        for subset, weights in _weights(names).items():  # by set: of a long log the errors of one alone are in memory
            squares = np.square(acceleration(subset) - stage.measured)
            for k, name in enumerate(names):
                removed[k] += weights.get(name, 0.0) * squares
                if whole - subset <= {name}:
                    missed[k] += squares if subset != whole else -squares
    except (VehicleError, np.linalg.LinAlgError):
        return None  # a mixture of the two that is no sound vehicle
    changes = tuple(_in_words(nominal, after.vehicle, groups[name]) for name in names)
    return Contributions(names, changes, removed, missed)


def _differences(before: Vehicle, after: Vehicle) -> dict[str, dict[str, float]]:
    """The symbols in which two vehicles differ, with the second's values, under the names of the effects they are."""
    belongs = {f"{thruster.name}_scale": "thruster_asymmetry" for thruster in before.thrusters}
    belongs |= {symbol: effect.name for effect in EFFECTS for symbol in effect.symbols}
    groups: dict[str, dict[str, float]] = {}
    for symbol in dict.fromkeys((*before.values, *after.values)):
        old, new = (vehicle.values.get(symbol, 0.0) for vehicle in (before, after))  # a term may be in one alone
        if old != new:
            groups.setdefault(belongs.get(symbol, symbol), {})[symbol] = new
    return groups


def _weights(names: tuple[str, ...]) -> dict[frozenset[str], dict[str, float]]:
    """For each set of effects, how its squared error counts in what each effect removes.

    That is the mean over all orders of adding them, of many effects over one order and its reverse.
    """
    orders = list(permutations(names)) if len(names) <= _EXACT else [names, names[::-1]]
    result: defaultdict[frozenset[str], Counter[str]] = defaultdict(Counter)
    for order in orders:
        for k, name in enumerate(order):
            result[frozenset(order[:k])][name] += 1
            result[frozenset(order[: k + 1])][name] -= 1
    lacking = {frozenset(names) - {name}: Counter[str]() for name in names}  # which tell what the lack of one costs
    return {s: {name: n / len(orders) for name, n in counts.items()} for s, counts in (lacking | result).items()}


def _in_words(before: Vehicle, after: Vehicle, symbols: Mapping[str, float]) -> str:
    told = []
    for symbol, value in symbols.items():
        unit = unit_text(after.parameter(symbol).unit) if symbol not in ("mass", "inertia_z") else ""
        told.append(f"{symbol} from {number(before.values.get(symbol, 0.0))} to {number(value)} {unit}".rstrip())
    return ", ".join(told)


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

    @property
    def looks(self) -> "tuple[Mapping[str, Frequency | Lag | Heading | Drift], ...]":
        """Fast or slow, early or late, with the heading, and over time."""
        return self.frequency, self.lag, self.heading, self.drift


Fails = tuple[tuple[FailingPlace, ...], tuple[Structure, ...]]
"""Where models fail, and the structure of their errors."""
Told = TypeVar("Told", FailingPlace, FailingSeconds)


def where_they_fail(
    table: SeriesTable, before: Model, after: Model | None, parts: Sequence[DataSet], judge: str, *, link: bool = True
) -> Fails:
    """Failures of the first and the last model of a series, the structure of their errors, and what removes them.

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
    table, along = table.rows(judged), Along(parts, rows_of)
    stage, last = scene(table, "before"), None if after is None else scene(table, "after")
    effects = contributions(before, after, along, stage) if after is not None and link else None
    found = [_found(before, stage, along, rows_of, effects, last)]
    if after is not None and last is not None:
        known = found[0] if np.array_equal(stage.error, last.error, equal_nan=True) else None  # nothing was missing
        found.append(_found(after, last, along, rows_of, looks=None if known is None else known[1]))
    return tuple(place for places, _ in found for place in places), tuple(structure for _, structure in found)


def _found(
    model: Model,
    stage: Scene,
    along: Along,
    rows_of: str,
    effects: Contributions | None = None,
    last: Scene | None = None,
    looks: Structure | None = None,
) -> tuple[list[FailingPlace], Structure]:
    """Where one model fails, and the structure of its errors.

    Parameters
    ----------
    model, stage : the model, and the rows with its errors
    along, rows_of : the same rows as motions, and their name
    effects, last : by which the last model differs, and the rows with its errors; None for the last model itself
    looks : at the same errors, where these were looked at
    """

    def told(record: Told, one: Failure) -> Told:
        """With what becomes of the error: how large it is in the last model, and which effects removed it."""
        removed, why = ((), "") if effects is None else effects.to(stage, one.rows, one.axis)
        if last is None:
            return record.but(removed_by=removed)
        before, after = (float(np.sqrt(np.nanmean(np.square(s.error[one.rows, one.axis])))) for s in (stage, last))
        unlinked = why if why and after < _FALLS * before else None
        return record.but(rmse_after=round(after, 6), removed_by=removed, unlinked=unlinked)

    looks = looks or structure_of(stage, along.thrust(model.vehicle), model.name, rows_of)
    heard = [k for k, axis in enumerate(AXES) if looks.frequency[axis].verdict not in NOISE]
    places = [told(one.place(stage, model.name).but(rows_of=rows_of), one) for one in worst_places(stage, axes=heard)]
    seconds = tuple(told(one.seconds(stage), one) for one in segments(stage) if one.axis in heard)
    return places, looks.but(model=model.name, segments=seconds)


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
