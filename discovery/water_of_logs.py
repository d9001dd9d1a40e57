"""Water that moves otherwise in each of several logs: of two days on a river no vehicle file has both currents.

In a steady irrotational current V_c the equations of motion hold for nu_r = nu - R(psi)^T V_c (Fossen 2021, property
10.1), so a log in the frame of its water is one in still water, and needs no number in the model. Where logs ask for
currents of their own, each is taken into its own water before effects are searched for. A wind of each day has no such
frame; it is only told.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..measurements.compass import remeasured
from ..physics.motion import Array, Motion, earth_to_body
from ..physics.presentation import listing, number, short_names
from .balance.weak_form import WeakForm
from .basis import Basis
from .effect_findings import FittedTerm
from .evidence.weighing import CERTAINLY
from .search.floating import Search, State
from .search.rival_explanations import search_with_record_errors

Flow = tuple[str, float, float]
"""A log, and what its water or wind has that the model has not: to the north and to the east [m/s or N]."""

CURRENT, WIND = ("current_north", "current_east"), ("wind_force_north", "wind_force_east")
"""The numbers of a vehicle of which logs have their own."""
_USUAL = 0.2
"""A current that is nothing unusual [m/s], which regularises a fit; of a wind, the same share of the force of surge."""
_STEP = 0.1
"""Share of it by which a column is taken: the motion is all but linear in so little."""
_LEAST = 0.03
"""Difference of two currents that matters [m/s]: what `kinematics.LIMITS` has of a speed log's."""
_ROUNDS = 3
"""Estimates, each about the motion in the water of the one before."""
_SETTLED = 0.003
"""Change of all currents from which they stay [m/s]."""
_OF_WATER = frozenset({"steady_current", "turning_current", "mean_wind"})
"""Effects that are one current or wind for all logs."""
_RANK = 1e-6
"""Singular value of all columns together, over the largest, below which a direction is rounding."""
_TOLD = 6
"""Logs of which it is told."""


def in_water(motion: Motion, north: float, east: float) -> Motion:
    """A motion as it is seen from water that moves: places, velocities and the air over ground are relative to it.

    Parameters
    ----------
    motion : over ground
    north, east : velocity of the water [m/s]
    """

    def relative(heading: Array, velocity: Array) -> tuple[Array, Array]:
        ahead, aside = earth_to_body(heading, np.full_like(heading, north), np.full_like(heading, east))
        return heading, velocity - np.column_stack([ahead, aside, np.zeros_like(ahead)])

    seconds = 60.0 * motion.minutes
    return replace(remeasured(motion, relative), position=motion.position - np.outer(seconds, (north, east)))


def flow_of(motion: Motion, flows: Sequence[Flow]) -> tuple[float, float]:
    """What the water of a motion's log has beyond the model's, to the north and east [m/s]; none for another log."""
    return next(((north, east) for log, north, east in flows if log == motion.source), (0.0, 0.0))


def find_flows(basis: Basis) -> tuple[tuple[Flow, ...], tuple[Flow, ...]]:
    """Currents of each log, where the logs ask for different ones; else winds of each, where they ask for these.

    A force balance of all logs is fitted beside one current, and beside one of each log: what the latter earns must
    pay for its numbers and be beyond doubt. It is asked first with every column at once, which costs little.

    Parameters
    ----------
    basis : of all logs, as they came

    Returns
    -------
    (currents, winds)
        by log, beyond those of the model [m/s], [N]; none of one log, and where one flow does for all
    """
    forces = basis.forces
    logs = tuple(dict.fromkeys(motion.source for motion in forces.motions))
    if len(logs) < 2 or forces.claimed:
        return (), ()
    pool = [candidate for candidate in basis.force_search.pool if candidate.effect.name not in _OF_WATER]
    search = Search(forces, basis.nominal, pool, basis.force_search.settings)
    begin = search.evaluate(search.nominal, ())
    least = CERTAINLY + 2.0 * (len(logs) - 1) * search.settings.price
    kinds = [_currents(forces, search), _winds(forces, search)]
    asked = [_gain(search, begin, columns, logs) for columns in kinds]
    if max(asked) < least:
        return (), ()
    flows, gain, worth = _currents_of_logs(basis, search, begin, kinds[0], logs)
    wind, other, wind_worth = _fitted(search, begin, kinds[1], logs)
    if max(gain, other) < least:
        return (), ()
    if wind_worth < worth:
        scale = float(search.force_scale[0])
        winds = _flows(logs, wind * _USUAL * scale)
        return (), winds if _apart(winds) >= search.settings.materiality * scale else ()
    return (flows, ()) if _apart(flows) >= _LEAST else ((), ())


def _currents_of_logs(
    basis: Basis, search: Search, begin: State, columns: Array, logs: Sequence[str]
) -> tuple[tuple[Flow, ...], float, float]:
    """Currents of each log, what they earn more than one for all, and their worth, see `_fitted`.

    A column is straight and drag is not, so each estimate is about the motion in the water of the one before, as long
    as that is worth more.
    """
    rest, gain, worth = _fitted(search, begin, columns, logs)
    flows, pool = _flows(logs, rest * _USUAL), search.pool
    for _ in range(_ROUNDS - 1):
        own = _in_own_water(basis, flows)
        moved = Search(own, basis.nominal, pool, search.settings)
        rest, _, again = _fitted(moved, moved.evaluate(moved.nominal, ()), _currents(own, moved), logs)
        table = np.array([flow[1:] for flow in flows])
        total = table / _USUAL + rest
        again += 0.5 * float((total**2).sum() - (rest**2).sum())  # a usual current costs a half, wherever it is counted
        if again >= worth:
            break
        gain, worth, flows = gain + worth - again, again, _flows(logs, total * _USUAL)
        if np.abs(rest).max() * _USUAL < _SETTLED:
            break
    return flows, gain, worth


def sentence_of(flows: Sequence[Flow], what: str, unit: str, least: float = _LEAST) -> str:
    """The flows of logs in words, such as "The water moves at 0.20 m/s towards 14 degrees in a.csv".

    Parameters
    ----------
    what, unit : how it begins, and the unit of a flow
    least : of a flow that is told
    """
    told, names = [], short_names([log for log, *_ in flows])
    for (_, north, east), name in list(zip(flows, names, strict=True))[:_TOLD]:
        size = float(np.hypot(north, east))
        towards = f"{number(size, 2)} {unit} towards {round(np.degrees(np.arctan2(east, north))) % 360} degrees"
        told.append(f"{towards if size >= least else f'less than {least:.2g} {unit}'} in {name}")
    more = [f"otherwise in {len(flows) - _TOLD} logs more"] * (len(flows) > _TOLD)
    return f"{what} {listing([*told, *more])}"


def flow_terms(flows: Sequence[Flow], symbols: tuple[str, str], unit: str) -> tuple[FittedTerm, ...]:
    """The flows as numbers of findings, two a log, which stands as their form."""
    return tuple(
        FittedTerm(symbol=symbol, form=log, value=value, unit=unit)
        for log, *flow in flows
        for symbol, value in zip(symbols, flow, strict=True)
    )


def _flows(logs: Sequence[str], values: Array) -> tuple[Flow, ...]:
    return tuple((log, float(north), float(east)) for log, (north, east) in zip(logs, values, strict=True))


def _apart(flows: Sequence[Flow]) -> float:
    """How far the two flows are apart that differ most."""
    table = np.array([flow[1:] for flow in flows]).reshape(-1, 2)
    return float(np.linalg.norm(table[:, None] - table[None], axis=2).max()) if flows else 0.0


def _in_own_water(basis: Basis, flows: Sequence[Flow]) -> WeakForm:
    """The force balance of all logs, each in its own water."""
    return WeakForm([in_water(motion, *flow_of(motion, flows)) for motion in basis.forces.motions], basis.settings.weak)


def _currents(forces: WeakForm, search: Search) -> Array:
    """What a usual current to the north and to the east adds to the balance of all logs, (tests, 3, 2)."""
    balance, vehicle = forces, search.nominal
    rest, size = balance.residual(vehicle), _STEP * _USUAL
    moved = [[in_water(m, north, east) for m in balance.motions] for north, east in ((size, 0.0), (0.0, size))]
    return np.stack([(rest - balance.recorded(motions, vehicle)) / _STEP for motions in moved], axis=2)


def _winds(forces: WeakForm, search: Search) -> Array:
    """What a force to the north and to the east adds to the balance of all logs, (tests, 3, 2)."""
    headings = [motion.heading for motion in forces.motions]
    sides = ((np.cos, lambda psi: -np.sin(psi)), (np.sin, np.cos))
    series = [[np.column_stack([ahead(h), aside(h), 0.0 * h]) for h in headings] for ahead, aside in sides]
    return _USUAL * float(search.force_scale[0]) * np.stack([forces.average(s) for s in series], axis=2)


def _by_log(search: Search, columns: Array, logs: Sequence[str]) -> Array:
    """The columns of each log alone, (tests, 3, 2 logs)."""
    number = np.array([logs.index(motion.source) for motion in search.balance.motions])[search.balance.reach[0]]
    return np.concatenate([columns * (number == k)[:, None, None] for k in range(len(logs))], axis=2)


def _gain(search: Search, begin: State, columns: Array, logs: Sequence[str]) -> float:
    """What flows of each log earn more than one for all beside every force, free on each axis [log-likelihood]."""
    linear = search.about(begin)[0]
    inertia = {i for c in search.pool if c.effect.family == "mass" for o in linear.options[c.key] for i in o.free}
    free = [i for i in range(linear.columns.shape[2] - 1) if i not in inertia]
    gain = 0.0
    for axis, floor in enumerate(search.floor):
        forces, rest = linear.columns[:, axis, free], linear.columns[:, axis, -1]
        same, each = (np.column_stack([forces, c[:, axis]]) for c in (columns, _by_log(search, columns, logs)))
        one, other = (_left(table, rest) + floor for table in (same, each))
        gain += 0.5 * search.balance.independent * float(np.log(one / other))
    return gain


def _left(columns: Array, target: Array) -> float:
    """Mean square that columns (n, p) leave of a target (n,)."""
    size = np.linalg.norm(columns, axis=0)
    vectors, values, _ = np.linalg.svd(columns[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    known = vectors[:, values > _RANK * values[0]]
    return float(np.mean((target - known @ (known.T @ target)) ** 2))


def _fitted(search: Search, begin: State, columns: Array, logs: Sequence[str]) -> tuple[Array, float, float]:
    """Flows of each log (logs, 2) beside the effects that explain most, what they earn more than one, and the worth."""
    same = search_with_record_errors(search, columns, begin)
    each = search_with_record_errors(search, _by_log(search, columns, logs), begin)
    return each.errors.reshape(-1, 2), same.worth() - each.worth(), each.worth()
