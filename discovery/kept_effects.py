"""The result of a search, and the model of its kept effects: refitted, polished on rollouts, and built step by step."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from ..measurements.statistics.processors import parallel_map
from ..physics.effects import COMMAND_OFFSET
from ..physics.motion import Motion
from ..physics.plausibility import find_impossible
from ..physics.vehicle import Vehicle
from .balance.shooting import ShootingSettings
from .basis import Basis
from .calibration.before_calibration import FreeParameters
from .candidates.candidate import Candidate, Kind, at_limit
from .evidence.weighing import Evidence
from .findings import Findings
from .identifiability.rehearsal import Identifiability, Rehearsal
from .search.estimation import polish
from .search.floating import Search, State
from .search.record_errors_in_search import has_residual_structure


@dataclass(frozen=True, slots=True)
class SearchResult:
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
    unseen : candidates that what judges the log cannot tell from others
    notes : how the log was judged, and what was done to it, in words
    free : what is calibrated in every model, if anything
    subthreshold : effects that earn something beside the model, but less than tells an effect from nothing
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
    free: FreeParameters | None = None
    subthreshold: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ForceFit:
    """A model that a search of a force balance ended with.

    Attributes
    ----------
    basis : what it was judged on
    search, state : the search, and the model
    free : what is calibrated in every model, if anything
    rehearsal : of its candidates, where one was held
    rolling : the basis by which rollouts judge, where the model leaves more than white noise; None where it stands
    """

    basis: Basis
    search: Search
    state: State
    free: FreeParameters | None = None
    rehearsal: Rehearsal | None = None
    rolling: Basis | None = None

    @property
    def explains(self) -> bool:
        """True when it leaves no structure of the log."""
        return not has_residual_structure(self.search, self.state)

    @property
    def names(self) -> tuple[str, ...]:
        """Keys of the effects in it."""
        return self.search.named(self.state.active)


def without_effects(search: Search, state: State) -> Vehicle:
    """The model without any effect: the nominal one, calibrated where its parameters are free."""
    return search.restrict(state, ()).vehicle if search.nuisances else search.nominal


ENOUGH_BLOCKS = 5
"""Blocks of rollouts from which anything can be sure: fewer may all agree by chance in more than one of ten logs."""
TOO_SHORT = "Undecided: this log is too short to be sure of anything."
WHY_TOO_SHORT = (
    "Rollouts with commands fill {blocks} independent blocks of it, and to be sure of anything takes {enough}; give a "
    "longer log, or several together."
)


def too_short(findings: Findings, blocks: int) -> Findings:
    """Findings of rollouts that do not say that nothing is missing where a log has too few blocks to be sure of it."""
    if findings.verdict != "nothing missing" or blocks >= ENOUGH_BLOCKS:
        return findings
    why = WHY_TOO_SHORT.format(blocks=blocks, enough=ENOUGH_BLOCKS)
    return findings.but(verdict="undecided", headline=TOO_SHORT, reasons=(why,))


def refit_kept(search: Search, state: State, kept: Sequence[str], shooting: ShootingSettings) -> State:
    """The model with the kept effects alone, polished where rollouts judge.

    Parameters
    ----------
    search, state : the search and the model that it ended with
    kept : keys of the effects that stay
    shooting : of the rollouts on which they are polished
    """
    return polish_on_rollouts(search, search.restrict(state, kept), kept, shooting)


def add_subthreshold(search: Search, final: State, untold: Sequence[str], shooting: ShootingSettings) -> State:
    """The kept effects with those beside them that the log cannot tell from nothing, where its unseen parts gain by it.

    What is named needs certainty, what predicts only the better guess. Where nothing is kept nothing joins it, nor does
    what stands at a limit, or what makes a hull impossible.

    Parameters
    ----------
    search : of the log
    final : the model with the kept effects
    untold : keys of the effects that may join, in the order in which they are tried
    shooting : of the rollouts on which they are polished
    """
    if not search.named(final.active):
        return final
    best = final
    for key in (key for key in untold if key not in final.active):
        active = (*best.active, key)
        more = polish_on_rollouts(search, search.evaluate(best.vehicle, active), active, shooting)
        if more.score < best.score and _possible(search, best, more, key):
            best = more
    return best


def _possible(search: Search, before: State, after: State, key: str) -> bool:
    """True when an effect that joins a model is one that a hull can have."""
    (candidate,) = (c for c in search.pool if c.key == key)
    nominal, found = search.nominal, after.vehicle
    if at_limit(candidate, nominal, found):
        return False
    known, now = (find_impossible(vehicle.values, vehicle.thrusters) for vehicle in (before.vehicle, found))
    return set(now) <= set(known)


def polish_on_rollouts(search: Search, state: State, kept: Sequence[str], shooting: ShootingSettings) -> State:
    """A model polished on its rollouts, where that betters its score; the same on the force balance.

    Parameters
    ----------
    search, state : the search and the model to polish
    kept : keys of its effects
    shooting : of the rollouts
    """
    form = search.balance
    symbols = [s for c in search.pool if c.fitted(kept) for s in c.symbols]
    if not symbols or form.forces:
        return state
    limits = {p.symbol: (p.lower, p.upper) for c in search.pool for p in c.parameters}
    polished = polish(form.motions, state.vehicle, symbols, shooting, limits=limits).vehicle
    return min((state, search.evaluate(polished, kept)), key=lambda s: s.score)


def add_stepwise(
    search: Search, final: State, corrected: Vehicle, calibrated: str
) -> tuple[tuple[str | None, Vehicle], ...]:
    """Calibrate, where that is wanted, and add the kept effects one by one, the most valuable first, refitted.

    Parameters
    ----------
    final : the model with the kept effects
    corrected : the vehicle that is written, for the last step
    calibrated : name of the step that only calibrates
    """
    found: list[tuple[str | None, Vehicle]] = [(None, search.nominal)]
    effects: Sequence[str] = search.named(final.active)
    if search.of_kind(search.nuisances, Kind.NUISANCE):
        found.append((calibrated, without_effects(search, final) if effects else corrected))
    chosen: tuple[str, ...] = ()
    while len(chosen) < len(effects) - 1:
        rest = [key for key in effects if key not in chosen]
        more = partial(_add_one, search, final, chosen)
        # On the force balance a model is fitted before a process would be forked.
        trials = [more(key) for key in rest] if search.balance.forces else parallel_map(more, rest)
        best, key = min(zip(trials, rest, strict=True), key=lambda pair: pair[0].score)
        chosen = (*chosen, key)
        found.append((key, best.vehicle))
    found += [(key, corrected) for key in effects if key not in chosen]
    return tuple((label, without_offset(vehicle)) for label, vehicle in found)


def _add_one(search: Search, final: State, chosen: tuple[str, ...], key: str) -> State:
    return search.restrict(final, (*chosen, key))


def without_offset(vehicle: Vehicle) -> Vehicle:
    """A vehicle without what the record of the commands does wrong: the model's, not the log's."""
    return vehicle.with_values({COMMAND_OFFSET.symbol: 0.0})
