"""The verb `effects`: the catalogue, and one effect with what it looks like on a vehicle."""

import re
from typing import Annotated

import typer

from .console import failing_clearly, print_json, show
from .options import JsonOption


def effects(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="One effect; default: the list of all.")] = None,
    vehicle: Annotated[
        str, typer.Option("--vehicle", "-v", help="Vehicle whose typical amounts and manoeuvres are shown.")
    ] = "blueboat",
    as_json: JsonOption = False,
) -> None:
    """Show the catalogue of effects, or one: its force, unit, typical size, where it shows, what it is taken for."""
    with failing_clearly():
        from ..physics.vehicle import load_vehicle
        from ..workflows.effect_cards import effect_cards

        if name is None:
            if as_json:
                print_json(effect_cards())
                return
            from ..reports.terminal.effects_screen import catalogue_table

            show(catalogue_table())
            return
        from ..physics.worlds.signatures import signatures

        boat = load_vehicle(vehicle)
        (found,) = signatures(boat, (_effect_meant(name),))
        if as_json:
            print_json(effect_cards((found,), boat.name))
            return
        from ..reports.terminal.effects_screen import effect_card

        show(*effect_card(found, boat, vehicle))


def _effect_meant(name: str) -> str:
    """The effect that a name, one with blanks or a thruster, or a symbol stands for."""
    from ..physics.effects import EFFECTS

    plain = re.sub(r"\[.*\]$|\s*\(.*\)$", "", name.strip())
    owners = [effect.name for effect in EFFECTS if plain in effect.symbols]
    return owners[0] if owners else plain.replace(" ", "_").lower()
