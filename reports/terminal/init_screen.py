"""What `init` shows on the terminal: the thrusters that the log shows, the hull, and what a person is to look at."""

from collections.abc import Sequence

import numpy as np
from rich.console import RenderableType
from rich.table import Table

from ...measurements.canonical import unit_of
from ...measurements.thrusters_in_log import FoundThruster
from ...physics.in_words import number, unit_text
from ...physics.vehicle import Vehicle
from .layout import UNSURE, Prose, bullets, plain_table, section

_HULL = ("mass", "inertia_z", "X_udot", "Y_vdot", "N_rdot", "X_u", "Y_v", "N_r")
_UNITS = {"mass": "kg", "inertia_z": "kg m^2"}


def init_screen(vehicle: Vehicle, thrusters: Sequence[FoundThruster], doubts: Sequence[str]) -> list[RenderableType]:
    """Thrusters, numbers of the hull with their sources, and what nobody told and no log shows."""
    parts: list[RenderableType] = [_thrusters(vehicle, thrusters), _hull(vehicle)]
    return [*parts, section("To look at", bullets(doubts), style=f"bold {UNSURE}")] if doubts else parts


def _thrusters(vehicle: Vehicle, thrusters: Sequence[FoundThruster]) -> Table:
    table = plain_table("Thrusters")
    table.add_column("thruster", no_wrap=True)
    table.add_column("side", no_wrap=True)
    table.add_column("told by")
    for title in ("full astern", "neutral", "full ahead"):
        table.add_column(title, justify="right")
    table.add_column("unit", no_wrap=True)
    table.add_column("N ahead", justify="right")
    for one, built in zip(thrusters, vehicle.thrusters, strict=True):
        told = f"log; was {one.read_as}{', turned round' * one.turned}" if one.read_as != one.channel else "log"
        if one.turned and one.read_as == one.channel:
            told = "log; turned round"
        ends = (one.output.astern, one.output.neutral, one.output.ahead)
        full = built.curve.thrust(np.array([one.output.ahead]), built.command)
        table.add_row(
            one.name,
            one.side or "?",
            told if one.by_log else "name",
            *(number(end, 4) for end in ends),
            unit_text(unit_of(one.channel)),
            number(float(full[0])),
        )
    return table


def _hull(vehicle: Vehicle) -> Table:
    table = plain_table("Hull")
    table.add_column("", no_wrap=True)
    table.add_column("value", justify="right")
    table.add_column("unit", no_wrap=True)
    table.add_column("where it is from")
    for symbol in _HULL:
        unit = _UNITS.get(symbol) or vehicle.parameter(symbol).unit
        table.add_row(symbol, number(vehicle.value(symbol)), unit_text(unit), Prose(_source(vehicle, symbol)))
    return table


def _source(vehicle: Vehicle, symbol: str) -> str:
    for entry in (vehicle.sources, vehicle.sources.get("added_mass"), vehicle.sources.get("damping")):
        if isinstance(entry, dict) and symbol in entry:
            return str(entry[symbol])
    return str(vehicle.sources.get("all", ""))
