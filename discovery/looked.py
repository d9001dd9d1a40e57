"""What a search has looked at and seen, for the findings to be made of it: on the force balance, or on rollouts."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .evidence import Evidence
from .identifiability import Identifiability
from .options import Candidate
from .refit import Freed
from .rehearsal import Rehearsal
from .search import Search, State


@dataclass(frozen=True, slots=True)
class Looked:
    """A finished search, before the sure effects are kept.

    Attributes
    ----------
    motions : the motions that were looked at, without what sensors add to them
    search, state : the search, and the model that it ended with
    evidence : on every candidate
    known : what the log can show and tell apart
    plausible, rehearsal : amounts and trials for the advice
    forces : the same model on the force balance [N, N, N m], for the advice and the report
    unseen : candidates that the log cannot judge because an axis is blind
    notes : what was done to the log, in words
    free : what is calibrated in every model, if anything
    """

    motions: tuple[Motion, ...]
    search: Search
    state: State
    evidence: tuple[Evidence, ...]
    known: Identifiability
    plausible: dict[str, tuple[float, ...]]
    rehearsal: Rehearsal | None
    forces: tuple[Search, State]
    unseen: tuple[Candidate, ...] = ()
    notes: tuple[str, ...] = ()
    free: Freed | None = None


def base(search: Search, state: State) -> Vehicle:
    """The model without any effect: the nominal one, calibrated where its parameters are free."""
    return search.restrict(state, ()).vehicle if search.nuisances else search.nominal


def steps(search: Search, final: State, corrected: Vehicle, calibrated: str) -> tuple[tuple[str | None, Vehicle], ...]:
    """Calibrate, where that is wanted, and add the kept effects one by one, the most valuable first, refitted.

    Parameters
    ----------
    final : the model with the kept effects
    corrected : the vehicle that is written, for the last step
    calibrated : name of the step that only calibrates
    """
    found: list[tuple[str | None, Vehicle]] = [(None, search.nominal)]
    effects: Sequence[str] = search.named(final.active)
    if search.nuisances:
        found.append((calibrated, base(search, final) if effects else corrected))
    chosen: list[str] = []
    while len(chosen) < len(effects):
        rest = [key for key in effects if key not in chosen]
        trials = [(search.restrict(final, [*chosen, key]), key) for key in rest]
        best, key = min(trials, key=lambda pair: pair[0].score)
        chosen.append(key)
        found.append((key, corrected if len(chosen) == len(effects) else best.vehicle))
    return tuple(found)
