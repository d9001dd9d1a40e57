"""The verb `effects`: the catalogue, and one effect with what it looks like on a vehicle."""

import re
from typing import TYPE_CHECKING

from ..physics.effects import EFFECTS, Effect
from .console import print_json, show
from .options import JSON, argument, option

if TYPE_CHECKING:
    from ..physics.reading import Plain
    from ..physics.worlds.signatures import Signature


def effects(
    name: str | None = argument("[NAME]", "One effect; default: the list of all.", None),
    vehicle: str = option("--vehicle -v", "Vehicle whose typical amounts and manoeuvres are shown.", "blueboat"),
    as_json: bool = JSON,
) -> None:
    """Show the catalogue of effects, or one: its force, unit, typical size, where it shows, what it is taken for."""
    from ..physics.vehicle import load_vehicle

    if name is None:
        if as_json:
            print_json({"schema": EFFECTS_SCHEMA, "effects": [_card(effect) for effect in EFFECTS]})
            return
        from ..reports.terminal.laws_and_effects_screen import catalogue_table

        show(catalogue_table())
        return
    from ..physics.worlds.signatures import signatures

    boat = load_vehicle(vehicle)
    (found,) = signatures(boat, (_effect_meant(name),))
    if as_json:
        card = _card(found.effect) | _seen(found)
        called = {"vehicle": boat.name} if boat.name else {}
        print_json({"schema": EFFECTS_SCHEMA, **called, "effects": [card]})
        return
    from ..reports.terminal.laws_and_effects_screen import effect_card

    show(*effect_card(found, boat, vehicle))


def _effect_meant(name: str) -> str:
    """The effect that a name, one with blanks or a thruster, or a symbol stands for."""
    plain = re.sub(r"\[.*\]$|\s*\(.*\)$", "", name.strip())
    owners = [effect.name for effect in EFFECTS if plain in effect.symbols]
    return owners[0] if owners else plain.replace(" ", "_").lower()


EFFECTS_SCHEMA = "undertow.effects/1"
_OF_PARAMETER = ("symbol", "unit", "null", "section", "lower", "upper")
"""What is told of each parameter of an effect; a bound that is infinite is null in JSON."""


def _card(effect: Effect) -> "Plain":
    return {
        "effect": effect.name,
        "family": effect.family,
        "equation": effect.equation,
        "meaning": effect.meaning,
        "reported": "added" if effect.added else "absolute",
        "parameters": [{name: getattr(p, name) for name in _OF_PARAMETER} for p in effect.parameters],
        "needs": list(effect.channels),
        "requires": list(effect.requires),
        "includes": list(effect.includes),
    }


def _seen(found: "Signature") -> "Plain":
    from ..physics.motion import FORCE_UNITS

    return {
        "typical": found.amount,
        "shown_by": found.trial.text,
        "axis": found.axis_name,
        "size": found.size,
        "unit": FORCE_UNITS[found.axis],
        "apart": found.apart,
        "alike": [{"effect": name, "cosine": cosine} for name, cosine in found.alike],
    }
