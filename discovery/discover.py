"""Discovery, step by step: look at the force balance or at rollouts, keep what is sure, fit it lawfully, conclude."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..measurements.preparation.held_out import folds_of
from ..measurements.statistics import second_processor
from ..measurements.statistics.single_threaded import single_threaded
from ..physics.cards import Card
from ..physics.frames import Array
from ..physics.freed_memory import hand_back
from ..physics.motion import Motion
from ..physics.stage import Say
from ..physics.vehicle import Vehicle
from .basis import Basis, choose
from .calibration.beside_effects import with_calibration
from .candidates.candidate import Kind
from .candidates.nuisance import CALIBRATED
from .evidence.inclusion import inclusion
from .evidence.invariance import beside_changes, invariance, uneven
from .evidence.lasting_rest import beside_rests, beyond_limits, lasting_rests, left_by_all, many_terms, of_stand_ins
from .evidence.limits import as_timed, doubts, in_step, of_differences, of_other_axes
from .evidence.mostly_doubted import mostly_doubted
from .evidence.other_forms import judged_in_logs, other_forms
from .evidence.own_changes import own_changes
from .evidence.record_errors import beside, beside_record, record_errors, without_forces
from .evidence.unjudged_rivals import beside_unjudged
from .evidence.verdicts import Doubt, Grounds, conclude, unmeasured
from .experiment.advice import advise, open_questions
from .findings import Findings
from .fold_models import FoldModels, fold_models
from .hidden_errors import HiddenErrors
from .hidden_sensors import beside_sensors
from .kept_effects import ENOUGH_BLOCKS, TOO_SHORT, WHY_TOO_SHORT, settle, steps, with_untold
from .lawful.passivity import lawful_model
from .reason import Reason
from .search.bootstrap import Interval, intervals
from .search.command_resolution import within_resolution
from .selected import Selected
from .settings import DiscoverySettings


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
    basis = basis or choose(motions, nominal, settings or DiscoverySettings())
    for told in filter(None, (basis.part, basis.why)):
        say(told)
    return _conclude(*beside_sensors(basis, say))


def _conclude(looked: Selected, hidden: HiddenErrors | None, beside_errors: Mapping[str, str]) -> Discovery:
    """Keep the effects that are sure, fit them under the laws, and say what was found."""
    basis, nominal, settings = looked.basis, looked.basis.nominal, looked.basis.settings
    search, state = looked.search, looked.state
    evidence = in_step(looked.evidence, search.pool, nominal, state.vehicle, search.balance.motions)
    kept = tuple(e.key for e in evidence if e.sure)
    final = settle(search, state, kept, settings.shooting)
    if kept and not search.named(final.active):
        evidence, kept = [replace(e, rollouts_object=e.selected) for e in evidence], ()
    final = with_untold(search, final, looked.untold, settings.shooting)
    untold = tuple(key for key in search.named(final.active) if key not in kept)
    forces, there = looked.forces
    with second_processor.beside(
        partial(other_forms, forces, there, kept, settings.seed, search.balance)
    ) as forms_beside:
        rests = lasting_rests(forces, search.balance, state.vehicle)
        changed = own_changes(forces, there, kept, settings.seed, search.balance)
        rivals = beside_unjudged(forces, there, kept, looked.unseen)
        forms = forms_beside()
    terms = search.of_kind(state.active, Kind.TERM)
    # On several logs that rollouts judge, the balance always leaves something that follows something, and each log was
    # left out once: what is named there holds in all others, whatever stands beside it.
    in_logs = judged_in_logs(search.balance)
    unexplained = forms.taking if in_logs else forms.found
    left = left_by_all(rests, unexplained, search.settings.materiality)
    left += many_terms([c for c in search.pool if c.key in terms])
    left += beyond_limits(search.pool, [e.key for e in evidence if e.selected and e.at_limit])
    hand_back()
    about = search.linearise(final.vehicle, final.active, final.fit.in_sample)
    linear, scores = about
    chosen = [linear.options[key][0] for key in final.active]
    lawful = lawful_model(looked.motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    found: dict[str, Interval] = intervals(search.balance, scores, search.pool, chosen, final.vehicle, settings.seed)
    if set(kept) != set(search.named(state.active)):
        far, wide = search.linearise(state.vehicle, state.active, state.fit.in_sample)
        options = [far.options[key][0] for key in state.active]
        found = intervals(search.balance, wide, search.pool, options, state.vehicle, settings.seed) | found
    found = as_timed(found, search.pool)
    doubtful = doubts(search.pool, nominal, lawful.unconstrained, kept, found)
    invariant = beside_changes(invariance(search, final, about), changed)
    sizes = uneven({key: same for key, same in invariant.items() if key in kept and key not in forms.rivals})
    left += [] if in_logs else of_stand_ins(evidence, {*forms.rivals, *sizes}, search.settings.least)
    doubtful = sizes | doubtful
    doubtful = of_differences(search.pool, kept, looked.motions) | doubtful
    if looked.free is None:  # beside numbers that are calibrated, what an effect alone explains is little on any axis
        doubtful = of_other_axes(evidence, search.pool, kept, search.settings.least) | doubtful
    recorded = without_forces(basis.forces.motions, basis.rolls)
    if not in_logs:
        doubtful = beside_record(search, final.vehicle, final.active, kept, recorded) | doubtful
    doubtful = {**within_resolution(search, final), **beside_errors, **doubtful}
    told = steps(search, final, lawful.vehicle, CALIBRATED)
    parts = folds_of(basis.forces.motions)
    hand_back()
    unseen = fold_models(search, parts, state, final, about, told, lawful.passivity.envelope, untold)
    folds = unseen.counted([key for key in search.named(final.active) if key not in untold])
    held_back = {
        **{key: Doubt(Reason.NOT_IN_MOST_FOLDS, why) for key, why in folds.doubts(kept).items()},
        **{key: Doubt(Reason.UNJUDGED_RIVAL, names) for key, names in rivals.items()},
        **{key: Doubt(Reason.LASTING_REST, why) for key, why in beside_rests(search.pool, kept, left).items()},
        **{key: Doubt(Reason.OTHER_FORM, rival.told, rival.form) for key, rival in forms.rivals.items()},
        **{key: Doubt(Reason.DOUBTFUL_VALUE, why) for key, why in doubtful.items()},
    }
    if not in_logs:
        apart = search.settings.least if search.balance.forces else None
        crowds = mostly_doubted(evidence, kept, held_back, apart)
        held_back |= {key: Doubt(Reason.MOSTLY_DOUBTED, crowd) for key, crowd in crowds.items()}
    held_back |= dict.fromkeys(untold, Doubt(Reason.UNTOLD))
    rehearsal = None if search.named(state.active) else looked.rehearsal
    grounds = Grounds(
        search=search,
        lawful=lawful,
        considered=state.vehicle,
        evidence=evidence,
        intervals=found,
        kept=(*kept, *untold),
        order=[label for label, _ in told[1:]],
        known=looked.known,
        included=inclusion(search, state, settings.seed) if terms else {},
        unseen=looked.unseen,
        doubtful=held_back,
        rests=rests,
        other_forms=forms,
        invariant=invariant,
    )
    advice = advise(forces, there, open_questions(evidence, kept, looked.known), looked.plausible, rehearsal)
    findings = conclude(grounds, advice, unmeasured(looked.motions))
    findings = findings.but(folds=folds)
    if looked.free is not None:
        findings = with_calibration(findings, looked.free, nominal, lawful, found)
    error = np.sqrt(final.fit.held_out)
    if not search.balance.forces:
        error = np.sqrt((forces.balance.balance(lawful.vehicle) ** 2).mean(axis=0))
        blocks = search.balance.blocks
        if findings.verdict == "nothing missing" and blocks < ENOUGH_BLOCKS:
            why = WHY_TOO_SHORT.format(blocks=blocks, enough=ENOUGH_BLOCKS)
            findings = findings.but(verdict="undecided", headline=TOO_SHORT, reasons=(why,))
    certain = findings.verdict != "undecided" and not findings.unnamed
    sensors = record_errors(search, final.vehicle, final.active, found, certain)
    sensors = (*recorded, *(hidden.findings if hidden else ()), *sensors)
    findings = beside(findings, sensors)
    notes = (*looked.notes, *(s.sentence for s in sensors if s.verdict != "no evidence"))
    basis.forces.forget()
    return Discovery(nominal, lawful.vehicle, told, findings, error, forces.noise_error, basis, unseen, notes, hidden)
