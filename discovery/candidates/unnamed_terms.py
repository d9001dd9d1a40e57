"""Terms without a name: monomials of velocity, and free forms of motion, thrust, heading, time and place.

A sparse shortlist of monomials comes from forward orthogonal regression on the factors of the weak form (`factors`).
Free forms are not to be named: they test whether a named effect keeps its size when the model may bend otherwise, so
they need not be physics, only rich.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations, pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ...physics.effects import Effect, Form, Parameter, monomials, parse_form
from ...physics.forces import through_water
from ...physics.momentum_balance import HYDRODYNAMIC
from ...physics.motion import AXES, Array
from ...physics.presentation import short_names
from ...physics.vehicle import Vehicle
from ..balance.shooting import TRIFLE
from ..balance.weak_form import WeakForm
from ..factors import Column, Factors, forward, triangular
from .candidate import Candidate, Kind

_ALIAS = sqrt(1.0 - TRIFLE**2)
"""Correlation from which two monomials are one: what is left of one beside the other is a trifle of it."""
_TWIN = 0.9
"""Correlation from which monomials are tried beside another that was chosen: four fifths of their square are its."""


def _unit(form: Form) -> str:
    rates = sum(factor.strip("|") == "r" for factor in form.factors)
    powers = (("m/s", form.degree - rates), ("rad/s", rates))
    return " ".join(f"({unit})^{power}" if power > 1 else unit for unit, power in powers if power)


def _same(form: Form) -> tuple[tuple[int, ...], tuple[int, ...]]:
    power = tuple(sum(f.strip("|") == name for f in form.factors) for name in "uvr")
    sign = tuple(sum(f == name for f in form.factors) % 2 for name in "uvr")
    return power, sign


_NAMED_KEYS = {(axis, _same(form)) for _, axis, form in HYDRODYNAMIC}


def _turns_about(axis: int, form: Form) -> bool:
    """Whether the force turns about with the motion, as of a hull alike on both sides (Fossen 2021, section 6.3).

    Forces in sway and yaw turn with v and r; that in surge turns with u, as drag does astern.
    """
    _, (u, v, r) = _same(form)
    return (u % 2 == 1 and (v + r) % 2 == 0) if AXES[axis] == "surge" else (v + r) % 2 == 1


def _place(axis: int, forms: Sequence[Form], k: int) -> tuple[bool, bool, int, int]:
    """Sort key among forms that a log cannot tell apart: named, turning about with the motion, simple first."""
    return (axis, _same(forms[k])) not in _NAMED_KEYS, not _turns_about(axis, forms[k]), forms[k].degree, k


def term_candidate(symbol: str, vehicle: Vehicle) -> Candidate:
    """An unnamed term (`axis:form`) as a candidate like any effect of the catalogue."""
    axis, form = symbol.split(":", 1)
    parameter = vehicle.parameter(symbol)
    letter = "XYN"[AXES.index(axis)]
    effect = Effect(
        symbol,
        "unnamed",
        (Parameter(symbol, "coupling", parameter.unit, axis=parameter.axis, form=form),),
        f"{letter} += c {form}",
        f"A force in {axis} in proportion to {form}, which the catalogue does not name.",
    )
    return Candidate(symbol, effect, effect.parameters, Kind.TERM)


def shortlist(weak: WeakForm, vehicle: Vehicle, most: int = 8, degree: int = 3) -> tuple[str, ...]:
    """Unnamed terms that may explain the balance of a vehicle: at most `most` an axis, as `axis:form` symbols.

    Terms of the catalogue compete in the selection, so that an unnamed term enters only beside or before them, and
    columns that this log cannot tell apart (correlation above 0.9995) enter once: the named first, then those that turn
    about with the motion, since the others drive a boat that goes the other way, then the simplest.

    Parameters
    ----------
    weak : the log, as a force balance
    vehicle : the model whose balance is explained
    most : terms an axis
    degree : largest of a monomial
    """
    factors = term_factors(weak, vehicle, degree)
    forms = monomials(degree)
    columns = factors.whole[:, : len(forms)]
    found: list[str] = []
    for axis, name in enumerate(AXES):
        keep = _distinct(columns, sorted(range(len(forms)), key=partial(_place, axis, forms)))
        if not np.any(factors.whole[:, len(forms) + axis]):
            continue
        for k in forward(factors.only(keep), axis, most):
            if (axis, _same(forms[keep[k]])) not in _NAMED_KEYS:
                found.append(f"{name}:{forms[keep[k]].text}")
    return tuple(found)


def find_twins(
    weak: WeakForm, vehicle: Vehicle, terms: Sequence[Candidate], most: int = 3, degree: int = 3
) -> tuple[str, ...]:
    """Unnamed terms that move nearly as given ones do on this log: at most `most` each, the closest first.

    Their tested columns correlate by more than 0.9 in modulus. Terms of the catalogue are left out: they are tried
    anyway.

    Parameters
    ----------
    weak, vehicle, degree : as in `shortlist`
    terms : the given terms
    most : twins of each
    """
    given = [(p.axis, _same(parse_form(p.form))) for c in terms for p in c.parameters if p.axis is not None]
    if not given:
        return ()
    forms = monomials(degree)
    keys = [_same(form) for form in forms]
    features = term_factors(weak, vehicle, degree).whole[:, : len(forms)]
    norms = np.maximum(np.sqrt((features**2).sum(axis=0)), 1e-300)
    found: list[str] = []
    for axis, key in given:
        k = keys.index(key)
        alike = np.abs(features.T @ features[:, k]) / (norms * norms[k])
        near = [n for n in np.argsort(-alike, kind="stable") if n != k and alike[n] > _TWIN]
        found += [f"{AXES[axis]}:{forms[n].text}" for n in near if (axis, keys[n]) not in {*_NAMED_KEYS, *given}][:most]
    return tuple(dict.fromkeys(found))


def term_factors(weak: WeakForm, vehicle: Vehicle, degree: int, logs: Sequence[str] = ("",)) -> Factors:
    """Monomials of velocity and the balance of a vehicle on three axes, as factors of the blocks of a weak form.

    Parameters
    ----------
    logs : SHA-256 of the log that the weak form tests
    """
    forms, features = features_along(weak, vehicle, degree)
    rows = np.column_stack([features, weak.residual(vehicle)])
    edges = np.searchsorted(weak.block, np.arange(weak.blocks + 1))
    columns = tuple(Column(name=form.text, unit=_unit(form)) for form in forms)
    targets = tuple(Column(name=axis, unit=unit) for axis, unit in zip(AXES, weak.unit, strict=True))
    r = np.stack([triangular(rows[a:b]) for a, b in pairwise(edges)])
    settings = {
        "half_width": weak.settings.half_width,
        "stride": weak.settings.stride,
        "power": weak.settings.power,
        "degree": degree,
        "vehicle": vehicle.digest,
    }
    return Factors(columns, targets, r, np.diff(edges), np.zeros(weak.blocks, dtype=int), tuple(logs), settings)


def features_along(weak: WeakForm, vehicle: Vehicle, degree: int) -> tuple[tuple[Form, ...], Array]:
    """Monomials of the velocity through the water along the log, averaged by the test functions, (tests, forms).

    Parameters
    ----------
    weak : the log, whose test functions average
    vehicle : whose water the velocity is relative to
    degree : largest of a monomial
    """
    forms = monomials(degree)
    states = [through_water(vehicle, motion) for motion in weak.motions]
    return forms, weak.average([np.stack([form(*state) for form in forms], axis=-1) for state in states])


def _distinct(features: Array, order: Sequence[int]) -> list[int]:
    """Indices of columns, in order of preference, that are alive and not aliases of an earlier one."""
    norms = np.sqrt((features**2).sum(axis=0))
    keep: list[int] = []
    for k in order:
        if norms[k] <= 1e-9 * norms.max():
            continue
        if keep:
            kept = features[:, keep]
            if np.abs(kept.T @ features[:, k] / (norms[keep] * norms[k])).max() > _ALIAS:
                continue
        keep.append(k)
    return keep


_SPEEDS = (("u", "m/s"), ("v", "m/s"), ("r", "rad/s"))
_SPEED_KNOTS = (0.2, 0.35, 0.5, 0.65, 0.8, 0.92)
"""Shares of the log that are slower than a speed from which forces are tried that set in there."""
_THRUST_KNOTS = (0.5, 0.7, 0.85, 0.95)
"""The same of thrusts: beyond these sizes other laws are tried."""
_PLACES = (1 / 3, 2 / 3)
"""Shares of the log on one side of a line across the water: sides that are tried."""
_SETS_IN = 6
"""Parts of the log between which onsets are tried."""
FINE = 24
"""The same, and knots, that are tried where it is asked for one law whether a break does as well: ten seconds of a
usual log, and 0.06 m/s, between which no log tells them apart."""
_POWERS = (1.25, 1.5, 1.75, 2.25, 2.5)
"""Powers of a speed that are tried, between which laws of the catalogue lie: drag of skin friction grows with 1.8."""
_Form = tuple[str, Array]
"""What a form follows, its values along the rows, and the velocities that it takes."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeForms:
    """Columns of forces on any axis.

    Attributes
    ----------
    names : what each follows, as the end of "a force that follows"; nothing for a constant
    columns : (tests, forms)
    noise : (copies, tests, forms) what sensor noise adds to them
    """

    names: tuple[str, ...]
    columns: Array
    noise: Array


def free_forms(weak: WeakForm, vehicle: Vehicle) -> FreeForms:
    """Every form along the log that the weak form tests.

    Parameters
    ----------
    vehicle : says how the water moves, and the thrust
    """
    return _passed(weak, _along(weak, vehicle))


def finer_forms(weak: WeakForm, vehicle: Vehicle, law_of: str) -> FreeForms:
    """Free forms on a finer grid than `free_forms`: of onset speeds, powers of a speed, and onsets in time.

    A kink that lies between two knots is followed better by two smooth laws than by a kink at either.

    Parameters
    ----------
    law_of : the velocity, `u`, `v` or `r`; empty for what sets in
    """
    speeds, thrusts, _, minutes, _ = weak.signals(vehicle)
    if not law_of:
        return _passed(
            weak, _setting_in(_changing(vehicle, speeds, thrusts), onsets(minutes, *rows_of_logs(weak), FINE))
        )
    index = [name for name, _ in _SPEEDS].index(law_of)
    most = float(np.quantile(np.abs(np.atleast_2d(speeds[index])[0]), _SPEED_KNOTS[-1]))
    knots = [float(f"{knot:.3g}") for knot in np.linspace(0.0, most, FINE + 1)[1:]]
    return _passed(weak, (*_beyond(*_SPEEDS[index], speeds[index], knots), *_powers(law_of, speeds[index])))


def _passed(weak: WeakForm, forms: Iterable[_Form]) -> FreeForms:
    """Forms through the test functions."""
    tested = [(name, weak.passed(np.atleast_2d(rows))) for name, rows in forms]
    copies = max(column.shape[0] for _, column in tested)
    every = np.stack([np.broadcast_to(column, (copies, column.shape[1])) for _, column in tested], axis=-1)
    return FreeForms(tuple(name for name, _ in tested), every[0], every[1:] - every[0])


def _along(weak: WeakForm, vehicle: Vehicle) -> Iterator[_Form]:
    speeds, thrusts, heading, minutes, place = weak.signals(vehicle)
    steady, (logs, names) = np.ones_like(minutes), rows_of_logs(weak)
    yield "", steady
    yield "the cosine of the heading", np.cos(heading)
    yield "the sine of the heading", np.sin(heading)
    if len(names) == 1:  # each log has an origin of its own
        north, east = place - place.mean(axis=1, keepdims=True)
        yield "the place ahead", np.cos(heading) * north + np.sin(heading) * east
        yield "the place abeam", np.cos(heading) * east - np.sin(heading) * north
    for form in monomials(3):
        yield form.text, form(*speeds)
    for (name, unit), speed in zip(_SPEEDS, speeds, strict=True):
        yield from _beyond(name, unit, speed, _knots(speed, _SPEED_KNOTS))
    u, v, r = speeds
    beside = {"u": u, "|u|": np.abs(u), "v": v, "|v|": np.abs(v), "r": r, "|r|": np.abs(r)}
    pushes = _pushes(vehicle, thrusts)
    for of, thrust in pushes.items():
        yield of, thrust
        yield f"the size of {of}", np.abs(thrust)
        yield f"{of}, squared with its sign", thrust * np.abs(thrust)
        for knot in _knots(thrust, _THRUST_KNOTS):
            yield f"{of} beyond {knot:g} N", np.maximum(thrust - knot, 0.0)
            yield f"{of} below -{knot:g} N", np.maximum(-thrust - knot, 0.0)
    for of, thrust in pushes.items():
        for name, speed in beside.items():
            yield f"{of} times {name}", thrust * speed
    for name in ("v", "|v|", "r", "|r|") if len(thrusts) > 1 else ():  # at speed all thrust is as large as the drag
        yield f"all thrust times {name}", np.sum(thrusts, axis=0) * beside[name]
    yield from _lost_by_turns(vehicle, speeds, thrusts)
    for (of, thrust), (beside_it, other) in combinations(pushes.items(), 2):
        yield f"{of} times {beside_it}", thrust * other
        yield f"how unlike {of} and {beside_it} are", np.abs(thrust - other)
        yield f"how unlike {of} and {beside_it} are, squared", (thrust - other) ** 2
    changing = _changing(vehicle, speeds, thrusts)
    yield from _setting_in(changing, onsets(minutes, logs, names, _SETS_IN))
    for name, signal in changing.items():
        yield f"the time{name and f', times {name}'}", minutes * signal
        for told, there in places(place) if len(names) == 1 else ():
            yield f"{name or 'being'} {told}", there * signal


def _beyond(name: str, unit: str, speed: Array, knots: Iterable[float]) -> Iterator[_Form]:
    """What acts beyond speeds, to one side or to either."""
    for knot in knots:
        yield f"{name} beyond {knot:g} {unit}", np.maximum(speed - knot, 0.0)
        yield f"{name} below -{knot:g} {unit}", np.maximum(-speed - knot, 0.0)
        either = np.sign(speed) * np.maximum(np.abs(speed) - knot, 0.0)
        yield f"{name} beyond {knot:g} {unit} either way", either


def _powers(name: str, speed: Array) -> Iterator[_Form]:
    """What grows with a power of a speed that is no whole number."""
    for power in _POWERS:
        yield f"{name}|{name}|^{power - 1.0:g}", speed * np.abs(speed) ** (power - 1.0)


def _lost_by_turns(vehicle: Vehicle, speeds: Sequence[Array], thrusts: Sequence[Array]) -> Iterator[_Form]:
    """What propellers lose to the water that each meets, by their turns: K_T falls with J (Fossen 2021, eq. 9.7).

    The force ahead and the moment; that abeam, of thrusters that are turned, is none of them.
    """
    u, v, r = speeds
    ahead, turning = np.zeros_like(u), np.zeros_like(u)
    for unit, thrust in zip(vehicle.thrusters, thrusts, strict=True):
        along, aside, arm = unit.push
        lost = np.sqrt(np.abs(thrust)) * (along * u + aside * v + arm * r)
        ahead, turning = ahead + along * lost, turning + arm * lost
    yield "the turns of the propellers times what they meet", ahead
    yield "the turns of the propellers times what they meet, to one side more than to the other", turning


def _pushes(vehicle: Vehicle, thrusts: Sequence[Array]) -> dict[str, Array]:
    """The thrust of each unit, by name."""
    return {f"the thrust of {t.name}": thrust for t, thrust in zip(vehicle.thrusters, thrusts, strict=True)}


def _changing(vehicle: Vehicle, speeds: Sequence[Array], thrusts: Sequence[Array]) -> dict[str, Array]:
    """What may change while a log goes on, by name; nothing for what is constant."""
    u, v, r = speeds
    found = {"": np.ones_like(thrusts[0]), "u": u, "u|u|": u * np.abs(u), "v": v, "r": r}
    together = {"all thrust": np.sum(thrusts, axis=0)} if len(thrusts) > 1 else {}
    return found | _pushes(vehicle, thrusts) | together


def _setting_in(changing: Mapping[str, Array], times: Iterable[tuple[str, NDArray[np.bool_]]]) -> Iterator[_Form]:
    """Each of these from each time on."""
    begun = list(times)
    for name, signal in changing.items():
        for told, onset in begun:
            yield f"{name} {told}".strip(), onset * signal


def rows_of_logs(weak: WeakForm) -> tuple[NDArray[np.int64], list[str]]:
    """The number of the log of each row of all motions, and the names of the logs."""
    paths = list(dict.fromkeys(motion.source for motion in weak.motions))
    numbers = [paths.index(motion.source) for motion in weak.motions]
    return np.repeat(numbers, [motion.time.size for motion in weak.motions]), short_names(paths)


def onsets(
    minutes: Array, logs: NDArray[np.int64], names: Sequence[str], parts: int
) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Possible onsets in time, and the rows from there on: minutes, and where one of several logs begins.

    Parameters
    ----------
    minutes, logs : (n,) of rows in their order, and the number of the log of each
    names : of the logs
    parts : in how many parts the rows are cut
    """
    rows, several = np.arange(minutes.size), len(names) > 1
    begins = np.linspace(1, len(names) - 1, min(parts, len(names)) - 1).round().astype(int) if several else ()
    for number in begins:
        yield f"from log {names[number]} on", logs >= number
    for part in range(1, parts):
        first = minutes.size * part // parts
        where = f" of {names[logs[first]]}" * several
        yield f"from minute {float(minutes[first]):.1f}{where} on", rows >= first


def places(place: Array) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Sides of the water, and the rows there, of places (2, rows) of one log, for each has an origin of its own."""
    north, east = place
    sides = {
        "north": north,
        "east": east,
        "northeast": (north + east) / np.sqrt(2.0),
        "northwest": (north - east) / np.sqrt(2.0),
    }
    for side, metres in sides.items():
        for share in _PLACES:
            edge = float(f"{np.quantile(metres, share):.2g}")
            yield f"{side} of {edge:g} m", metres > edge


def _knots(signal: Array, shares: tuple[float, ...]) -> list[float]:
    """Sizes of a signal, the measured one, that it exceeds in parts of the log, as they are told."""
    sizes = np.quantile(np.abs(np.atleast_2d(signal)[0]), shares)
    return sorted({float(f"{size:.2g}") for size in sizes if size > 0.0})
