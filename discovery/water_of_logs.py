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
from ..measurements.kinematics import LIMITS
from ..physics.effects import PARAMETERS
from ..physics.motion import Array, Motion, earth_to_body
from ..physics.presentation import listing, number, short_names
from .balance.weak_form import WeakForm
from .basis import Basis
from .effect_findings import FittedTerm
from .evidence.unexplained import fit_all_forces
from .evidence.weighing import CERTAINLY
from .search.floating import Search
from .search.rival_explanations import search_with_record_errors

Flow = tuple[str, float, float]
"""A log, and what its water or wind has that the model has not: to the north and to the east [m/s or N]."""

CURRENT, WIND = ("current_north", "current_east"), ("wind_force_north", "wind_force_east")
"""The numbers of a vehicle of which logs have their own."""
_USUAL = 0.2
"""A current that is nothing unusual [m/s], which regularises a fit; of a wind, the same share of the force of surge.
Half and twice as much give the same currents to a millimetre a second (a test holds it)."""
LEAST = LIMITS["water_north"][0]
"""Difference of two currents that matters [m/s]: what does of a speed log's."""
_OF_WATER = frozenset({"steady_current", "turning_current", "mean_wind"})
"""Effects that are one current or wind for all logs."""


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
    least = CERTAINLY + 2.0 * (len(logs) - 1) * search.settings.price
    kinds = [_currents(forces, search), _winds(forces, search)]
    asked = [_gain(forces, search, columns, logs) for columns in kinds]
    if max(asked) < least:
        return (), ()
    flows, gain, worth = _currents_of_logs(basis, search, kinds[0], logs)
    wind, other, wind_worth = _fitted(forces, search, kinds[1], logs)
    if max(gain, other) < least:
        return (), ()
    if wind_worth < worth:
        scale = float(search.force_scale[0])
        material = search.settings.materiality * scale
        pushes = wind * _USUAL * scale
        pushes[np.linalg.norm(pushes, axis=1) < material] = 0.0
        winds = _flows(logs, pushes)
        return (), winds if _apart(winds) >= material else ()
    return (flows, ()) if _apart(flows) >= LEAST else ((), ())


def _currents_of_logs(
    basis: Basis, search: Search, columns: Array, logs: Sequence[str]
) -> tuple[tuple[Flow, ...], float, float]:
    """Currents of each log, what they earn more than one for all, and their worth, see `_fitted`.

    A column is straight and drag is not, so each estimate is about the motion in the water of the one before, as long
    as changes matter and grow less.
    """
    rest, gain, worth = _fitted(basis.forces, search, columns, logs)
    total, last = rest, np.inf
    while LEAST <= np.abs(rest).max() * _USUAL < last:
        last = np.abs(rest).max() * _USUAL
        flows = _flows(logs, total * _USUAL)
        motions = [in_water(motion, *flow_of(motion, flows)) for motion in basis.forces.motions]
        own = WeakForm(motions, basis.settings.weak)
        moved = Search(own, basis.nominal, search.pool, search.settings)
        rest, _, again = _fitted(own, moved, _currents(own, moved), logs)
        total = total + rest
        again += 0.5 * float((total**2).sum() - (rest**2).sum())  # a usual current costs a half, wherever it is counted
        gain, worth = max(gain, gain + worth - again), min(worth, again)
    return _flows(logs, total * _USUAL), gain, worth


def sentence_of(flows: Sequence[Flow], what: str, unit: str) -> str:
    """The flows of logs in words, such as "the water moves at 0.20 m/s towards 14 degrees in a.csv".

    Parameters
    ----------
    what, unit : how it begins, such as "the water moves at", and the unit of a flow; a current that does not matter,
        and a wind of nothing, is told as next to nothing
    """
    told, least = [], LEAST if unit == "m/s" else 0.0
    for (_, north, east), name in zip(flows, short_names([log for log, *_ in flows]), strict=True):
        size = float(np.hypot(north, east))
        towards = f"{number(size, 2)} {unit} towards {round(np.degrees(np.arctan2(east, north))) % 360} degrees"
        told.append(f"{towards if size > least else 'next to nothing'} in {name}")
    return f"{what} {listing(told)}"


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


def _currents(forces: WeakForm, search: Search) -> Array:
    """What a usual current to the north and to the east adds to the balance of all logs, (tests, 3, 2)."""
    vehicle, size = search.nominal, PARAMETERS[CURRENT[0]].step
    rest = forces.residual(vehicle)
    moved = [[in_water(m, north, east) for m in forces.motions] for north, east in ((size, 0.0), (0.0, size))]
    return np.stack([(rest - forces.recorded(motions, vehicle)) * (_USUAL / size) for motions in moved], axis=2)


def _winds(forces: WeakForm, search: Search) -> Array:
    """What a force to the north and to the east adds to the balance of all logs, (tests, 3, 2)."""
    headings = [motion.heading for motion in forces.motions]
    sides = ((np.cos, lambda psi: -np.sin(psi)), (np.sin, np.cos))
    series = [[np.column_stack([ahead(h), aside(h), 0.0 * h]) for h in headings] for ahead, aside in sides]
    return _USUAL * float(search.force_scale[0]) * np.stack([forces.average(s) for s in series], axis=2)


def _by_log(forces: WeakForm, columns: Array, logs: Sequence[str]) -> Array:
    """The columns of each log alone, (tests, 3, 2 logs)."""
    number = np.array([logs.index(motion.source) for motion in forces.motions])[forces.reach[0]]
    return np.concatenate([columns * (number == k)[:, None, None] for k in range(len(logs))], axis=2)


def _gain(forces: WeakForm, search: Search, columns: Array, logs: Sequence[str]) -> float:
    """What flows of each log earn more than one for all beside every force, free on each axis [log-likelihood]."""
    one, each = (fit_all_forces(forces, search, c).error ** 2 for c in (columns, _by_log(forces, columns, logs)))
    return 0.5 * forces.independent * float(np.log((one + search.floor) / (each + search.floor)).sum())


def _fitted(forces: WeakForm, search: Search, columns: Array, logs: Sequence[str]) -> tuple[Array, float, float]:
    """Flows of each log (logs, 2) beside the effects that explain most, what they earn more than one, and the worth."""
    begin = search.evaluate(search.nominal, ())
    same = search_with_record_errors(search, columns, begin)
    each = search_with_record_errors(search, _by_log(forces, columns, logs), begin)
    return each.errors.reshape(-1, 2), same.worth() - each.worth(), each.worth()
