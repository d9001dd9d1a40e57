"""The numbers of a vehicle: as a form has them, each with where it is from, and which are assumed."""

from collections.abc import Sequence

from ..physics.effects import EFFECTS
from ..physics.presentation import unit_text, words
from ..physics.sources import assumed, how_sure
from ..physics.vehicle import Vehicle, lacking
from ..workflows.first_vehicle import wires_of
from ..workflows.workbench_facts import Assumed, Field, Form, Place, Wire

_RIGID_BODY = (
    ("mass", "mass with payload", "kg"),
    ("inertia_z", "inertia about the body origin", unit_text("kg m^2")),
    ("x_g", "centre of gravity, ahead of the origin", "m"),
)
"""What a scale and a drawing tell: symbol, meaning, unit."""
_APART = ("mass", "inertia_z", "x_g", "y_g")
_ELSE = {
    "thrust_scale": "full thrust",
    "arm_scale": "places of the thrusters",
    "mass": "mass",
    "inertia_z": "inertia",
    "all": "what another boat's file has",
}
"""What is assumed beside numbers that stand in a section of the vehicle file."""
_ALWAYS = ("added_mass", "damping")
"""Sections of the vehicle file that are shown whole: what stands at zero there is what may be missing."""


def form_of(vehicle: Vehicle, wires: Sequence[Wire]) -> Form:
    """The numbers of a vehicle that are set or may be missing, and its thrusters with what drives them."""
    meant = {p.symbol: words(effect.name) for effect in reversed(EFFECTS) for p in effect.parameters}
    beyond = {s for effect in EFFECTS if lacking(vehicle, effect) for s in effect.symbols}
    fields = [Field(s, told, unit, vehicle.value(s), _source(vehicle, s)) for s, told, unit in _RIGID_BODY]
    for symbol, value in vehicle.values.items():
        if symbol in _APART or symbol in beyond:
            continue
        parameter = vehicle.parameter(symbol)
        if value != parameter.null or parameter.section in _ALWAYS:
            named = meant.get(symbol, words(symbol))
            fields.append(Field(symbol, named, unit_text(parameter.unit), value, _source(vehicle, symbol)))
    thrust = assumed(vehicle).get("thrust_scale")
    if thrust and not any(field.symbol == "thrust_scale" for field in fields):
        value = vehicle.value("thrust_scale")
        fields.insert(0, Field("thrust_scale", "times the thrust of all thrusters", "", value, thrust))
    places = tuple(Place(t.name, t.x, t.y, t.angle) for t in vehicle.thrusters)
    return Form(tuple(fields), places, wires_of(vehicle, wires))


def assumed_of(vehicle: Vehicle, *, placed: bool = False) -> tuple[Assumed, ...]:
    """What a vehicle has that nobody measured or gave, those of a section together.

    Parameters
    ----------
    placed : a person has said where the thrusters are
    """
    found: dict[str, Assumed] = {}
    for symbol, source in assumed(vehicle).items():
        if placed and symbol == "arm_scale":
            continue
        what = _ELSE.get(symbol) or words(_section(vehicle, symbol))
        found[what] = Assumed(what, (*(found[what].symbols if what in found else ()), symbol), how_sure(source))
    order = {what: k for k, what in enumerate(_ELSE.values())}
    return tuple(sorted(found.values(), key=lambda one: order.get(one.what, len(order))))


def _source(vehicle: Vehicle, symbol: str) -> str:
    """What the vehicle file says of where a number is from."""
    section = vehicle.sources.get(_section(vehicle, symbol))
    said = section.get(symbol) if isinstance(section, dict) else section
    return str(vehicle.sources.get(symbol) or said or vehicle.sources.get("all") or "")


def _section(vehicle: Vehicle, symbol: str) -> str:
    return symbol if symbol in _APART else vehicle.parameter(symbol).section
