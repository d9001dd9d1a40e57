"""A configuration block of MOOS-IvP's simulator uSimMarine: the map from thrust to speed, and what else it knows.

uSimMarine has the speed that belongs to a thrust of -100 to 100 %, interpolates between pairs, and limits how fast the
speed changes; drift is added to the motion over ground, x towards east and y towards north.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...physics.forces import calm, held_acceleration
from ...physics.vehicle import Vehicle
from ..approximation import Sides, missing_surroundings, sides_of
from ..known_facts import remarks
from ..program.vectors import commands_of
from .base import Export, Given

_PERCENT = (-100, -80, -60, -40, -20, 0, 20, 40, 60, 80, 100)
"""Thrusts of the map: between them speed is close to straight for drag of any power."""
_DRIFT = {"drift_x": "current_east", "drift_y": "current_north"}


def thrust_map(sides: Sides) -> list[tuple[int, float]]:
    """Thrust [%] and steady speed [m/s] in calm water, rising."""
    share = np.array(_PERCENT) / 100.0
    speed = sides.steady(share, share)[:, 0]
    kept: list[tuple[int, float]] = [(0, 0.0)]
    for side in (1, -1):
        last = 0.0
        for percent, value in sorted(zip(_PERCENT, speed.tolist(), strict=True), key=lambda pair: abs(pair[0])):
            if percent * side > 0 and value * side > last * side:
                kept.append((percent, round(value, 4)))
                last = value
    return sorted(kept)


def _ahead(vehicle: Vehicle, share: float, speed: float = 0.0) -> float:
    """Acceleration ahead in calm water [m/s^2], at a share of full thrust and a speed [m/s]."""
    vehicle = calm(vehicle)
    commands = commands_of(vehicle, np.full((1, len(vehicle.thrusters)), share))
    return float(held_acceleration(vehicle, np.array([[speed, 0.0, 0.0]]), np.zeros(1), commands)[0, 0])


def _accelerations(sides: Sides) -> tuple[float, float]:
    """At full thrust from rest, and without any at top speed [m/s^2]."""
    top = float(sides.steady(np.ones(1), np.ones(1))[0, 0])
    return _ahead(sides.vehicle, 1.0), -_ahead(sides.vehicle, 0.0, top)


def _left_out(given: Given) -> list[str]:
    sides = sides_of(given.vehicle, "moos")
    faster, slower = _accelerations(sides)
    mass = given.vehicle.mass - given.vehicle.value("X_udot")
    half = sides.steady(np.array([0.5]), np.array([0.5]))[0, 0]
    rest = _ahead(given.vehicle, 0.5)
    return [
        f"Acceleration is one number: at half thrust from rest the model has {mass * rest:.3g} N, uSimMarine has "
        f"{mass * faster:.3g} N until {half:.3g} m/s is reached, and {mass * slower:.3g} N where it slows down.",
        "Sway and drift in turns, lag and delay of thrust, and the moments that turn the boat are not known to "
        "uSimMarine; its turn_rate is for you to choose.",
        *missing_surroundings(given.vehicle, given.facts.envelope, tuple(_DRIFT.values())),
    ]


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    sides, vehicle = sides_of(given.vehicle, "moos"), given.vehicle
    faster, slower = _accelerations(sides)
    lines = [
        "ProcessConfig = uSimMarine",
        "{",
        f"  thrust_map = {', '.join(f'{percent}:{speed:g}' for percent, speed in thrust_map(sides))}",
        f"  max_acceleration = {faster:.6g}",
        f"  max_deceleration = {slower:.6g}",
        *(f"  {name} = {vehicle.value(symbol):.6g}" for name, symbol in _DRIFT.items() if vehicle.value(symbol)),
        "}\n",
    ]
    return {path: (remarks(given.facts.lines(), "// ") + "\n".join(lines)).encode()}


EXPORT = Export("MOOS-IvP block for uSimMarine with the thrust map", ".moos", _files, ("// ", ""), _left_out)
