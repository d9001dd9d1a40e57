"""Discovery, step by step: look at the force balance or at rollouts, keep what is sure, fit it lawfully, conclude."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..measurements.preparation.split import folds_of
from ..measurements.statistics import processors as second_processor
from ..measurements.statistics.processors import single_threaded
from ..physics.effects import parse_form
from ..physics.forces import through_water
from ..physics.laws.damping_power import envelope_of
from ..physics.motion import AXES, FORCE_UNITS, Array, Motion
from ..physics.presentation import Card, listing
from ..physics.stage import Say, trim_memory
from ..physics.vehicle import Vehicle
from .basis import Basis, DiscoverySettings, choose_balance
from .calibration.before_calibration import with_calibration
from .candidates.candidate import CALIBRATED, Kind
from .candidates.linearisation import Linearisation
from .claims import Tests, at_limits, gather_claims, widen_delays, widen_intervals
from .effect_findings import FittedTerm, found_terms
from .evidence.invariance import find_changing_forces, invariance
from .evidence.omitted_variables import file_errors, omitted_variable_bias
from .evidence.record_errors import (
    add_record_errors,
    out_of_step,
    record_errors,
    sensor_findings,
    shares_of_sensor_errors,
)
from .evidence.unexplained import find_passing_residuals, find_persistent_residuals, inclusion
from .evidence.unmodelled_forces import (
    fit_unmodelled_forces,
    rollouts_of_several_logs,
)
from .evidence.weighing import Evidence
from .experiment.advice import advise, open_questions
from .findings import Calibrated, Criterion, Findings, OtherForm, PersistentResidual, SensorError
from .lawful.refit import Lawful, judge_passivity, lawful_model
from .run_models import (
    FoldModels,
    add_stepwise,
    add_subthreshold,
    fold_models,
    polish_on_rollouts,
    too_short,
    with_steps,
)
from .search.estimation import Interval, intervals
from .search.floating import Search, State
from .search.gram import GramScores
from .selection import SearchResult, without_terms
from .sensor_error_search import HiddenErrors, search_with_sensor_errors
from .verdicts import VerdictInputs, conclude, unmeasured
from .water_of_logs import WIND, Flow, find_flows, flow_terms, sentence_of


@dataclass(frozen=True, slots=True, repr=False)
class Discovery(Card):
    """A finished discovery.

    Attributes
    ----------
    nominal, corrected : the vehicle before and after
    steps : (what was added, vehicle after it), the nominal model first with None
    findings : conclusions, without the errors of the steps, which need a test set
    force_error : (3,) root mean square of the weak residual that remains [N, N, N m]
    noise_error : (3,) what sensor noise alone would leave [N, N, N m]
    basis : what judged it
    unseen : models that were selected and fitted without a part of the log, for each of a few parts
    notes : what was done to the log, and how it was judged
    hidden : errors of sensors that only forces show, without which the corrected vehicle was found
    """

    nominal: Vehicle
    corrected: Vehicle
    steps: tuple[tuple[str | None, Vehicle], ...]
    findings: Findings
    force_error: Array
    noise_error: Array
    basis: Basis = field(repr=False)
    unseen: FoldModels = field(repr=False)
    notes: tuple[str, ...] = ()
    hidden: HiddenErrors | None = None

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        added = [added for added, _ in self.steps if added is not None]
        return [("nominal", self.nominal.name), ("added", ", ".join(added)), *self.findings.card()]

    def drawings(self) -> Mapping[str, str]:
        """See `Card`."""
        return self.findings.drawings()

    def writing(self, vehicle: Vehicle, apart: Sequence[Vehicle] = (), why: str = "") -> "Discovery":
        """The same with another model as the corrected one: the nominal vehicle, or that with its own numbers fitted.

        What the names are, and how sure each is, stays: their numbers are of a model that is not written.

        Parameters
        ----------
        vehicle : the model
        apart : the model without each fold; none for the nominal vehicle, and where a part of the log judges
        why : a sentence
        """
        calibrated = vehicle.values != self.nominal.values
        findings = self.findings
        said = (*findings.missing, *findings.likely)
        instead = "the file's model with its own numbers fitted" if calibrated else "the nominal model"
        headline = f"{findings.headline.removesuffix('.')}; yet {instead} is written." if said else findings.headline
        candidates = tuple(
            c.but(terms=tuple(term.but(in_model=None) for term in c.terms)) if c.in_model else c
            for c in findings.candidates
        )
        rows = tuple(
            Calibrated(
                symbol=symbol,
                before=self.nominal.value(symbol),
                after=value,
                wanted=value,
                unit=self.nominal.parameter(symbol).unit,
            )
            for symbol, value in vehicle.values.items()
            if calibrated and value != self.nominal.value(symbol)
        )
        motions = self.basis.forces.motions
        states = np.concatenate([np.stack(through_water(self.nominal, motion)) for motion in motions], axis=1)
        not_written = tuple(_as_form(term, states, findings.criterion) for term in findings.unnamed)
        if not_written:
            why = f"{why} What is not in it: {listing([form.in_words for form in not_written])}."
        envelope = envelope_of(motions, vehicle)
        error = np.sqrt((self.basis.forces.residual(vehicle) ** 2).mean(axis=0))
        self.basis.forces.forget()
        corrected = vehicle.with_values({}, name=self.corrected.name)
        return replace(
            self,
            corrected=corrected,
            steps=(*self.steps[:1], *([(CALIBRATED, corrected)] if calibrated else [])),
            findings=findings.but(
                headline=headline,
                candidates=candidates,
                unnamed=(),
                other_forms=tuple(dict.fromkeys((*not_written, *findings.other_forms))),
                calibrated=rows,
                passivity=judge_passivity(corrected, envelope),
                reasons=(*findings.reasons, why),
            ),
            force_error=error,
            unseen=replace(self.unseen, steps=(tuple(apart),) if apart else ()),
        )


def _as_form(term: FittedTerm, states: Array, criterion: Criterion) -> OtherForm:
    """A term without a name that is not written, as a force that nothing written explains, along states (3, rows)."""
    force = abs(term.value) * float(np.sqrt(np.mean(parse_form(term.form)(*states) ** 2)))
    scale, unit = criterion.force_scale[term.axis], FORCE_UNITS[AXES.index(term.axis)]
    return OtherForm(axis=term.axis, follows=term.form, force=force, share=force / scale, unit=unit)


@single_threaded
def find_missing(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings | None = None,
    progress: Say | None = None,
    basis: Basis | None = None,
) -> Discovery:
    """Name the physical effects that a vehicle model misses on measured motions.

    Parameters
    ----------
    motions : gap-free stretches, unfiltered; judged by blocked held-out error, so no test part is needed here
    nominal : the model to be corrected
    progress : called with a line for each step
    basis : what judges these motions of this model under these settings, where it was chosen before

    Raises
    ------
    RequestError
        when the log is too short for the weak form, or a solver fails.
    """
    say = progress or (lambda text: None)
    basis = basis or choose_balance(motions, nominal, settings or DiscoverySettings())
    flows, winds = find_flows(basis)
    water = HiddenErrors(0.0, 0.0, 0.0, flows)
    if flows:
        say(water.findings[0].sentence)
        clear = [water.corrected(motion) for motion in basis.forces.motions]
        basis = replace(choose_balance(clear, nominal, settings or basis.settings), part=basis.part)
    for told in filter(None, (basis.part, basis.why)):
        say(told)
    looked, hidden = search_with_sensor_errors(basis, say)
    if flows:
        hidden = replace(hidden or water, flows=flows)
    tested = _test(looked, hidden)
    fewer = without_terms(looked, unsure_terms(tested.terms(looked.search)), say)
    if fewer is not None:
        looked, tested = fewer, _test(fewer, hidden)
    found = _conclude(looked, tested, hidden)
    if not winds:
        return found
    if found.findings.verdict == "undecided":
        found = found.writing(nominal, (), "Nothing is added while the logs differ so.")
    return replace(found, findings=in_winds(found.findings, winds))


def unsure_terms(unnamed: Sequence[FittedTerm]) -> list[str]:
    """Terms without a name, all but the surest, whose interval holds nothing: what no drag can be, and the least sure.

    Of two that are alike where the log has been, only one that turns with the motion takes energy out of the boat.
    """
    terms = {f"{t.axis}:{t.form}": t for t in unnamed if t.ci95}
    sure = {key: abs(sum(t.ci95)) / (t.ci95.upper - t.ci95.lower) for key, t in terms.items() if t.ci95}
    order = sorted(terms, key=lambda key: (parse_form(terms[key].form).odd, sure[key]))
    return [key for key in order[:-1] if sure[key] <= 1.0]


def in_winds(findings: Findings, winds: Sequence[Flow]) -> Findings:
    """Findings of logs that ask for a wind each, which one model does not hold.

    Parameters
    ----------
    findings : of all logs at once
    winds : of each log [N]
    """
    told = f"{sentence_of(winds, 'The wind pushes with', 'N')}; one model holds one wind, so search each log alone."
    headline = findings.headline
    if findings.verdict == "undecided":
        headline = "Undecided: the wind differs from log to log, and one model holds one wind."
    return findings.but(headline=headline, reasons=(told, *findings.reasons), winds=flow_terms(winds, WIND, "N"))


@dataclass(frozen=True, slots=True, eq=False)
class LawfulFit:
    """The corrected model of a selection, before anything is said of it.

    Attributes
    ----------
    evidence : on every candidate
    state : the model with the names that stand and those that only predict better
    kept, subthreshold : keys of the ones and of the others
    about : columns and scores about it
    lawful : the model under the laws
    intervals : 95 % intervals of total values by symbol, of all that was selected
    """

    evidence: list[Evidence]
    state: State
    kept: tuple[str, ...]
    subthreshold: tuple[str, ...]
    about: tuple[Linearisation, GramScores]
    lawful: Lawful
    intervals: dict[str, Interval]


@dataclass(frozen=True, slots=True, eq=False)
class TestedFit:
    """A lawful fit, and what every test says of it.

    Attributes
    ----------
    model : the fit
    steps : (what was added, vehicle after it), the nominal model first
    unseen : models that were selected and fitted without each fold, of the last step
    sensors : errors of sensors, of the record and of those that only forces show
    tests, rests : what the tests say of each name, and what lasts and is explained by nothing
    narrow, intervals : 95 % intervals of total values by symbol, before and after what is not explained widens them
    """

    model: LawfulFit
    steps: tuple[tuple[str | None, Vehicle], ...]
    unseen: FoldModels
    sensors: tuple[SensorError, ...]
    tests: Tests
    rests: tuple[PersistentResidual, ...]
    narrow: dict[str, Interval]
    intervals: dict[str, Interval]

    @property
    def kept(self) -> tuple[str, ...]:
        """Keys of what is in the model."""
        return (*self.model.kept, *self.model.subthreshold)

    def terms(self, search: Search) -> list[FittedTerm]:
        """The terms without a name that are in the model."""
        pool = {candidate.key: candidate for candidate in search.pool}
        keys = [e.key for e in self.model.evidence if e.kind is Kind.TERM and e.key in self.kept]
        fitted = self.model.lawful.unconstrained
        return [term for key in keys for term in found_terms(pool[key], search.nominal, fitted, self.intervals)]


def _test(looked: SearchResult, hidden: HiddenErrors | None) -> TestedFit:
    """Fit the names that stand under the laws, and test them."""
    basis, nominal, search = looked.basis, looked.basis.nominal, looked.search
    model = _fit(looked)
    steps = add_stepwise(search, model.state, model.lawful.vehicle)
    trim_memory()
    parts, envelope = folds_of(basis.forces.motions), model.lawful.passivity.envelope
    unseen = fold_models(search, parts, looked.state, model.state, model.about, envelope, model.subthreshold)
    records = sensor_findings(basis.forces.motions, basis.uses_rollouts)
    sensors = (*records, *(hidden.findings if hidden else ()))
    tests, rests = _tests_of(looked, model, sensors)
    left = {e.key: e.residual_ratio for e in model.evidence if e.selected}
    apart = unseen.steps[-1] if len(steps) > 1 else ()
    biased = omitted_variable_bias(search, model.state, model.about)
    filed = file_errors(search, model.state, model.about)
    narrow = widen_intervals(model.intervals, search.pool, nominal, tests, apart)
    found = widen_intervals(model.intervals, search.pool, nominal, tests, apart, left, biased, filed)
    return TestedFit(model, steps, unseen, sensors, tests, rests, narrow, found)


def _conclude(looked: SearchResult, tested: TestedFit, hidden: HiddenErrors | None) -> Discovery:
    """Say what is known of each name."""
    basis, nominal, search = looked.basis, looked.basis.nominal, looked.search
    model, told, kept, found = tested.model, tested.steps, tested.kept, tested.intervals
    unseen = with_steps(tested.unseen, search, told, model.lawful.passivity.envelope)
    names = search.named(model.state.active)
    folds = unseen.counted([key for key in names if key not in model.subthreshold])
    timing = partial(record_errors, search, model.state.vehicle, model.state.active, found)
    late = out_of_step(basis.forces.motions, (*tested.sensors, *timing()))
    tests = replace(tested.tests, out_of_step=late)
    selected = search.named(looked.state.active)
    grounds = VerdictInputs(
        search=search,
        lawful=model.lawful,
        considered=looked.state.vehicle,
        evidence=model.evidence,
        intervals=found,
        kept=kept,
        order=[label for label, _ in told[1:]],
        claims=gather_claims(model.evidence, search.pool, nominal, found, tests, kept, tested.narrow),
        tests=tests,
        known=looked.known,
        included=inclusion(search, looked.state, basis.settings.seed) if search.of_kind(selected, Kind.TERM) else {},
        unseen=looked.unseen,
        persistent=tested.rests,
        passing={} if search.balance.forces else find_passing_residuals(looked.forces[0], looked.state.vehicle),
    )
    findings = conclude(grounds, unmeasured(looked.motions)).but(folds=folds)
    sure = [e.key for e in findings.candidates if e.verdict == "missing"]
    questions = open_questions(model.evidence, sure, looked.known)
    rehearsal = None if selected else looked.rehearsal
    findings = findings.but(advice=advise(*looked.forces, questions, looked.plausible, rehearsal))
    if looked.free is not None:
        findings = with_calibration(findings, looked.free, nominal, model.lawful, found)
    error = np.sqrt(model.state.fit.held_out)
    if not search.balance.forces:
        error = np.sqrt((looked.forces[0].balance.residual(model.lawful.vehicle) ** 2).mean(axis=0))
        findings = too_short(findings, search.balance.blocks)
    certain = findings.verdict in ("missing", "nothing missing") and not findings.unnamed
    errors = (*tested.sensors, *timing(certain))
    findings = add_record_errors(findings, errors)
    notes = (*looked.notes, *(s.sentence for s in errors if s.verdict != "no evidence"))
    basis.forces.forget()
    noise = looked.forces[0].noise_error
    return Discovery(nominal, model.lawful.vehicle, told, findings, error, noise, basis, unseen, notes, hidden)


def _fit(looked: SearchResult) -> LawfulFit:
    """Fit the names that stand, those beside them that unseen parts gain by, and all of it under the laws."""
    basis, search, state = looked.basis, looked.search, looked.state
    shooting, nominal = basis.settings.shooting, basis.nominal
    evidence = list(looked.evidence)
    kept = tuple(e.key for e in evidence if e.stands)
    final = polish_on_rollouts(search, search.restrict(state, kept), kept, shooting)
    final = add_subthreshold(search, final, looked.subthreshold, shooting)
    untold = tuple(key for key in search.named(final.active) if key not in kept)
    linear, scores, now = search.about(final)
    chosen = list(now.values())
    lawful = lawful_model(looked.motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    found = intervals(search.balance, scores, search.pool, chosen, final.vehicle, basis.settings.seed)
    if set(kept) != set(search.named(state.active)):
        _, wide, there = search.about(state)
        options = list(there.values())
        found = intervals(search.balance, wide, search.pool, options, state.vehicle, basis.settings.seed) | found
    return LawfulFit(evidence, final, kept, untold, (linear, scores), lawful, widen_delays(found, search.pool))


def _tests_of(
    looked: SearchResult, model: LawfulFit, records: Sequence[SensorError]
) -> tuple[Tests, tuple[PersistentResidual, ...]]:
    """Ask every test of every name that was selected; and what lasts and is explained by nothing."""
    search, (forces, there), seed = looked.search, looked.forces, looked.basis.settings.seed
    selected = (*search.named(looked.state.active), *model.subthreshold)
    rests = find_persistent_residuals(forces, search.balance, looked.state.vehicle)
    asked = partial(fit_unmodelled_forces, forces, there, selected, seed)
    with second_processor.run_in_fork(asked) as formed:
        changes = find_changing_forces(forces, there, selected, seed)
        forms = formed()
    trim_memory()
    final, pool = model.state, search.pool
    tests = Tests(
        limits=_limits(looked, model),
        invariant=invariance(search, final, model.about),
        changes=changes,
        forms=forms,
        accused=shares_of_sensor_errors(model.evidence, pool, records),
        rolls=not search.balance.forces,
        several=rollouts_of_several_logs(search.balance),
    )
    return tests, rests


def _limits(looked: SearchResult, model: LawfulFit) -> dict[str, str]:
    """Which names are at a limit: those that stand in the fitted model there, others in that of the search."""
    pool, nominal = looked.search.pool, looked.basis.nominal
    there = looked.search.named(model.state.active)
    others = [key for key in looked.search.named(looked.state.active) if key not in there]
    found = at_limits(pool, nominal, model.lawful.unconstrained, there, model.intervals)
    return found | at_limits(pool, nominal, looked.state.vehicle, others, model.intervals)
