"""Discovery, step by step: look at the force balance or at rollouts, keep what is sure, fit it lawfully, conclude."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .balance.sensor_errors import believed, misalignment
from .basis import Basis, choose
from .calibration.beside_effects import CALIBRATED, with_calibration
from .candidates.linearisation import Kind
from .evidence.inclusion import inclusion
from .evidence.limits import doubts
from .evidence.verdicts import Grounds, conclude, unmeasured
from .evidence.weighing import Evidence
from .experiment.advice import advise, open_questions
from .findings import Findings
from .lawful.passivity import lawful_model
from .search.bootstrap import Interval, intervals
from .search.floating import Search, State
from .selection import ENOUGH_BLOCKS, TOO_SHORT, Selected, select, settle, steps
from .settings import DiscoverySettings


@dataclass(frozen=True, slots=True)
class Discovery:
    """A finished discovery.

    Attributes
    ----------
    nominal, corrected : the vehicle before and after
    steps : (what was added, vehicle after it), the nominal model first with None
    findings : conclusions, without the errors of the steps, which need a test set
    force_error : (3,) root mean square of the weak residual that remains [N, N, N m]
    noise_error : (3,) what sensor noise alone would leave [N, N, N m]
    notes : what was done to the log, and how it was judged
    """

    nominal: Vehicle
    corrected: Vehicle
    steps: tuple[tuple[str | None, Vehicle], ...]
    findings: Findings
    force_error: Array
    noise_error: Array
    notes: tuple[str, ...] = ()


def find_missing(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings | None = None,
    progress: Callable[[str], None] | None = None,
) -> Discovery:
    """Name the physical effects that a vehicle model misses on measured motions.

    Parameters
    ----------
    motions : gap-free stretches, unfiltered; judged by blocked held-out error, so no test part is needed here
    nominal : the model to be corrected
    progress : called with a line for each step

    Raises
    ------
    RequestError
        when the log is too short for the weak form, or a solver fails.
    """
    settings = settings or DiscoverySettings()
    with threadpool_limits(limits=1, user_api="blas"):  # the matrices are small: threads only wait for each other
        return _find(motions, nominal, settings, progress or (lambda text: None))


def _find(
    motions: Sequence[Motion], nominal: Vehicle, settings: DiscoverySettings, say: Callable[[str], None]
) -> Discovery:
    basis = choose(motions, nominal, settings)
    if basis.why:
        say(basis.why)
    return _conclude(basis, select(basis, say))


def _conclude(basis: Basis, looked: Selected) -> Discovery:
    """Keep the effects that are sure, fit them under the laws, and say what was found."""
    nominal, settings = basis.nominal, basis.settings
    search, state = looked.search, looked.state
    evidence = _in_step(looked.evidence, search, state)
    kept = tuple(e.key for e in evidence if e.sure)
    final = settle(search, state, kept, settings.shooting)
    if kept and not search.named(final.active):
        evidence, kept = [replace(e, rollouts_object=e.selected) for e in evidence], ()
    linear, scores = search.linearise(final.vehicle, final.active, final.fit.in_sample)
    chosen = [linear.options[key][0] for key in final.active]
    lawful = lawful_model(looked.motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    found: dict[str, Interval] = intervals(search.balance, scores, search.pool, chosen, final.vehicle, settings.seed)
    if set(kept) != set(search.named(state.active)):
        far, wide = search.linearise(state.vehicle, state.active, state.fit.in_sample)
        options = [far.options[key][0] for key in state.active]
        found = intervals(search.balance, wide, search.pool, options, state.vehicle, settings.seed) | found
    doubtful = doubts(search.pool, nominal, lawful.unconstrained, kept, found)
    told = steps(search, final, lawful.vehicle, CALIBRATED)
    terms = search.of_kind(state.active, Kind.TERM)
    forces, there = looked.forces
    rehearsal = None if search.named(state.active) else looked.rehearsal
    grounds = Grounds(
        search,
        lawful,
        state.vehicle,
        evidence,
        found,
        kept,
        [label for label, _ in told[1:]],
        looked.known,
        inclusion(search, state, settings.seed) if terms else {},
        looked.unseen,
        doubtful,
    )
    advice = advise(forces, there, open_questions(evidence, kept, looked.known), looked.plausible, rehearsal)
    findings = conclude(grounds, advice, unmeasured(looked.motions))
    if looked.free is not None:
        findings = with_calibration(findings, looked.free, nominal, lawful, found)
    error = np.sqrt(final.fit.held_out)
    if not search.balance.forces:
        error = np.sqrt((forces.balance.balance(lawful.vehicle) ** 2).mean(axis=0))
        blocks = search.balance.blocks
        if findings.verdict == "nothing missing" and blocks < ENOUGH_BLOCKS:
            headline = TOO_SHORT.format(blocks=blocks, enough=ENOUGH_BLOCKS)
            findings = findings.but(verdict="undecided", headline=headline)
    return Discovery(nominal, lawful.vehicle, told, findings, error, forces.noise_error, looked.notes)


def _in_step(evidence: Sequence[Evidence], search: Search, state: State) -> list[Evidence]:
    """The evidence, with a lag or a delay doubted where the log's own channels are as far out of step."""
    if not {"thruster_lag", "input_delay"} & set(state.active):
        return list(evidence)
    late = misalignment(search.balance.motions)
    pool = {candidate.key: candidate for candidate in search.pool}
    return [
        believed(e, late, pool[e.key], [state.vehicle.value(s) for s in pool[e.key].symbols]) if e.selected else e
        for e in evidence
    ]
