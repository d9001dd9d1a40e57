"""The force of each effect along a log: what the force balance changes by when that effect is put into the vehicle."""

from collections.abc import Sequence

from ...measurements.prepared_logs import Parts
from ...physics.vehicle import Vehicle
from ...residuals.scores import residual
from ...residuals.series import Columns, SeriesTable, in_order, named, stretches
from .candidate import candidates
from .nuisance import CALIBRATED

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


def found_forces(
    nominal: Vehicle, corrected: Vehicle, parts: Parts, labels: Sequence[str | None]
) -> dict[str, SeriesTable]:
    """The forces of what a discovery added, in its order; `labels` are those of its steps.

    What else was moved was calibrated, and is one entry.
    """
    keys = [label for label in labels if label not in (None, CALIBRATED)]
    return effect_forces(nominal, corrected, parts, keys, CALIBRATED)


def _alike(one: Vehicle, other: Vehicle) -> bool:
    """Whether two vehicles have the same numbers, name and sources aside."""
    same = all(one.value(s) == other.value(s) for s in {**one.values, **other.values})
    return same and one.thrusters == other.thrusters
