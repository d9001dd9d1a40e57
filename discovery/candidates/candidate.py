"""Candidates: the effects that may be missing from a vehicle, and which of them a log can judge."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from ...physics.effects import EFFECTS, Effect, Parameter
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle, lacking

_LIGHTEST = 0.2
"""Share of a vehicle's mass that is looked for at least: who is five times wrong has taken another unit."""
NEEDS_SWAY = ("X_udot", "Y_vdot", "x_g", "y_g", "mass")
"""What is told from a scale of thrust and drag by forces in sway, or of it, alone."""


class Kind(Enum):
    """What a candidate is: it decides its price, and where it is told."""

    EFFECT = "effect"
    """of the catalogue"""
    TERM = "term"
    """of the equation, which nobody has named"""
    NUISANCE = "nuisance"
    """a parameter of the nominal model that is calibrated while effects are judged: always in the model, free of price,
    never a finding"""
    SENSOR = "sensor"
    """an error of the log: in every model, free of price, and no property of the vehicle"""


@dataclass(frozen=True, slots=True)
class Candidate:
    """An effect, for one thruster where it concerns one, that may be missing from a vehicle.

    Attributes
    ----------
    key : unique name, `effect` or `effect[thruster]`
    effect : the catalogue's entry, or a made-up one for an unnamed term
    parameters : its parameters with the thruster's name filled in
    kind : see `Kind`
    part_of : keys of effects of which this is a special case: beside one of them it is left out
    """

    key: str
    effect: Effect
    parameters: tuple[Parameter, ...]
    kind: Kind = Kind.EFFECT
    part_of: tuple[str, ...] = ()

    @property
    def nuisance(self) -> bool:
        """Whether it is fitted in every model."""
        return self.kind in (Kind.NUISANCE, Kind.SENSOR)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Symbols of the parameters."""
        return tuple(p.symbol for p in self.parameters)

    def fitted(self, kept: Collection[str]) -> bool:
        """Whether it is in a model with the keys `kept`: as one of them, or as what is in every model."""
        return self.key in kept or (self.nuisance and not any(key in kept for key in self.part_of))


def measurable(motions: Sequence[Motion], effects: Sequence[Effect] = EFFECTS) -> tuple[Effect, ...]:
    """The effects whose channels are in all motions: without an anemometer, no apparent wind."""
    windless = any(motion.air is None for motion in motions)
    return tuple(effect for effect in effects if not (windless and effect.channels))


def candidates(vehicle: Vehicle, effects: Sequence[Effect] = EFFECTS) -> tuple[Candidate, ...]:
    """All candidates for a vehicle: one for each effect, one for each thruster where the effect concerns one.

    An effect that needs more than the vehicle file states is none: cross-flow drag without the size of the hull.
    """
    found = []
    for effect in effects:
        if lacking(vehicle, effect):
            continue
        if effect.per_thruster:
            for thruster in vehicle.thrusters:
                named = tuple(replace(p, symbol=p.symbol.format(thruster=thruster.name)) for p in effect.parameters)
                found.append(Candidate(f"{effect.name}[{thruster.name}]", effect, named))
        elif effect.name != "thrust_scale" or len(vehicle.thrusters) > 1:
            found.append(Candidate(effect.name, effect, tuple(_limited(p, vehicle) for p in effect.parameters)))
    return tuple(found)


def _limited(parameter: Parameter, vehicle: Vehicle) -> Parameter:
    """A parameter with limits that the vehicle sets."""
    return replace(parameter, lower=_LIGHTEST * vehicle.mass) if parameter.symbol == "mass" else parameter


def part_by_sight(pool: Sequence[Candidate], blind: Sequence[bool]) -> tuple[list[Candidate], list[Candidate]]:
    """Candidates that a log with blind axes can judge, and those that it cannot.

    An effect goes when it acts on a blind axis, or in proportion to the velocity along it; wake memory keeps its yaw.
    Added mass in surge goes too: but for Munk's moment and the Coriolis force, which need the sway velocity, it is a
    scale of thrust and drag.
    """
    if not any(blind):
        return list(pool), []
    seen, unseen = [], []
    for candidate in pool:
        kept = tuple(p for p in candidate.parameters if not _blinded(p))
        if len(kept) == len(candidate.parameters):
            seen.append(candidate)
        elif any(not p.grid for p in kept) and candidate.effect.family == "memory":
            seen.append(replace(candidate, effect=replace(candidate.effect, parameters=kept), parameters=kept))
        else:
            unseen.append(candidate)
    return seen, unseen


def _blinded(parameter: Parameter) -> bool:
    """True for a parameter that acts in sway, multiplies the sway velocity, or is told apart by such a force only."""
    if parameter.symbol in (*NEEDS_SWAY, "memory_sway", "cross_flow"):
        return True
    return parameter.axis == 1 or "v" in parameter.form
