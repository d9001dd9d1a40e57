"""Effects chosen by a person: fitted in the given order under the laws of a hull, and judged like those of a search.

`add_effects` is the verb `add`. `Bench` serves the workbench: a fit starts from the nearest earlier one, and none is
made twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..measurements.preparation.split import Fold, folds_of
from ..measurements.statistics.processors import single_threaded
from ..physics.motion import Motion
from ..physics.presentation import listing, words
from ..physics.vehicle import Vehicle
from .balance.shooting import rollouts_contradict
from .basis import Basis, DiscoverySettings
from .calibration.before_calibration import with_calibration
from .candidates.candidate import CALIBRATED, Candidate, remaining_candidates
from .claims import Tests, gather_claims, widen_intervals
from .discover import Discovery
from .effect_findings import Folds
from .evidence.omitted_variables import file_errors
from .evidence.record_errors import out_of_step, record_errors, sensor_findings, shares_of_sensor_errors
from .evidence.unmodelled_forces import rollouts_of_several_logs
from .evidence.weighing import assess_candidates, limit_confidence
from .findings import Findings
from .lawful.refit import Passivity
from .search.estimation import Interval
from .search.floating import Search
from .search.rival_explanations import all_thrusters
from .selection import disagreements, limit_surge_added_mass
from .sequential_fit import Fitted, Ordered, basis_for, fit_named, own_numbers
from .verdicts import VerdictInputs, conclude

_FOUND = {
    "possible": "the search of this log calls it no more than possible",
    "no evidence": "the search of this log found no evidence for it",
}
"""What a search said of an effect that is added all the same, by its verdict."""
_COULD_NOT = "the search of this log could not judge it"
_KEPT = "the nominal model's own parameters stay as its file has them: none is calibrated beside the effects"


@single_threaded
def add_effects(
    motions: Sequence[Motion],
    nominal: Vehicle,
    names: Sequence[str],
    settings: DiscoverySettings,
    basis: Basis | None = None,
    searched: Findings | None = None,
) -> Discovery:
    """Add effects in the order given, all fitted together under their physical limits and the law of dissipation.

    Where the force balance errs by more than white noise, they are fitted to open-loop rollouts, as in discovery. The
    nominal model's own parameters stay as they are, or are fitted beside them with `settings.refit`. What a search of
    these motions put into its model has the numbers of that search; all of it is that model.

    Parameters
    ----------
    names : effects of the catalogue, `effect[thruster]` to choose a thruster, or unnamed terms `axis:form`
    basis : what judges these motions of this model under these settings, where it was chosen before
    searched : what a search of these motions found, where there was one: what it doubts is not called missing

    Raises
    ------
    RequestError
        for an unknown effect or thruster, an effect given twice, one whose channels a log lacks, one that a field log
        cannot show because its compass is not trusted, or none at all.
    """
    basis = basis or basis_for(motions, nominal, settings, searched)
    free = own_numbers(basis) if basis.settings.refit else None
    fitted = fit_named(basis, names, free, searched=searched)
    search, state, lawful = fitted.search, fitted.state, fitted.lawful
    form, corrected, notes = search.balance, lawful.vehicle, basis.remarks
    if free is None:
        notes = (*notes, _KEPT)
    error, noise = np.sqrt(state.fit.held_out), search.noise_error
    if basis.uses_rollouts:
        weak = basis.cleared_forces()
        error = np.sqrt((weak.residual(corrected) ** 2).mean(axis=0))
        noise = Search(weak, nominal, (), settings.search).noise_error
    if searched is not None and fitted.whole:
        unsure = [c.key for c in searched.added if c.verdict != "missing"]
        findings = searched.but(candidates=searched.added, headline=_headline(fitted, unsure), advice=())
        return Discovery(nominal, corrected, fitted.steps, findings, error, noise, basis, fitted.unseen(), notes)
    every = _with_rivals(basis, fitted, basis.pool if free is None else free.pool)
    among = every.evaluate(state.vehicle, state.active)
    evidence = assess_candidates(every, among, settings.seed)
    if basis.uses_rollouts:
        evidence = limit_confidence(evidence, form)
        notes = (*notes, *disagreements(form, nominal, corrected))
        if rollouts_contradict(form.squares(nominal), form.squares(corrected), form.overlap):
            notes = (*notes, "open-loop rollouts get worse with these effects than they are without any")
    linear, scores, _ = every.about(among)
    filed = file_errors(every, among, (linear, scores))
    told = widen_intervals(fitted.intervals, search.pool, nominal, Tests(), (), filed=filed)
    order = [str(label) for label, _ in fitted.steps[1:]]
    added = [e for e in evidence if e.selected]
    kept = [e.key for e in added]
    sensors = sensor_findings(basis.forces.motions, basis.uses_rollouts)
    timing = record_errors(search, state.vehicle, state.active, told)
    tests = Tests(
        out_of_step=out_of_step(basis.forces.motions, (*sensors, *timing)),
        accused=shares_of_sensor_errors(added, search.pool, sensors),
        rolls=basis.uses_rollouts,
        several=rollouts_of_several_logs(form),
    )
    claimed = gather_claims(added, search.pool, nominal, told, tests, kept, fitted.intervals)
    before = [one for one in searched.candidates if one.key in kept] if searched else []
    asked = {e.key: _COULD_NOT if e.cannot_tell else _FOUND[e.verdict] for e in before if e.verdict in _FOUND}
    sure = {e.key: e.confidence for e in before if e.verdict not in _FOUND}  # adding them again makes none surer
    grounds = VerdictInputs(
        search, lawful, corrected, added, told, kept, order, claimed, tests, added_by_name=asked, sure=sure
    )
    findings = conclude(grounds)
    unsure = [c.key for c in findings.candidates if c.verdict != "missing"]
    sensors += timing
    unseen = fitted.unseen()
    if free is not None:
        findings = with_calibration(findings, free, nominal, lawful, told)
    thrust = all_thrusters(nominal, corrected, kept)
    findings = findings.but(
        folds=Folds(count=len(unseen.folds)),
        headline=_headline(fitted, unsure),
        reasons=(thrust,) if thrust else (),
        sensors=sensors,
    )
    return Discovery(nominal, corrected, fitted.steps, findings, error, noise, basis, unseen, notes)


def _with_rivals(basis: Basis, fitted: Fitted, pool: Sequence[Candidate]) -> Search:
    """The search of what was added, with every effect of a pool that may do as well in its place."""
    search = fitted.search
    freed = [symbol for candidate in search.pool if candidate.nuisance for symbol in candidate.symbols]
    known = {candidate.key for candidate in search.pool}
    pool = limit_surge_added_mass(pool, basis.nominal) if basis.uses_rollouts else pool
    others = [c for c in remaining_candidates(pool, freed) if c.key not in known and basis.judges(c)]
    return Search(search.balance, search.nominal, (*search.pool, *others), search.settings)


def _headline(fitted: Fitted, unsure: Sequence[str]) -> str:
    """What was added, how it was fitted, and what of it is not certain."""
    named = listing([words(name) for name in fitted.names])
    by = ", fitted to open-loop rollouts" if fitted.basis.uses_rollouts else ""
    beside = ", beside the model's own numbers" if any(label == CALIBRATED for label, _ in fitted.steps) else ""
    sure = f"; not certain: {listing([words(key) for key in unsure])}" if unsure else ""
    return f"Added by name: {named}{by}{beside}{sure}."


@dataclass(frozen=True, slots=True, eq=False)
class ManualModel:
    """A model with effects that somebody chose.

    Attributes
    ----------
    names : of the effects, in the order in which they were added
    vehicle : the model under the laws
    without_folds : the folds of the log, each with the model that was fitted without it
    ci95 : 95 % intervals of the fitted numbers, by symbol
    passivity : how the law stands in the model; None for a model to which nothing was added
    """

    names: tuple[str, ...]
    vehicle: Vehicle
    without_folds: tuple[tuple[Fold, Vehicle], ...]
    ci95: dict[str, Interval]
    passivity: Passivity | None = None


class Bench:
    """A log and a nominal model, to which effects are added and from which they are taken again.

    Parameters
    ----------
    basis : what judges the log, see `choose`
    own : the numbers that the vehicle file has are fitted beside the effects, as far as the log identifies them
    searched : findings of a search of this log: what its model has is added with its numbers
    """

    def __init__(self, basis: Basis, *, own: bool = False, searched: Findings | None = None) -> None:
        self.basis, self._searched = basis, searched
        self._free = own_numbers(basis) if own else None
        self.folds = folds_of(basis.forces.motions)
        self._ordered: dict[tuple[str, ...], Ordered] = {}
        self._known: dict[tuple[str, ...], ManualModel] = {}

    @property
    def frees(self) -> bool:
        """True when any of the model's own numbers are fitted."""
        return self._free is not None and bool(self._free.symbols)

    @single_threaded
    def with_effects(self, names: Sequence[str]) -> ManualModel:
        """The model with these effects and no other, fitted together under the laws.

        Raises
        ------
        RequestError
            for an effect that is unknown, given twice, or cannot be judged on this log; when a solver fails.
        """
        asked = tuple(names)
        if asked not in self._known:
            same = not asked and self._free is None
            self._known[asked] = ManualModel((), self.basis.nominal, (), {}) if same else self._fitted(asked)
        return self._known[asked]

    def _fitted(self, names: tuple[str, ...]) -> ManualModel:
        fitted = fit_named(self.basis, names, self._free, self._begun(names), self._searched)
        self._ordered[names] = fitted.ordered
        unseen = fitted.unseen(last=True)
        apart = tuple(zip(unseen.folds, unseen.steps[0], strict=True))
        return ManualModel(names, fitted.lawful.vehicle, apart, fitted.intervals, fitted.lawful.passivity)

    def _begun(self, names: tuple[str, ...]) -> Ordered | None:
        """The longest beginning of the names that was fitted before."""
        longest = next((n for n in range(len(names) - 1, 0, -1) if names[:n] in self._ordered), 0)
        return self._ordered[names[:longest]] if longest else None
