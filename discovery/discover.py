"""Discovery, step by step: search the catalogue, look for structure that it leaves, weigh the evidence, conclude."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from threadpoolctl import threadpool_limits

from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .advice import advise, open_questions
from .colour import Unexplained, unexplained
from .conclude import conclude
from .evidence import Evidence, weigh
from .field import ENOUGH_BLOCKS, TOO_SHORT, search_on_rollouts, settle, weigh_on_rollouts
from .findings import Findings
from .identifiability import identify
from .library import shortlist, term_candidate, twins
from .nuisance import believed, misalignment
from .options import Candidate, candidates
from .passivity import lawful_model
from .refit import CALIBRATED, freed, with_calibration
from .rehearsal import plausible_amounts, rehearse
from .rollouts import WHOLE_HORIZON, rollout_squares, rollouts_object
from .search import Search, SearchSettings, State
from .shooting import ShootingSettings
from .uncertainty import Interval, block_bootstrap
from .weak import WeakForm, WeakSettings

_STRUCTURE = 1.5
"""A force error above this many times what sensor noise explains is structure that the model leaves."""


@dataclass(frozen=True, slots=True)
class DiscoverySettings:
    """All settings of a discovery; they are printed in the report.

    Attributes
    ----------
    weak : test functions
    search : price and materiality
    seed : of the bootstrap
    shooting : rollouts, for logs whose error is coloured
    refit : True to calibrate the parameters of the nominal model while effects are judged; sensor noise is then taken
        off all normal equations, lest parameters that noise draws towards zero call for effects
    """

    weak: WeakSettings = field(default_factory=WeakSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    seed: int = 0
    shooting: ShootingSettings = field(default_factory=ShootingSettings)
    refit: bool = False


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
    pool = candidates(nominal)
    search = Search(weak, nominal, pool, settings.search)
    left = unexplained(search)
    if left.coloured.any():
        say(left.sentence)
        return _find_on_rollouts(motions, nominal, settings, left, say)
    free = freed(weak, nominal, pool, settings.search) if settings.refit else None
    if free is not None:
        pool, settings = free.pool, replace(settings, search=replace(settings.search, cleared=True))
        search = Search(weak, nominal, pool, settings.search)
        say(free.sentence)
    rehearsal = rehearse(search, nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    say(identify(search, nominal, search.nuisances, plausible).sentence)
    say("searching the catalogue of effects")
    state = search.run(progress=say)
    if leaves_structure(search, state):
        say("named effects leave structure: looking for terms that nobody has named")
        search, state = _with_terms(weak, nominal, pool, settings.search, state, say)
    say("weighing the evidence")
    if search.pool != pool:
        rehearsal = rehearse(search, nominal, search.nuisances)
        plausible = plausible_amounts(search, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    evidence = in_step(weigh(search, state, settings.seed, known), search, state)
    kept = tuple(e.key for e in evidence if e.sure)
    final = search.restrict(state, kept)
    if kept and worse_as_a_whole(motions, _base(search, state), final.vehicle):
        evidence = [replace(e, rollouts_object=e.selected) for e in evidence]
        kept, final = (), search.restrict(state, ())
    linear, scores = search.linearise(final.vehicle, final.active, final.fit.in_sample)
    chosen = [linear.options[key][0] for key in final.active]
    lawful = lawful_model(motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    corrected = lawful.vehicle
    intervals: dict[str, Interval] = block_bootstrap(scores, chosen, settings.seed)
    if set(kept) != set(search.named(state.active)):
        far, wide = search.linearise(state.vehicle, state.active, state.fit.in_sample)
        intervals = block_bootstrap(wide, [far.options[k][0] for k in state.active], settings.seed) | intervals
    steps = _steps(search, final, corrected)
    spare = None if search.named(state.active) else rehearsal
    findings = conclude(
        search,
        nominal,
        lawful,
        state.vehicle,
        evidence,
        intervals,
        kept,
        [s for s, _ in steps[1:]],
        known,
        advise(search, state, open_questions(evidence, kept, known), plausible, spare),
    )
    if free is not None:
        findings = with_calibration(findings, free, nominal, lawful, intervals)
    return Discovery(nominal, corrected, steps, findings, np.sqrt(final.fit.held_out), search.noise_error)


def _find_on_rollouts(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings,
    left: Unexplained,
    say: Callable[[str], None],
) -> Discovery:
    found = search_on_rollouts(motions, nominal, settings.search, settings.shooting, say, settings.refit)
    search, state = found.search, found.state
    say("weighing the evidence")
    evidence = in_step(weigh_on_rollouts(found, settings.seed), search, state)
    kept = tuple(e.key for e in evidence if e.sure)
    final = settle(search, state, kept, settings.shooting)
    if kept and not final.active:
        evidence, kept = [replace(e, rollouts_object=e.selected) for e in evidence], ()
    linear, scores = search.linearise(final.vehicle, final.active, final.fit.in_sample)
    chosen = [linear.options[key][0] for key in final.active]
    lawful = lawful_model(found.motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    intervals = block_bootstrap(scores, chosen, settings.seed)
    if set(kept) != set(search.named(state.active)):
        far, wide = search.linearise(state.vehicle, state.active, state.fit.in_sample)
        intervals = block_bootstrap(wide, [far.options[k][0] for k in state.active], settings.seed) | intervals
    steps = _steps(search, final, lawful.vehicle)
    forces, weak_state = found.forces()
    findings = conclude(
        search,
        nominal,
        lawful,
        state.vehicle,
        evidence,
        intervals,
        kept,
        [s for s, _ in steps[1:]],
        found.known,
        advise(
            forces,
            weak_state,
            open_questions(evidence, kept, found.known),
            found.plausible,
            None if search.named(state.active) else found.rehearsal,
        ),
        found.unseen,
    )
    blocks = int(search.weak.block.max()) + 1
    if findings.verdict == "nothing missing" and blocks < ENOUGH_BLOCKS:
        findings = replace(
            findings, verdict="undecided", headline=TOO_SHORT.format(blocks=blocks, enough=ENOUGH_BLOCKS)
        )
    if found.free is not None:
        findings = with_calibration(findings, found.free, nominal, lawful, intervals)
    error = np.sqrt((forces.weak.balance(lawful.vehicle) ** 2).mean(axis=0))
    notes = (left.sentence, *found.notes)
    return Discovery(nominal, lawful.vehicle, steps, findings, error, forces.noise_error, notes)


def in_step(evidence: Sequence[Evidence], search: Search, state: State) -> list[Evidence]:
    """The evidence, with a lag or a delay doubted where the log's own channels are as far out of step."""
    if not {"thruster_lag", "input_delay"} & set(state.active):
        return list(evidence)
    late = misalignment(search.weak.motions)
    pool = {candidate.key: candidate for candidate in search.pool}
    return [
        believed(e, late, pool[e.key], [state.vehicle.value(s) for s in pool[e.key].symbols]) if e.selected else e
        for e in evidence
    ]


def worse_as_a_whole(motions: Sequence[Motion], nominal: Vehicle, corrected: Vehicle) -> bool:
    """True when 10 s open-loop rollouts of a corrected model are significantly worse than the nominal model's.

    On field logs the force balance can ask for effects that wreck predictions; then none of them is called missing.
    """
    before, after = (rollout_squares(motions, vehicle, WHOLE_HORIZON) for vehicle in (nominal, corrected))
    return rollouts_object(before, after)


def leaves_structure(search: Search, state: State) -> bool:
    """True when the force error on some axis is neither immaterial nor explained by sensor noise."""
    error = np.sqrt(state.fit.held_out)
    return bool((error > np.maximum(np.sqrt(search.floor), _STRUCTURE * search.noise_error)).any())


def _with_terms(
    weak: WeakForm,
    nominal: Vehicle,
    pool: Sequence[Candidate],
    settings: SearchSettings,
    state: State,
    say: Callable[[str], None],
) -> tuple[Search, State]:
    """Search again with a sparse shortlist of unnamed terms, from the named model and from nothing; keep the better.

    Terms that move much like a chosen one then join, so that a term is not blamed where its twin would do as well.
    """

    def widened(symbols: Iterable[str]) -> Search:
        terms = [term_candidate(s, nominal) for s in dict.fromkeys(symbols)]
        return Search(weak, nominal, (*pool, *terms), settings)

    taken = {s for c in pool if c.nuisance for s in c.symbols}
    listed = (*shortlist(weak, _base(Search(weak, nominal, pool, settings), state)), *shortlist(weak, state.vehicle))
    symbols = [s for s in listed if s not in taken]
    search = widened(symbols)
    found = [search.run(start=state, progress=say), search.run(progress=say)]
    best = min(found, key=lambda s: s.score)
    alike = twins(weak, best.vehicle, [key for key in best.active if ":" in key])
    alike = tuple(s for s in alike if s not in taken)
    if not alike:
        return search, best
    search = widened([*symbols, *alike])
    return search, search.run(start=best, progress=say)


def _base(search: Search, state: State) -> Vehicle:
    """The model without any effect: the nominal one, calibrated where its parameters are free."""
    return search.restrict(state, ()).vehicle if search.nuisances else search.nominal


def _steps(search: Search, final: State, corrected: Vehicle) -> tuple[tuple[str | None, Vehicle], ...]:
    """Calibrate, where that is wanted, and add the kept effects one by one, the most valuable first, refitted."""
    steps: list[tuple[str | None, Vehicle]] = [(None, search.nominal)]
    effects = search.named(final.active)
    if search.nuisances:
        steps.append((CALIBRATED, _base(search, final) if effects else corrected))
    chosen: list[str] = []
    while len(chosen) < len(effects):
        rest = [key for key in effects if key not in chosen]
        trials = [(search.restrict(final, [*chosen, key]), key) for key in rest]
        best, key = min(trials, key=lambda pair: pair[0].score)
        chosen.append(key)
        steps.append((key, corrected if len(chosen) == len(effects) else best.vehicle))
    return tuple(steps)
