"""Forms that a force may have and no effect of the catalogue: of motion, thrust, heading, time and place, as columns.

What they are for is not to be named, but to find out whether what was named keeps its size beside them. So they need
not be physics, only rich: monomials of the velocities, what acts beyond a speed or a thrust, thrust that changes with
the motion, and anything that sets in during the log, or somewhere on the water.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array
from ...physics.terms import monomials
from ...physics.vehicle import Vehicle
from ..balance.base import SEEING
from ..balance.weak_form import WeakForm

_SPEEDS = (("u", "m/s"), ("v", "m/s"), ("r", "rad/s"))
_SPEED_KNOTS = (0.2, 0.35, 0.5, 0.65, 0.8, 0.92)
"""Shares of the log that are slower than a speed from which a force may set in."""
_THRUST_KNOTS = (0.5, 0.7, 0.85, 0.95)
_PLACES = (1 / 3, 2 / 3)
"""Shares of the log that are on one side of a line across the water."""
_SETS_IN = 6
"""Parts of the log between which something may set in."""
FINE = 24
"""The same, and knots, where it is asked for one law whether a break does as well: ten seconds of a usual log, and
0.06 m/s, between which no log tells them apart."""
_POWERS = (1.25, 1.5, 1.75, 2.25, 2.5)
"""Powers of a speed between which laws of the catalogue lie: drag of skin friction grows with 1.8, for one."""
_Form = tuple[str, Array, str]
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


def free_forms(weak: WeakForm, vehicle: Vehicle, blind: Sequence[bool] = SEEING) -> FreeForms:
    """Every form along the log that the weak form tests.

    Parameters
    ----------
    vehicle : says how the water moves, and the thrust
    blind : axes whose velocity is not to be trusted: no form takes it
    """
    return _passed(weak, _along(weak, vehicle), blind)


def finer_forms(weak: WeakForm, vehicle: Vehicle, law_of: str, blind: Sequence[bool] = SEEING) -> FreeForms:
    """What acts beyond many more speeds than `free_forms` has, or grows with powers of one, or sets in at more times.

    A kink that lies between two knots is followed better by two smooth laws than by a kink at either.

    Parameters
    ----------
    law_of : the velocity, `u`, `v` or `r`; empty for what sets in
    blind : see `free_forms`
    """
    speeds, thrusts, _, minutes, _ = weak.signals(vehicle)
    if not law_of:
        return _passed(weak, _setting_in(_changing(vehicle, speeds, thrusts), onsets(minutes, FINE)), blind)
    index = [name for name, _ in _SPEEDS].index(law_of)
    most = float(np.quantile(np.abs(np.atleast_2d(speeds[index])[0]), _SPEED_KNOTS[-1]))
    knots = [float(f"{knot:.3g}") for knot in np.linspace(0.0, most, FINE + 1)[1:]]
    return _passed(weak, (*_beyond(*_SPEEDS[index], speeds[index], knots), *_powers(law_of, speeds[index])), blind)


def _passed(weak: WeakForm, forms: Iterable[_Form], blind: Sequence[bool]) -> FreeForms:
    """Forms through the test functions, those that take no velocity which is not to be trusted."""
    unseen = {name for (name, _), hidden in zip(_SPEEDS, blind, strict=True) if hidden}
    seen = (form for form in forms if not unseen & set(form[2]))
    tested = [(name, weak.passed(np.atleast_2d(rows))) for name, rows, _ in seen]
    copies = max(column.shape[0] for _, column in tested)
    every = np.stack([np.broadcast_to(column, (copies, column.shape[1])) for _, column in tested], axis=-1)
    return FreeForms(tuple(name for name, _ in tested), every[0], every[1:] - every[0])


def _along(weak: WeakForm, vehicle: Vehicle) -> Iterator[_Form]:
    speeds, thrusts, heading, minutes, place = weak.signals(vehicle)
    steady = np.ones_like(minutes)
    yield "", steady, ""
    yield "the cosine of the heading", np.cos(heading), ""
    yield "the sine of the heading", np.sin(heading), ""
    if not several(minutes):  # each log has an origin of its own
        north, east = place - place.mean(axis=1, keepdims=True)
        yield "the place ahead", np.cos(heading) * north + np.sin(heading) * east, ""
        yield "the place abeam", np.cos(heading) * east - np.sin(heading) * north, ""
    for form in monomials(3):
        yield form.text, form(*speeds), form.text
    for (name, unit), speed in zip(_SPEEDS, speeds, strict=True):
        yield from _beyond(name, unit, speed, _knots(speed, _SPEED_KNOTS))
    u, v, r = speeds
    beside = {"u": u, "|u|": np.abs(u), "v": v, "|v|": np.abs(v), "r": r, "|r|": np.abs(r)}
    pushes = _pushes(vehicle, thrusts)
    for of, thrust in pushes.items():
        yield of, thrust, ""
        yield f"the size of {of}", np.abs(thrust), ""
        yield f"{of}, squared with its sign", thrust * np.abs(thrust), ""
        for knot in _knots(thrust, _THRUST_KNOTS):
            yield f"{of} beyond {knot:g} N", np.maximum(thrust - knot, 0.0), ""
            yield f"{of} below -{knot:g} N", np.maximum(-thrust - knot, 0.0), ""
    for of, thrust in pushes.items():
        for name, speed in beside.items():
            yield f"{of} times {name}", thrust * speed, name
    for name in ("v", "|v|", "r", "|r|") if len(thrusts) > 1 else ():  # at speed all thrust is as large as the drag
        yield f"all thrust times {name}", np.sum(thrusts, axis=0) * beside[name], name
    yield from _lost_by_turns(vehicle, speeds, thrusts)
    for (of, thrust), (beside_it, other) in combinations(pushes.items(), 2):
        yield f"{of} times {beside_it}", thrust * other, ""
        yield f"how unlike {of} and {beside_it} are", np.abs(thrust - other), ""
        yield f"how unlike {of} and {beside_it} are, squared", (thrust - other) ** 2, ""
    changing = _changing(vehicle, speeds, thrusts)
    yield from _setting_in(changing, onsets(minutes, _SETS_IN))
    for name, (signal, takes) in changing.items():
        yield f"the time{name and f', times {name}'}", minutes * signal, takes
        for told, there in places(minutes, place):
            yield f"{name or 'being'} {told}", there * signal, takes


def _beyond(name: str, unit: str, speed: Array, knots: Iterable[float]) -> Iterator[_Form]:
    """What acts beyond speeds, to one side or to either."""
    for knot in knots:
        yield f"{name} beyond {knot:g} {unit}", np.maximum(speed - knot, 0.0), name
        yield f"{name} below -{knot:g} {unit}", np.maximum(-speed - knot, 0.0), name
        either = np.sign(speed) * np.maximum(np.abs(speed) - knot, 0.0)
        yield f"{name} beyond {knot:g} {unit} either way", either, name


def _powers(name: str, speed: Array) -> Iterator[_Form]:
    """What grows with a power of a speed that is no whole number."""
    for power in _POWERS:
        yield f"{name}|{name}|^{power - 1.0:g}", speed * np.abs(speed) ** (power - 1.0), name


def _lost_by_turns(vehicle: Vehicle, speeds: Sequence[Array], thrusts: Sequence[Array]) -> Iterator[_Form]:
    """What propellers lose to the water that each meets, by their turns: K_T falls with J (Fossen 2021, eq. 9.7).

    The force ahead and the moment; that abeam, of thrusters that are turned, is none of them.
    """
    u, v, r = speeds
    takes = "uvr" if any(unit.push[1] for unit in vehicle.thrusters) else "ur"
    ahead, turning = np.zeros_like(u), np.zeros_like(u)
    for unit, thrust in zip(vehicle.thrusters, thrusts, strict=True):
        along, aside, arm = unit.push
        lost = np.sqrt(np.abs(thrust)) * (along * u + aside * v + arm * r)
        ahead, turning = ahead + along * lost, turning + arm * lost
    yield "the turns of the propellers times what they meet", ahead, takes
    yield "the turns of the propellers times what they meet, to one side more than to the other", turning, takes


def _pushes(vehicle: Vehicle, thrusts: Sequence[Array]) -> dict[str, Array]:
    """The thrust of each unit, by name."""
    return {f"the thrust of {t.name}": thrust for t, thrust in zip(vehicle.thrusters, thrusts, strict=True)}


def _changing(vehicle: Vehicle, speeds: Sequence[Array], thrusts: Sequence[Array]) -> dict[str, tuple[Array, str]]:
    """What may change while a log goes on, and the velocity that it takes, by name; nothing for what is constant."""
    u, v, r = speeds
    found: dict[str, tuple[Array, str]] = {"": (np.ones_like(thrusts[0]), ""), "u": (u, "u")}
    found |= {"u|u|": (u * np.abs(u), "u"), "v": (v, "v"), "r": (r, "r")}
    pushes = _pushes(vehicle, thrusts) | ({"all thrust": np.sum(thrusts, axis=0)} if len(thrusts) > 1 else {})
    return found | {of: (thrust, "") for of, thrust in pushes.items()}


def _setting_in(
    changing: Mapping[str, tuple[Array, str]], times: Iterable[tuple[str, NDArray[np.bool_]]]
) -> Iterator[_Form]:
    """Each of these from each time on."""
    begun = list(times)
    for name, (signal, takes) in changing.items():
        for told, onset in begun:
            yield f"{name} {told}".strip(), onset * signal, takes


def onsets(minutes: Array, parts: int) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """When something may set in, and the rows from there on: after so many minutes of one log, or parts of several."""
    rows = np.arange(minutes.size)
    in_logs = several(minutes)
    for part in range(1, parts):
        begun = rows >= minutes.size * part // parts
        told = f"part {part + 1} of {parts} of the logs" if in_logs else f"minute {float(minutes[begun][0]):.1f}"
        yield f"from {told} on", begun


def places(minutes: Array, place: Array) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Sides of the water, and the rows there, of places (2, rows); of one log, for each has an origin of its own."""
    if several(minutes):
        return
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


def several(minutes: Array) -> bool:
    """Whether there is more than one log: where another begins, its minutes do."""
    return bool((np.diff(minutes) < 0.0).any())


def _knots(signal: Array, shares: tuple[float, ...]) -> list[float]:
    """Sizes of a signal, the measured one, that it exceeds in parts of the log, as they are told."""
    sizes = np.quantile(np.abs(np.atleast_2d(signal)[0]), shares)
    return sorted({float(f"{size:.2g}") for size in sizes if size > 0.0})
