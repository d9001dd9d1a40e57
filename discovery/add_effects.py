"""The verb `add` on motions: effects that somebody chose, fitted in the order given, and judged like those found."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..measurements.statistics.single_threaded import single_threaded
from ..physics.in_words import listing, words
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .balance.rollout_test import rollouts_object
from .basis import Basis
from .calibration.beside_effects import with_calibration
from .candidates.nuisance import CALIBRATED
from .claims import Tests, claims
from .discover import Discovery
from .evidence.all_thrusters import all_thrusters
from .evidence.disagreements import disagreements
from .evidence.limits import in_step
from .evidence.other_forms import judged_in_logs
from .evidence.record_errors import accused, record_errors, without_forces
from .evidence.weighing import modest, weigh
from .findings import Findings
from .fold_findings import Folds
from .in_order import Fitted, chosen_for, fit_named, own_numbers
from .search.floating import Search
from .settings import DiscoverySettings
from .verdicts import Grounds, conclude

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
    basis = basis or chosen_for(motions, nominal, settings, searched)
    free = own_numbers(basis) if basis.settings.refit else None
    fitted = fit_named(basis, names, free, searched=searched)
    search, state, lawful = fitted.search, fitted.state, fitted.lawful
    form, corrected, notes = search.balance, lawful.vehicle, basis.told
    if free is None:
        notes = (*notes, _KEPT)
    error, noise = np.sqrt(state.fit.held_out), search.noise_error
    if basis.rolls:
        weak = basis.cleared_forces()
        error = np.sqrt((weak.balance(corrected) ** 2).mean(axis=0))
        noise = Search(weak, nominal, (), settings.search).noise_error
    if searched is not None and fitted.whole:
        findings = _as_searched(searched, fitted)
        return Discovery(nominal, corrected, fitted.steps, findings, error, noise, basis, fitted.unseen(), notes)
    evidence = in_step(weigh(search, state, settings.seed), search.pool, nominal, state.vehicle, form.motions)
    if basis.rolls:
        evidence = modest(evidence, form)
        notes = (*notes, *disagreements(form, nominal, corrected))
        if rollouts_object(form.squares(nominal), form.squares(corrected), form.overlap):
            notes = (*notes, "open-loop rollouts get worse with these effects than they are without any")
    told = fitted.intervals
    order = [str(label) for label, _ in fitted.steps[1:]]
    added = [e for e in evidence if e.selected]
    kept = [e.key for e in added]
    sensors = without_forces(basis.forces.motions, basis.rolls)
    tests = Tests(accused=accused(added, search.pool, sensors), rolls=basis.rolls, several=judged_in_logs(form))
    claimed = claims(added, search.pool, nominal, told, tests, kept)
    asked, sure = dict(_asked(searched, kept)), dict(_sure(searched, kept))
    grounds = Grounds(search, lawful, corrected, added, told, kept, order, claimed, tests, asked=asked, sure=sure)
    findings = conclude(grounds)
    unsure = [c.key for c in findings.candidates if c.verdict != "missing"]
    sensors += record_errors(search, state.vehicle, state.active, told)
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


def _headline(fitted: Fitted, unsure: Sequence[str]) -> str:
    """What was added, how it was fitted, and what of it is not certain."""
    named = listing([words(name) for name in fitted.names])
    by = ", fitted to open-loop rollouts" if fitted.basis.rolls else ""
    beside = ", beside the model's own numbers" if any(label == CALIBRATED for label, _ in fitted.steps) else ""
    sure = f"; not certain: {listing([words(key) for key in unsure])}" if unsure else ""
    return f"Added by name: {named}{by}{beside}{sure}."


def _as_searched(searched: Findings, fitted: Fitted) -> Findings:
    """What a search says of all that stands in its model, where just that is added."""
    unsure = [c.key for c in searched.added if c.verdict != "missing"]
    return searched.but(candidates=searched.added, headline=_headline(fitted, unsure), advice=())


def _asked(searched: Findings | None, keys: Sequence[str]) -> Iterator[tuple[str, str]]:
    """What a search said of effects that were asked for, by key, as the end of a sentence."""
    for one in searched.candidates if searched else ():
        if one.key in keys and one.verdict in _FOUND:
            yield one.key, _COULD_NOT if one.cannot_tell else _FOUND[one.verdict]


def _sure(searched: Findings | None, keys: Sequence[str]) -> Iterator[tuple[str, float]]:
    """How sure a search was of effects that it called missing or likely, by key: adding them again makes none surer."""
    for one in searched.candidates if searched else ():
        if one.key in keys and one.verdict not in _FOUND:
            yield one.key, one.confidence
