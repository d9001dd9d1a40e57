"""What a search ends with, before the sure effects are kept."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .basis import Basis
from .calibration.beside_effects import Freed
from .candidates.candidate import Candidate
from .evidence.weighing import Evidence
from .identifiability.rehearsal import Rehearsal
from .identifiability.visible import Identifiability
from .search.command_resolution import leaves_structure
from .search.floating import Search, State


@dataclass(frozen=True, slots=True)
class Selected:
    """A finished selection, before the sure effects are kept.

    Attributes
    ----------
    basis : what it was judged on
    motions : the motions that were looked at, without what sensors add to them
    search, state : the search, and the model that it ended with
    evidence : on every candidate
    known : what the log can show and tell apart
    plausible, rehearsal : amounts and trials for the advice
    forces : the same model on the force balance [N, N, N m], for the advice and the report
    unseen : candidates that the log cannot judge because an axis is blind
    notes : how the log was judged, and what was done to it, in words
    free : what is calibrated in every model, if anything
    untold : effects that earn something beside the model, but less than tells an effect from nothing
    """

    basis: Basis
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
    untold: tuple[str, ...] = ()


@dataclass(frozen=True)
class Found:
    """A model that a search of a force balance ended with, what judges it, and what is calibrated in every model.

    `rehearsal` is that of its candidates, where one was held.
    """

    basis: Basis
    search: Search
    state: State
    free: Freed | None = None
    rehearsal: Rehearsal | None = None

    @cached_property
    def explains(self) -> bool:
        """Whether it leaves no structure of the log."""
        return not leaves_structure(self.search, self.state)


class Unsettled(NamedTuple):
    """The best model of a force balance that leaves more than white noise of it; `rolling` is how rollouts judge."""

    rolling: Basis
    search: Search
    state: State


def base(search: Search, state: State) -> Vehicle:
    """The model without any effect: the nominal one, calibrated where its parameters are free."""
    return search.restrict(state, ()).vehicle if search.nuisances else search.nominal
