"""The verb `effects` for machines: the catalogue as plain data."""

from collections.abc import Sequence

from ..physics.effects import EFFECTS, Effect
from ..physics.motion import FORCE_UNITS
from ..physics.reading import Plain
from ..physics.worlds.signatures import Signature

EFFECTS_SCHEMA = "undertow.effects/1"


def effect_cards(found: Sequence[Signature] = (), vehicle: str = "") -> Plain:
    """The catalogue, or some effects with their signatures on a vehicle, as `effects --json` prints it."""
    cards = [_card(effect) for effect in EFFECTS] if not found else [_card(s.effect) | _seen(s) for s in found]
    return {"schema": EFFECTS_SCHEMA, **({"vehicle": vehicle} if vehicle else {}), "effects": cards}


def _card(effect: Effect) -> Plain:
    return {
        "effect": effect.name,
        "family": effect.family,
        "equation": effect.equation,
        "meaning": effect.meaning,
        "reported": "added" if effect.added else "absolute",
        "parameters": [
            {
                "symbol": p.symbol,
                "unit": p.unit,
                "null": p.null,
                "section": p.section,
                "lower": p.lower if p.lower > -float("inf") else None,
                "upper": p.upper if p.upper < float("inf") else None,
            }
            for p in effect.parameters
        ],
        "needs": list(effect.channels),
        "requires": list(effect.requires),
        "includes": list(effect.includes),
    }


def _seen(found: Signature) -> Plain:
    return {
        "typical": found.amount,
        "shown_by": found.trial.text,
        "axis": found.axis_name,
        "size": found.size,
        "unit": FORCE_UNITS[found.axis],
        "apart": found.apart,
        "alike": [{"effect": name, "cosine": cosine} for name, cosine in found.alike],
    }
