"""Forms that a force may have and no effect of the catalogue: of motion, thrust, heading and time, as columns.

What they are for is not to be named, but to find out whether what was named keeps its size beside them. So they need
not be physics, only rich: monomials of the velocities, what acts beyond a speed or a thrust, thrust that changes with
the motion, and anything that sets in during the log.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...physics.frames import Array
from ...physics.terms import monomials
from ...physics.vehicle import Vehicle
from ..balance.weak_form import WeakForm

_SPEEDS = (("u", "m/s"), ("v", "m/s"), ("r", "rad/s"))
_SPEED_KNOTS = (0.2, 0.35, 0.5, 0.65, 0.8, 0.92)
"""Shares of the log that are slower than a speed from which a force may set in."""
_THRUST_KNOTS = (0.5, 0.7, 0.85, 0.95)
_SETS_IN = 6
"""Parts of the log between which something may set in."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeForms:
    """Columns of forces on any axis.

    Attributes
    ----------
    names : what each follows, as the end of "a force that follows"
    columns : (tests, forms)
    noise : (copies, tests, forms) what sensor noise adds to them
    """

    names: tuple[str, ...]
    columns: Array
    noise: Array


def free_forms(weak: WeakForm, vehicle: Vehicle) -> FreeForms:
    """Every form along the log that the weak form tests; `vehicle` says how the water moves, and the thrust."""
    names, columns = zip(*_tested(weak, vehicle), strict=True)
    copies = max(column.shape[0] for column in columns)
    every = np.stack([np.broadcast_to(column, (copies, column.shape[1])) for column in columns], axis=-1)
    return FreeForms(names, every[0], every[1:] - every[0])


def _tested(weak: WeakForm, vehicle: Vehicle) -> Iterator[tuple[str, Array]]:
    """Each form and its column, (1 or 1 + copies, tests), one after the other: the rows of a log are many."""
    return ((name, weak.passed(np.atleast_2d(rows))) for name, rows in _along(weak, vehicle))


def _along(weak: WeakForm, vehicle: Vehicle) -> Iterator[tuple[str, Array]]:
    speeds, thrusts, heading, minutes = weak.signals(vehicle)
    steady = np.ones_like(minutes)
    yield "nothing that moves", steady
    yield "the cosine of the heading", np.cos(heading)
    yield "the sine of the heading", np.sin(heading)
    for form in monomials(3):
        yield form.text, form(*speeds)
    for (name, unit), speed in zip(_SPEEDS, speeds, strict=True):
        for knot in _knots(speed, _SPEED_KNOTS):
            yield f"{name} beyond {knot:g} {unit}", np.maximum(speed - knot, 0.0)
            yield f"-{name} beyond {knot:g} {unit}", np.maximum(-speed - knot, 0.0)
            yield f"{name} beyond {knot:g} {unit} either way", np.sign(speed) * np.maximum(np.abs(speed) - knot, 0.0)
    u, v, r = speeds
    beside = {"u": u, "|u|": np.abs(u), "v": v, "|v|": np.abs(v), "r": r, "|r|": np.abs(r)}
    for thruster, thrust in zip(vehicle.thrusters, thrusts, strict=True):
        of = f"the thrust of {thruster.name}"
        yield of, thrust
        yield f"the size of {of[4:]}", np.abs(thrust)
        yield f"{of}, squared with its sign", thrust * np.abs(thrust)
        for name, speed in beside.items():
            yield f"{of} times {name}", thrust * speed
        for knot in _knots(thrust, _THRUST_KNOTS):
            yield f"{of} beyond {knot:g} N", np.maximum(thrust - knot, 0.0)
            yield f"{of} beyond {-knot:g} N", np.maximum(-thrust - knot, 0.0)
    onsets = [np.arange(minutes.size) >= minutes.size * part // _SETS_IN for part in range(1, _SETS_IN)]
    changing = {"": steady, "u": u, "u|u|": u * np.abs(u), "v": v, "r": r}
    changing |= {f"the thrust of {t.name}": thrust for t, thrust in zip(vehicle.thrusters, thrusts, strict=True)}
    changing |= {"all thrust": np.sum(thrusts, axis=0)} if len(thrusts) > 1 else {}
    for name, signal in changing.items():
        yield f"the time{name and f', times {name}'}", minutes * signal
        for onset in onsets:
            begun = float(minutes[onset][0])
            yield f"{name or 'nothing that moves'} from minute {begun:.2g} on", onset * signal


def _knots(signal: Array, shares: tuple[float, ...]) -> list[float]:
    """Sizes of a signal, the measured one, that it exceeds in parts of the log, as they are told."""
    sizes = np.quantile(np.abs(np.atleast_2d(signal)[0]), shares)
    return sorted({float(f"{size:.2g}") for size in sizes if size > 0.0})
