"""Which effects may be followed while a boat runs: those in whose parameters the force is linear."""

from collections.abc import Sequence

from ...physics.effects import effect_named
from ...physics.errors import RequestError
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle, lacking
from ..candidates.candidate import Candidate, candidates, measurable
from ..candidates.nuisance import calibratable, nuisance_candidates

_DAMPING = "_damping"
"""How the names of the effects of damping on an axis end."""


def followed_by_default(vehicle: Vehicle) -> tuple[str, ...]:
    """The damping that stands in the vehicle, and the scale of each thruster."""
    found = []
    for candidate in candidates(vehicle):
        damping = candidate.effect.name.endswith(_DAMPING) and any(vehicle.value(s) for s in candidate.symbols)
        if damping or candidate.effect.name == "thruster_asymmetry":
            found.append(candidate.key)
    return tuple(found)


def followed(vehicle: Vehicle, names: Sequence[str], motions: Sequence[Motion] = ()) -> tuple[Candidate, ...]:
    """The candidates that names mean, every thruster's where none is chosen.

    Parameters
    ----------
    motions : that must have the channels that the effects need; none where that is not known yet

    Raises
    ------
    RequestError
        for an unknown effect, one that is not linear in its parameters, needs channels that the motions lack or for
        which the vehicle file states too little, none or one twice.
    """
    every = candidates(vehicle)
    found: list[Candidate] = []
    for name in names:
        effect = effect_named(name.split("[")[0])
        bent = [p.symbol for p in effect.parameters if p.nonlinear or p.grid]
        if bent:
            raise RequestError(
                f"adapt {name}: expected an effect whose force is linear in its parameters, but it is not in "
                f"{', '.join(bent)}; find its value with discover or add, and put it into the vehicle"
            )
        if lacks := lacking(vehicle, effect):
            raise RequestError(f"adapt: {name} {lacks}")
        if effect not in measurable(motions):
            raise RequestError(f"adapt {name}: expected the channels {' and '.join(effect.channels)} in every log")
        meant = [c for c in every if c.effect is effect and ("[" not in name or c.key == name)]
        if not meant:
            keys = ", ".join(c.key for c in every if c.effect is effect)
            raise RequestError(
                f"adapt {name}: {vehicle.name} has no such thruster; expected {keys or 'another effect'}"
            )
        found += meant
    if not found or len({c.key for c in found}) < len(found):
        raise RequestError(f"adapt: expected effects by name, each once, got {', '.join(names) or 'none'}")
    return tuple(found)


def held_beside(vehicle: Vehicle, symbols: Sequence[str]) -> tuple[Candidate, ...]:
    """Candidates for the numbers that stand in the vehicle, are not followed, and move the force in proportion."""
    held = [s for s in calibratable(vehicle) if s not in symbols]
    bent = [s for s in held if vehicle.parameter(s).nonlinear or vehicle.parameter(s).grid]
    return nuisance_candidates(vehicle, [s for s in held if s not in bent])
