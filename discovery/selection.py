"""What a search looks at and keeps: on the force balance where noise is white, on rollouts elsewhere.

Search, evidence and look-alikes are the same on forces and on rollouts. What differs is where a search begins, and what
is tried after it: a force balance may leave structure for terms that nobody has named; rollouts are weighed by the
model that was found, and lose what cannot be told from nothing.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..measurements.statistics.second_processor import shared
from ..physics.errors import RequestError
from ..physics.freed_memory import hand_back
from ..physics.motion import Motion
from ..physics.stage import SEARCHING, WEIGHING, Say, Stage
from ..physics.vehicle import Vehicle
from .balance.rollout_test import worse_as_a_whole
from .balance.shooting import ShootingSettings
from .balance.weak_form import WeakForm
from .basis import LEAVES, Basis
from .calibration.beside_effects import Freed, freed
from .candidates.candidate import Candidate, Kind, part_by_sight
from .candidates.unnamed_terms import shortlist, term_candidate, twins
from .evidence.disagreements import disagreements
from .evidence.quiet_axes import with_faint
from .evidence.weighing import TELL_APART, Evidence, modest, weigh
from .identifiability.identifiable_effects import identify
from .identifiability.rehearsal import Rehearsal, plausible_amounts, rehearse
from .identifiability.visible import Identifiability
from .search.command_resolution import leaves_structure
from .search.equivalent_thruster_scales import in_plain_words
from .search.floating import Search, State, static_effects
from .search.output_error import polish

_REFINEMENTS = 3
"""Times that columns are taken anew about the model that was found: each costs linearised rollouts of the whole log."""
_NO_START = (
    *("surge_added_mass", "mass_offset", "lateral_cg", "thruster_arm"),
    *("battery_sag", "hull_fouling"),
)
"""Static effects that no search begins with: what rollouts hardly tell from others together, and what changes a log."""
_MEASURES = ("thruster_arm",)
"""What rollouts measure the rest by: they cannot tell long arms from little inertia and damping in yaw together."""
_POLISHES = 10
"""Steps of a fit that only finds where a search begins; the kept model gets as many as it needs."""
_SPHERE = 0.5
"""Added mass of a sphere as a share of the water that it displaces, see `slender`."""
_LEAST = 3
"""Effects that seem to earn least, of which the one that does is left out."""
_ROUNDS = 3
"""Searches at most, each with weights about the model of the one before."""


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


def select(basis: Basis, say: Say) -> Selected:
    """Search the catalogue on the balance that judges a log, and weigh all candidates.

    Parameters
    ----------
    basis : what judges, and the settings
    say : told a line for each step

    Raises
    ------
    RequestError
        when the log is too short for a few blocks of rollouts.
    """
    return _on_rollouts(basis, say) if basis.rolls else _on_forces(basis, say)


def _on_forces(basis: Basis, say: Say) -> Selected:
    """Search the catalogue, then terms where named effects leave structure; rollouts may object, or judge."""
    weak, search, free = basis.forces, basis.instant, None
    nominal, seed = basis.nominal, basis.settings.seed
    if basis.settings.refit and not weak.claimed:
        free = freed(weak, nominal, basis.pool, basis.settings.search)
        say(free.sentence)
        search = Search(weak, nominal, free.pool, basis.settings.search)
    pool = search.pool
    rehearsal = rehearse(search, nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    say(identify(search, nominal, search.nuisances, plausible).sentence)
    say(Stage("searching the catalogue of effects", SEARCHING))
    state = search.again(search.run(progress=say), say)
    if leaves_structure(search, state):
        say(Stage("named effects leave structure: looking for terms that nobody has named"))
        search, state = _with_terms(weak, search, state, say)
    state = in_plain_words(search, state)
    if basis.sensed and leaves_structure(search, state):
        # What no model explains is no white noise, and the names of such a model are those of stand-ins.
        weak.forget()
        rolling = basis.rolling(LEAVES)
        if _long_enough(rolling):
            say(rolling.why)
            return _on_rollouts(rolling, say)
    say(Stage("weighing the evidence", WEIGHING))
    if search.pool != pool:
        rehearsal = rehearse(search, nominal, search.nuisances)
        plausible = plausible_amounts(search, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    weak.forget()
    hand_back()
    evidence = with_faint(search, state, known, weigh(search, state, seed, known), seed)
    hand_back()
    kept = tuple(e.key for e in evidence if e.sure)
    if kept and not weak.claimed:
        corrected = search.restrict(state, kept).vehicle
        # A force balance can ask for effects that wreck predictions; then none of them is called missing.
        if worse_as_a_whole(weak.motions, base(search, state), corrected):
            evidence = [replace(e, rollouts_object=e.selected) for e in evidence]
    return Selected(
        basis,
        weak.motions,
        search,
        state,
        tuple(evidence),
        known,
        plausible,
        rehearsal,
        (search, state),
        notes=basis.told,
        free=free,
    )


def _long_enough(rolling: Basis) -> bool:
    """Whether a log has rollouts enough to judge by."""
    try:
        rolling.balance()
    except RequestError:
        return False
    return True


def _on_rollouts(basis: Basis, say: Say) -> Selected:
    """Search with weights that follow the model that was found, and drop what cannot be told from nothing."""
    nominal, seed = basis.nominal, basis.settings.seed
    for note in basis.notes:
        say(note)
    pool, free = basis.pool, None
    if basis.settings.refit:
        free = freed(basis.cleared_forces(), nominal, pool, basis.settings.search)
        pool = free.pool
    seen, unseen = part_by_sight(slender(pool, nominal), basis.blind)
    unseen = [c for c in (*unseen, *seen) if c in unseen or c.key in _MEASURES]
    seen = [c for c in seen if c not in unseen]
    unseen = [c for c in unseen if not c.nuisance]
    if free is not None:
        free = free.seen(seen)
        say(free.sentence)
    form = basis.balance()
    basis.forces.forget()  # rollouts judge from here on
    settings = replace(basis.settings.search, refinements=_REFINEMENTS)
    search = Search(form, nominal, seen, settings)
    say(Stage("searching the catalogue of effects on open-loop rollouts", SEARCHING))
    state = _best_of(search, list(_starts(search, basis.settings.shooting)), say)
    for _ in range(_ROUNDS - 1):
        form = form.refreshed(state.vehicle)
        search = Search(form, nominal, seen, settings)
        again = search.run(start=state, progress=say)
        same = set(again.active) == set(state.active)
        state = again
        if same:
            break
    state = lean(search, state)
    rehearsal = rehearse(search, nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    say(Stage("weighing the evidence", WEIGHING))
    evidence = modest(weigh(search, state, seed, known), form)
    nothing = np.zeros(3)
    evidence += [Evidence(c.key, c.kind, False, 0.0, nothing, 0.0, 0.0, (), False, dormant=True) for c in unseen]
    forces = Search(basis.cleared_forces(), nominal, seen, replace(settings, refinements=0))
    return Selected(
        basis,
        basis.motions,
        search,
        state,
        tuple(evidence),
        known,
        plausible,
        rehearsal,
        (forces, forces.evaluate(state.vehicle, state.active)),
        tuple(unseen),
        (*basis.told, *disagreements(form, nominal, state.vehicle)),
        free,
    )


def base(search: Search, state: State) -> Vehicle:
    """The model without any effect: the nominal one, calibrated where its parameters are free."""
    return search.restrict(state, ()).vehicle if search.nuisances else search.nominal


def _with_terms(weak: WeakForm, named: Search, state: State, say: Say) -> tuple[Search, State]:
    """Search again with a sparse shortlist of unnamed terms, from the named model and from nothing; keep the better.

    Terms that move much like a chosen one then join, so that a term is not blamed where its twin would do as well.
    """
    nominal = named.nominal
    taken = {s for c in named.pool if c.nuisance for s in c.symbols}

    def widened(symbols: Iterable[str]) -> Search:
        terms = [term_candidate(s, nominal) for s in dict.fromkeys(symbols) if s not in taken]
        return Search(weak, nominal, (*named.pool, *terms), named.settings)

    symbols = [*shortlist(weak, base(named, state)), *shortlist(weak, state.vehicle)]
    search = widened(symbols)
    found = [search.run(start=state, progress=say), search.run(progress=say)]
    best = min(found, key=lambda s: s.score)
    alike = [s for s in twins(weak, best.vehicle, search.of_kind(best.active, Kind.TERM)) if s not in taken]
    if not alike:
        return search, best
    search = widened([*symbols, *alike])
    return search, search.run(start=best, progress=say)


def _best_of(search: Search, starts: Sequence[State], say: Say) -> State:
    """The best model that searches from some others end at; what all but the first say is told after them."""

    def run(number: int) -> tuple[State, list[str]]:
        lines: list[str] = []
        return search.run(starts[number], lines.append if number else say), lines

    found = shared(run, range(len(starts)))
    for _, lines in found:
        for line in lines:
            say(line)
    return min((state for state, _ in found), key=lambda s: s.score)


def _starts(search: Search, shooting: ShootingSettings) -> Iterator[State]:
    """Models to search from: the nominal one with what it has fitted, and that with every static effect fitted.

    A wrong nominal number bends rollouts so much that no single effect looks right beside it, and a search that begins
    there ends soon. These are polished on the rollouts first, and lose what they do not need in the search. Weaker
    thrusters and another power of thrust belong to it: either alone looks wrong without the other. One thruster is the
    measure of the rest. Added mass in surge stays out: rollouts cannot tell a heavy hull with strong thrusters from a
    light one with weak ones.
    """
    static = [c for c in static_effects(search.pool) if c.key not in _NO_START]
    fitted = [
        c
        for c in static
        if c.key == "thrust_scale"
        or c.effect.family == "mass"
        or any(search.nominal.value(p.symbol) != p.null for p in c.parameters)
    ]
    form = search.balance
    limits = {p.symbol: (p.lower, p.upper) for c in search.pool if c.kind is Kind.SENSOR for p in c.parameters}
    for group in dict.fromkeys((tuple(fitted), tuple(static))):
        symbols = [s for c in search.pool if c in group or c.fitted(()) for s in c.symbols]
        if symbols:
            begun = polish(
                form.motions, search.nominal, symbols, shooting, blind=form.blind, limits=limits, rounds=_POLISHES
            )
            yield search.evaluate(begun.vehicle, tuple(c.key for c in group))


def lean(search: Search, state: State) -> State:
    """The model without effects that earn less than it takes to tell two effects apart, the least of them first.

    A log cannot tell such an effect from nothing, and beside it others look less sure than they are.
    """
    while search.named(state.active):
        least = sorted(search.losses(state), key=lambda loss: loss.score)[:_LEAST]
        without = min((search.without(state, loss.key) for loss in least), key=lambda s: s.score)
        if without.score >= state.score + TELL_APART:
            break
        state = without
    return state


def slender(pool: Sequence[Candidate], nominal: Vehicle) -> list[Candidate]:
    """Candidates with added mass in surge held to half the hull's mass: that of a sphere, and a hull is longer.

    Nothing else keeps a hull from growing heavy together with its thrusters (Lamb 1932, article 114: at most 1/2).
    """
    found = []
    for c in pool:
        limited = tuple(replace(p, lower=-_SPHERE * nominal.mass) if p.symbol == "X_udot" else p for p in c.parameters)
        found.append(replace(c, parameters=limited))
    return found
