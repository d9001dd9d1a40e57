"""Linearisation: every candidate's options as columns of the force equation, and its force along a log.

A column is the derivative of the force equation by a parameter, passed through the balance. An effect in which the
force is linear has one option beside absence; one with a shape (lag, delay, dead zone, memory time) has an option for
each starting value: a fixed offset of the force and the derivative about it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...measurements.prepared_logs import Parts
from ...physics.effects import Parameter
from ...physics.forces import CURRENT
from ...physics.motion import Array
from ...physics.thrusters import GAINS
from ...physics.vehicle import SHARED_THRUSTER_KEYS as SHARED
from ...physics.vehicle import Vehicle
from ...residuals.scores import residual
from ...residuals.series import Columns, SeriesTable, in_order, named, stretches
from ..balance.base import Balance
from .candidate import CALIBRATED, Candidate, Kind, candidates

_FAINT = 0.05
"""Share of a general effect's strongest column below which one of its parameters keeps its value: a regulariser, for no
fit tells a curve where a log hardly has commands."""
_FINER = (0.6, 0.75, 0.87, 0.93, 0.97, 1.03, 1.07, 1.15, 1.3, 1.6)
"""Factors about a value that moves in steps that are tried, closer and closer to it: an optimum between the grid's
values is met."""
_ROUGH = 0.02
"""To which a model near by is rounded [m/s, s, 1]: columns change by some two per cent, which ranks no neighbour."""


class FreeNumber(NamedTuple):
    """A number of an option that is fitted: its column, where it starts, and limits of its change from there."""

    symbol: str
    start: float
    column: int
    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class Option:
    """One way in which a candidate may stand: columns that are free, an offset that is fixed.

    Attributes
    ----------
    key, kind : the candidate's
    present : False for "absent"
    symbols : parameters set or freed
    start : the parameters' values about which the columns were taken
    free : indices of the free columns among `symbols` order, -1 for a symbol held at `start`
    offset : index of the fixed offset column, -1 for none
    lower, upper : limits of the change of each symbol from `start`; equal for one that the log says nothing of
    """

    key: str
    kind: Kind
    present: bool
    symbols: tuple[str, ...]
    start: tuple[float, ...]
    free: tuple[int, ...]
    offset: int
    lower: tuple[float, ...]
    upper: tuple[float, ...]

    @property
    def numbers(self) -> list[FreeNumber]:
        """The numbers that are fitted; none of what is absent."""
        rows = zip(self.symbols, self.start, self.free, self.lower, self.upper, strict=self.present)
        return [number for number in map(FreeNumber._make, rows) if number.column >= 0]


class Linearisation:
    """All columns of all candidates about one vehicle.

    Columns that do not change from one vehicle to the next are kept in the memo of the vehicle's neighbourhood.

    Parameters
    ----------
    balance : what the columns are columns of
    vehicle, nominal : the model at hand, and the one in which nothing is added
    pool : candidates that get options
    active : keys of those that stand in the vehicle
    standing : what is active gets no other option than as it stands
    roughly : what is not active gets its columns about a model near by, whose columns may be at hand: enough to choose
        what to try next

    Attributes
    ----------
    vehicle : the model about which the columns were taken
    options : candidate key -> its options; the first is how the candidate stands in `vehicle`
    columns : (tests, 3, columns + 1); the last is the balance, measured minus modelled force
    noise : (copies, tests, 3, columns + 1), what sensor noise adds to each of them, drawn a few times
    """

    def __init__(
        self,
        balance: Balance,
        vehicle: Vehicle,
        nominal: Vehicle,
        pool: Sequence[Candidate],
        active: Sequence[str],
        standing: bool = False,
        roughly: bool = False,
    ) -> None:
        self.vehicle = vehicle
        self._near = balance.about(vehicle)
        # Rollouts keep no columns from one model to the next.
        near_by = _near_by(vehicle) if roughly and self._near.linear else vehicle
        self._base = self._near.balances(vehicle)
        self._columns: list[Array] = []
        self.options: dict[str, tuple[Option, ...]] = {}
        for candidate in pool:
            absent, shapes = {p.symbol: nominal.value(p.symbol) for p in candidate.parameters}, candidate.effect.shapes
            if candidate.key in active:
                now = tuple(vehicle.value(s) for s in candidate.symbols)
                here = self._present(candidate, vehicle, now, -1)
                if standing:
                    self.options[candidate.key] = (here,)
                    continue
                gone = self._add(self._removal(candidate, absent, here))
                others = self._shapes(candidate, vehicle, absent, near=now) if shapes else ()
                self.options[candidate.key] = (here, _absent(candidate, absent, gone), *others)
            elif shapes:
                self.options[candidate.key] = (_absent(candidate, absent), *self._shapes(candidate, near_by, absent))
            else:
                plain = self._present(candidate, near_by, tuple(absent.values()), -1)
                self.options[candidate.key] = (_absent(candidate, absent), plain)
        # Laid out with the tests last, for whoever sums over them; each column is one stride of memory.
        copies, tests, axes = self._base.shape
        every = np.empty((copies, axes, len(self._columns) + 1, tests))
        for k, column in enumerate((*self._columns, self._base)):
            every[:, :, k] = column.transpose(0, 2, 1)
        every[1:] -= every[0]  # in place: on a log of an hour the copies are most of the memory
        laid = every.transpose(0, 3, 1, 2)
        self.columns, self.noise = laid[0], laid[1:]

    def _add(self, column: Array) -> int:
        self._columns.append(column)
        return len(self._columns) - 1

    def _removal(self, candidate: Candidate, absent: dict[str, float], here: Option) -> Array:
        """The force that setting a present candidate back to absent adds, (1 + copies, tests, 3)."""
        if self._near.linear and not any(p.nonlinear for p in candidate.parameters):
            steps = [
                (index, absent[s] - now) for s, now, index in zip(here.symbols, here.start, here.free, strict=True)
            ]
            return np.asarray(sum(self._columns[index] * step for index, step in steps))
        return self._near.difference(self.vehicle, self.vehicle.with_values(absent))

    def _shapes(
        self, candidate: Candidate, vehicle: Vehicle, absent: dict[str, float], near: tuple[float, ...] = ()
    ) -> tuple[Option, ...]:
        """One option for each starting value of the shape; about a value found so far, finer ones where needed.

        Those of an effect with amplitudes that stands do not take out what stands: they are first guesses, after which
        a search takes its columns anew.
        """
        (shape,) = candidate.effect.shapes
        grid = shape.grid
        if near and shape.stepped:
            now = near[candidate.symbols.index(shape.symbol)]
            grid = (*grid, *(now * factor for factor in _FINER if now * factor < shape.upper))
        found = []
        for value in grid:
            start = {**absent, shape.symbol: value}
            moved = vehicle.with_values(start)
            offset = -1
            if candidate.effect.fixed_amplitude:
                key = ("offset", shape.symbol, value, *_flow(shape, vehicle), *_dependencies(shape, vehicle))
                offset = self._add(self._near.memo.of(key, lambda m=moved: self._near.difference(vehicle, m)))
            found.append(self._present(candidate, moved, tuple(start[s] for s in candidate.symbols), offset))
        return tuple(found)

    def _present(self, candidate: Candidate, about: Vehicle, start: tuple[float, ...], offset: int) -> Option:
        """Free columns of a candidate about a vehicle in which it stands at `start`."""
        free, lower, upper = [], [], []
        amplitudes = [about.value(p.symbol) - p.null for p in candidate.parameters if not p.grid]
        for parameter, value in zip(candidate.parameters, start, strict=True):
            low, high = parameter.lower - value, parameter.upper - value
            if parameter.stepped or (parameter.grid and amplitudes and not any(amplitudes)):
                free.append(-1)
                low = high = 0.0
            else:
                key = ("slope", parameter.symbol, *_flow(parameter, about), *_dependencies(parameter, about))
                slope = self._near.memo.of(key, lambda p=parameter, v=value: self._slope(p, about, v))
                free.append(self._add(slope))
                if parameter.grid:
                    reach = 0.35 * value + 0.02
                    low, high = max(low, -reach), min(high, reach)
            lower.append(low)
            upper.append(high)
        if candidate.effect.general:
            faint = self._silenced(free)
            lower, upper = np.where(faint, 0.0, lower).tolist(), np.where(faint, 0.0, upper).tolist()
        limits = tuple(lower), tuple(upper)
        return Option(candidate.key, candidate.kind, True, candidate.symbols, start, tuple(free), offset, *limits)

    def _silenced(self, columns: Sequence[int]) -> np.ndarray:
        """Which columns are faint beside the strongest: commands that the log hardly holds say nothing of a curve.

        They are set to zero. What is left of a command that never came is rounding, and to scale it would be absurd.
        """
        size = np.array([np.sqrt((self._columns[k][0] ** 2).mean()) for k in columns])
        faint = size <= _FAINT * size.max()
        for k in np.asarray(columns)[faint]:
            self._columns[k] = np.zeros_like(self._columns[k])
        return faint

    def _slope(self, parameter: Parameter, about: Vehicle, value: float) -> Array:
        """Minus the derivative of the balance by one parameter: the force a unit of it adds, (1 + copies, tests, 3)."""
        if self._near.unit is not None and _is_linear(parameter):
            beside = (about.values["fouling_rate"], *_dependencies(parameter, about))
            return self._near.unit(about, parameter.symbol, beside)
        symbol, step = parameter.symbol, parameter.step * self._near.step_share
        up = about.with_values({symbol: value + step})
        if not parameter.nonlinear or value - step < parameter.lower:
            here = about if about.value(symbol) == value else about.with_values({symbol: value})
            return self._near.difference(here, up) / step
        return self._near.difference(about.with_values({symbol: value - step}), up) / (2.0 * step)


def _is_linear(parameter: Parameter) -> bool:
    """True when the force is a sum of which a parameter multiplies some summands, whatever the others are."""
    apart = parameter.section == "thrusters" or parameter.grid or parameter.symbol == "fouling_rate"
    return not (parameter.nonlinear or apart)


def _flow(parameter: Parameter, about: Vehicle) -> tuple[float, ...]:
    """What of the water, and of what grows on the hull, a parameter's column depends on."""
    p = about.values
    if parameter.symbol in GAINS:  # the bent curve is linear in its gains, and the advance loss apart from it
        return ()
    if parameter.section == "thrusters" and parameter.symbol != "advance_loss" and not p["advance_loss"]:
        return ()
    return tuple(p[symbol] for symbol in (*CURRENT, "fouling_rate"))


def _dependencies(parameter: Parameter, about: Vehicle) -> tuple[object, ...]:
    """What else it depends on, beside the data: the parameters that multiply it in the force."""
    p = about.values
    if parameter.symbol in (*CURRENT, "fouling_rate"):
        return tuple(p.items())
    if parameter.symbol in GAINS:
        apart = {*GAINS, "advance_loss"}
        return tuple((t.scale, *(p[key] for key in SHARED if key not in apart)) for t in about.thrusters)
    if parameter.section == "top":  # times each other in the mass matrix
        return p["mass"], p["x_g"], p["y_g"]
    if parameter.section == "thrusters":
        return tuple((t.scale, *(p[key] for key in SHARED)) for t in about.thrusters)
    if parameter.section == "memory":
        return p["memory_time"], *((p["memory_sway"], p["memory_yaw"]) if parameter.grid else ())
    return ()


def _near_by(vehicle: Vehicle) -> Vehicle:
    """The vehicle with what other columns depend on rounded: current, and what makes forces of commands.

    The vehicle itself, where thrusters differ by more than their scales: what all share is one value.
    """
    if len({tuple(getattr(thruster, key) for key in SHARED) for thruster in vehicle.thrusters}) > 1:
        return vehicle
    symbols = (
        *CURRENT[:2],
        *(key for key in SHARED if key != "thrust_rate"),
        *(f"{t.name}_scale" for t in vehicle.thrusters),
    )
    values = {symbol: vehicle.value(symbol) for symbol in symbols}
    return vehicle.with_values({symbol: _ROUGH * round(value / _ROUGH) for symbol, value in values.items()})


def _absent(candidate: Candidate, values: dict[str, float], offset: int = -1) -> Option:
    """The option in which a candidate is not in the model; `offset` is the column that takes a present one out."""
    return Option(candidate.key, candidate.kind, False, candidate.symbols, tuple(values.values()), (), offset, (), ())


FORCES = ("X", "Y", "N")
_OF_ROWS = ("time", "log", "part")
OTHER = "other"
"""What separates two vehicles and is no parameter of an effect: mass, places of thrusters, curves."""


def effects_between(before: Vehicle, after: Vehicle) -> list[str]:
    """Keys of the effects by which two vehicles differ: those of the catalogue in its order, then unnamed terms."""
    moved = {s for s in {**before.values, **after.values} if before.value(s) != after.value(s)}
    named = [c.key for c in candidates(before) if moved & set(c.symbols)]
    return named + sorted(s for s in moved if ":" in s)


def effect_forces(
    before: Vehicle, after: Vehicle, parts: Parts, keys: Sequence[str], rest: str = OTHER
) -> dict[str, SeriesTable]:
    """The force that each effect adds on the way from one vehicle to another, along all parts of the logs.

    The effects are put in one after the other, each with its values in `after`; the force of one is what the residual
    loses with it, M (measured - modelled) before less the same after it, both filtered like the log. For an effect in
    which the force is linear that is its column of the regression times its coefficient, whatever the order. The sum
    over all is the residual of `before` less that of `after`.

    Parameters
    ----------
    keys : of the effects, in the order in which they are put in, as `effects_between` names them
    rest : name of what separates the vehicles beside these, if anything does

    Returns
    -------
    dict
        By key: a table with the columns log, time [s], part, X, Y [N] and N [N m], in the order of `series.csv`.
    """
    symbols = {c.key: c.symbols for c in candidates(before)}
    stages = [before]
    for key in keys:
        stages.append(stages[-1].with_values({s: after.value(s) for s in symbols.get(key, (key,))}))
    names = list(keys)
    if not _alike(stages[-1], after):
        stages.append(after)
        names.append(rest)
    found: list[Columns] = []
    for stretch in stretches(parts):
        columns, left = stretch.columns, residual(stages[0], stretch.motion, stretch.data).force
        for name, vehicle in zip(names, stages[1:], strict=True):
            earlier, left = left, residual(vehicle, stretch.motion, stretch.data).force
            columns |= named([f"{name} {axis}" for axis in FORCES], -(left - earlier))
        found.append(columns)
    table = in_order(found)
    # What the rows have in common is in memory once.
    own = {name: {axis: table[f"{name} {axis}"] for axis in FORCES} for name in names}
    return {name: SeriesTable({**{c: table[c] for c in _OF_ROWS}, **own[name]}) for name in names}


def step_forces(
    nominal: Vehicle, corrected: Vehicle, parts: Parts, labels: Sequence[str | None]
) -> dict[str, SeriesTable]:
    """The forces of what a discovery added, in its order; `labels` are those of its steps.

    What else was moved was calibrated, and is one entry.

    Parameters
    ----------
    nominal, corrected : the models between which the effects lie
    parts : the prepared logs
    labels : of the discovery's steps; None and "calibrated" name no effect
    """
    keys = [label for label in labels if label not in (None, CALIBRATED)]
    return effect_forces(nominal, corrected, parts, keys, CALIBRATED)


def _alike(one: Vehicle, other: Vehicle) -> bool:
    """True when two vehicles have the same numbers, name and sources aside."""
    same = all(one.value(s) == other.value(s) for s in {**one.values, **other.values})
    return same and one.thrusters == other.thrusters
