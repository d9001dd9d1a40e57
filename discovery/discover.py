"""Discovery, step by step: look at the force balance or at rollouts, keep what is sure, fit it lawfully, conclude."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from threadpoolctl import threadpool_limits

from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .advice import advise, open_questions
from .colour import why_rollouts
from .conclude import conclude, unmeasured
from .doubts import doubts
from .ensemble import inclusion
from .evidence import Evidence
from .field import ENOUGH_BLOCKS, TOO_SHORT, look_at_rollouts, settle
from .findings import Findings
from .instant import look_at_forces
from .looked import Looked, steps
from .nuisance import believed, misalignment
from .options import candidates, measurable
from .passivity import lawful_model
from .refit import CALIBRATED, freed, with_calibration
from .search import Search, SearchSettings, State
from .shooting import ShootingSettings
from .uncertainty import Interval, intervals
from .weak import WeakForm, WeakSettings


@dataclass(frozen=True, slots=True)
class DiscoverySettings:
    """All settings of a discovery; they are printed in the report.

    Attributes
    ----------
    weak : test functions
    search : price and materiality
    seed : of the bootstrap
    refit : True to calibrate the parameters of the nominal model while effects are judged
    shooting : rollouts, for logs whose error is coloured
    """

    weak: WeakSettings = field(default_factory=WeakSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    seed: int = 0
    refit: bool = False
    shooting: ShootingSettings = field(default_factory=ShootingSettings)


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
    weak = WeakForm(motions, settings.weak)
    search = Search(weak, nominal, candidates(nominal, measurable(motions)), settings.search)
    why = why_rollouts(search)
    if why:
        say(why)
        looked = look_at_rollouts(motions, search, settings.shooting, settings.seed, say, settings.refit)
        return _conclude(looked, nominal, settings, why)
    free = freed(weak, nominal, search.pool, settings.search) if settings.refit else None
    if free is not None:
        say(free.sentence)
        search = Search(weak, nominal, free.pool, settings.search)
    return _conclude(replace(look_at_forces(weak, search, settings.seed, say), free=free), nominal, settings)


def _conclude(looked: Looked, nominal: Vehicle, settings: DiscoverySettings, *notes: str) -> Discovery:
    """Keep the effects that are sure, fit them under the laws, and say what was found."""
    search, state = looked.search, looked.state
    evidence = _in_step(looked.evidence, search, state)
    kept = tuple(e.key for e in evidence if e.sure)
    final = settle(search, state, kept, settings.shooting)
    if kept and not search.named(final.active):
        evidence, kept = [replace(e, rollouts_object=e.selected) for e in evidence], ()
    linear, scores = search.linearise(final.vehicle, final.active, final.fit.in_sample)
    chosen = [linear.options[key][0] for key in final.active]
    lawful = lawful_model(looked.motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    found: dict[str, Interval] = intervals(search.weak, scores, search.pool, chosen, final.vehicle, settings.seed)
    if set(kept) != set(search.named(state.active)):
        far, wide = search.linearise(state.vehicle, state.active, state.fit.in_sample)
        options = [far.options[key][0] for key in state.active]
        found = intervals(search.weak, wide, search.pool, options, state.vehicle, settings.seed) | found
    doubtful = doubts(search.pool, nominal, lawful.unconstrained, kept, found)
    told = steps(search, final, lawful.vehicle, CALIBRATED)
    terms = any(":" in key for key in state.active)
    forces, there = looked.forces
    rehearsal = None if search.named(state.active) else looked.rehearsal
    findings = conclude(
        search,
        nominal,
        lawful,
        state.vehicle,
        evidence,
        found,
        kept,
        [label for label, _ in told[1:]],
        looked.known,
        advise(forces, there, open_questions(evidence, kept, looked.known), looked.plausible, rehearsal),
        inclusion(search, state, settings.seed) if terms else {},
        unmeasured(looked.motions),
        looked.unseen,
        doubtful,
    )
    if looked.free is not None:
        findings = with_calibration(findings, looked.free, nominal, lawful, found)
    error = np.sqrt(final.fit.held_out)
    if not search.weak.forces:
        error = np.sqrt((forces.weak.balance(lawful.vehicle) ** 2).mean(axis=0))
        blocks = int(search.weak.block.max()) + 1
        if findings.verdict == "nothing missing" and blocks < ENOUGH_BLOCKS:
            headline = TOO_SHORT.format(blocks=blocks, enough=ENOUGH_BLOCKS)
            findings = replace(findings, verdict="undecided", headline=headline)
    return Discovery(nominal, lawful.vehicle, told, findings, error, forces.noise_error, (*notes, *looked.notes))


def _in_step(evidence: Sequence[Evidence], search: Search, state: State) -> list[Evidence]:
    """The evidence, with a lag or a delay doubted where the log's own channels are as far out of step."""
    if not {"thruster_lag", "input_delay"} & set(state.active):
        return list(evidence)
    late = misalignment(search.weak.motions)
    pool = {candidate.key: candidate for candidate in search.pool}
    return [
        believed(e, late, pool[e.key], [state.vehicle.value(s) for s in pool[e.key].symbols]) if e.selected else e
        for e in evidence
    ]
