"""Selection of effects: a search on the force balance where its residual is white noise, on rollouts elsewhere.

Search, evidence and look-alikes are the same on both. A force balance may leave structure for unnamed terms. Rollouts
begin at several models, are weighted by the model found, and lose what cannot be told from nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..measurements.statistics.processors import parallel_map
from ..physics.errors import RequestError
from ..physics.motion import AXES, Motion
from ..physics.presentation import listing, words
from ..physics.stage import SEARCHING, WEIGHING, Say, Stage, trim_memory
from ..physics.vehicle import Vehicle
from .balance.base import Balance
from .balance.shooting import ShootingSettings
from .balance.weak_form import WeakForm
from .basis import LEAVES, Basis, DiscoverySettings
from .calibration.before_calibration import FreeParameters, free_parameters
from .candidates.candidate import Candidate, Kind, at_limit
from .candidates.unnamed_terms import find_twins, shortlist, term_candidate
from .evidence.unexplained import add_faint_structure
from .evidence.weighing import Evidence, assess_candidates, in_place_of, limit_confidence
from .identifiability.identifiable_effects import identify
from .identifiability.rehearsal import Identifiability, Rehearsal, plausible_amounts, rehearse
from .search.estimation import polish
from .search.floating import Search, State, difference, static_effects
from .search.rival_explanations import as_common_scale, has_residual_structure
from .search.scoring import TELL_APART


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
    beyond_terms : all terms at once leave structure beside its names, so that no few of them were searched for
    """

    basis: Basis
    search: Search
    state: State
    free: FreeParameters | None = None
    rehearsal: Rehearsal | None = None
    rolling: Basis | None = None
    beyond_terms: bool = False

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


def disagreements(form: Balance, nominal: Vehicle, corrected: Vehicle) -> list[str]:
    """Sentences on logs in which rollouts of the corrected model are worse than the nominal model's on some axis.

    Parameters
    ----------
    form : what judges, of one or several logs
    nominal, corrected : the models before and after
    """
    sources = form.sources
    if len(set(sources)) < 2:
        return []
    before, after = form.squares(nominal), form.squares(corrected)
    notes = []
    for source in dict.fromkeys(sources):
        rows = np.array([s == source for s in sources])
        was, now = (np.sqrt(x[rows].mean(axis=0)) for x in (before, after))
        worse = [
            f"{name} {b:.2f} instead of {a:.2f} {unit}"
            for name, a, b, unit, level in zip(AXES, was, now, form.unit, np.sqrt(after.mean(axis=0)), strict=True)
            if b > 1.2 * a and b > level
        ]
        if worse:
            notes.append(f"{_name(source)} disagrees with the other logs: rollout error {', '.join(worse)}")
    return notes


def _name(source: str) -> str:
    return source.replace("\\", "/").rsplit("/", 1)[-1]


_REFINEMENTS = 3
"""Times that columns are taken anew about the model that was found: each costs linearised rollouts of the whole log."""
_NO_START = (
    *("surge_added_mass", "mass_offset", "lateral_cg", "thruster_arm"),
    *("battery_sag", "hull_fouling"),
)
"""Static effects that no search begins with: what rollouts hardly tell from others together, and what changes a log."""
_POLISHES = 10
"""Steps of a fit that only finds where a search begins; the kept model gets as many as it needs."""
_SPHERE = 0.5
"""Added mass of a sphere as a share of the water that it displaces, by potential theory (Lamb 1932, article 114)."""
_LEAST = 3
"""Effects that seem to earn least that are tried in full, of which the one that does is left out."""
_ROUNDS = 3
"""Searches at most, each with weights about the model of the one before: each costs time."""


def search_on_rollouts(basis: Basis, say: Say) -> SearchResult:
    """Search with weights that follow the model that was found, and drop what cannot be told from nothing."""
    nominal, seed = basis.nominal, basis.settings.seed
    for note in basis.notes:
        say(note)
    pool, free = basis.pool, None
    if basis.settings.refit:
        free = free_parameters(basis.cleared_forces(), nominal, pool, basis.settings.search)
        pool = free.pool
    every = limit_surge_added_mass(pool, nominal)
    seen = [c for c in every if basis.judges(c)]
    unseen = [c for c in every if not c.nuisance and not basis.judges(c)]
    if free is not None:
        free = free.seen(seen)
        say(free.sentence)
    form = basis.balance()
    basis.forces.forget()  # rollouts judge from here on
    say(Stage("searching the catalogue of effects on open-loop rollouts", SEARCHING))
    search, whole, state = _search_rollouts(form, nominal, seen, basis.settings, say)
    limited: list[Candidate] = []
    first = search.named(state.active)
    while here := [
        c for c in search.pool if c.key in search.named(state.active) and at_limit(c, nominal, state.vehicle)
    ]:
        # What stands beside a number that is a limit's and not the log's rests on it: the rest is searched without.
        say(Stage(f"trying without {listing([words(c.key) for c in here])}: the log asks for more than physics allows"))
        limited += here
        seen = [c for c in seen if c not in limited]
        search, whole, state = _search_rollouts(form, nominal, seen, basis.settings, say)
    form = search.balance
    told_apart = [*seen, *limited]  # a manoeuvre may tell what stands at a limit from what stands in its place
    asked = Search(form, nominal, told_apart, search.settings) if limited else search
    rehearsal = rehearse(asked, nominal, asked.nuisances)
    plausible = plausible_amounts(asked, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    say(Stage("weighing the evidence", WEIGHING))
    evidence = limit_confidence(assess_candidates(search, state, seed, known), form)
    if limited:
        rivals = tuple(c.key for c in limited)
        new = {*search.named(whole.active)} - {*first}
        evidence = [in_place_of(e, rivals) if e.key in new else e for e in evidence]
    nothing = np.zeros(3)
    unseen += limited
    evidence += [
        Evidence(c.key, c.kind, False, 0.0, nothing, 0.0, 0.0, (), at_limit=c in limited, unjudged=c not in limited)
        for c in unseen
    ]
    forces = Search(basis.cleared_forces(), nominal, told_apart, replace(basis.settings.search, refinements=0))
    return SearchResult(
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
        (*basis.remarks, *disagreements(form, nominal, state.vehicle)),
        free,
        tuple(key for key in search.named(whole.active) if key not in state.active),
    )


def _search_rollouts(
    form: Balance, nominal: Vehicle, pool: Sequence[Candidate], settings: DiscoverySettings, say: Say
) -> tuple[Search, State, State]:
    """Search from each start, then on with weights about the model that was found, until the names stay.

    The search, the model that it ended with, and that without what cannot be told from nothing.
    """
    how = replace(settings.search, refinements=_REFINEMENTS)
    search = Search(form, nominal, pool, how)
    state = search.best_of([None, *_starts(search, settings.shooting)], say)
    for _ in range(_ROUNDS - 1):
        form = form.refreshed(state.vehicle)
        search = Search(form, nominal, pool, how)
        before, state = state, search.run(start=state, progress=say)
        if set(before.active) == set(state.active):
            break
    return search, state, prune_weak(search, as_common_scale(search, state))


def _starts(search: Search, shooting: ShootingSettings) -> Iterator[State]:
    """Models to search from, beside the nominal one: that with what it has fitted, and with every static effect fitted.

    A wrong nominal number bends rollouts so much that no single effect looks right beside it, and a search that begins
    there ends soon; one that begins with many effects may end where several stand for one. These are polished on the
    rollouts first, and lose what they do not need in the search. Weaker thrusters and another power of thrust belong to
    it: either alone looks wrong without the other. One thruster is the measure of the rest. Added mass in surge stays
    out: rollouts cannot tell a heavy hull with strong thrusters from a light one with weak ones.
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
            begun = polish(form.motions, search.nominal, symbols, shooting, limits=limits, rounds=_POLISHES)
            yield search.evaluate(begun.vehicle, tuple(c.key for c in group))


def prune_weak(search: Search, state: State) -> State:
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


def limit_surge_added_mass(pool: Sequence[Candidate], nominal: Vehicle) -> list[Candidate]:
    """Candidates with added mass in surge held to half the hull's mass: that of a sphere, and a hull is longer.

    Nothing else keeps a hull from growing heavy together with its thrusters (Lamb 1932, article 114: at most 1/2).
    """
    result = []
    for c in pool:
        limited = tuple(replace(p, lower=-_SPHERE * nominal.mass) if p.symbol == "X_udot" else p for p in c.parameters)
        result.append(replace(c, parameters=limited))
    return result


def select(basis: Basis, say: Say) -> SearchResult:
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
    return search_on_rollouts(basis, say) if basis.uses_rollouts else finish(search_forces(basis, say), say)


def search_forces(basis: Basis, say: Say) -> ForceFit:
    """Search the catalogue on the force balance of a log, and say whether rollouts must judge it for all that.

    Where names leave structure, terms are looked for, too; what leaves structure for all that, in a log that is long
    enough for rollouts, these judge. Where even all terms of the shortlist at once leave it, no sparse few of them are
    searched for.
    """
    first = _search(basis, say)
    search, state = first.search, first.state
    if has_residual_structure(search, state):
        say(Stage("named effects leave structure: looking for terms that nobody has named"))
        taken = {s for c in search.pool if c.nuisance for s in c.symbols}
        vehicles = without_effects(search, state), state.vehicle
        before, after = parallel_map(partial(shortlist, basis.forces), vehicles)
        symbols = [s for s in dict.fromkeys([*before, *after]) if s not in taken]
        every = _with(search, symbols).evaluate(state.vehicle, (*state.active, *symbols))
        if search.leaves_more_than_slight(every.fit.in_sample):
            named = as_common_scale(search, state)
            rolling = _rolling(basis, search, named)
            if rolling is not None:
                return replace(first, state=named, rolling=rolling, beyond_terms=True)
        search, state = _with_terms(basis.forces, search, state, symbols, say)
    state = as_common_scale(search, state)
    rehearsal = first.rehearsal if search is first.search else None  # of terms, too, another is held
    return ForceFit(basis, search, state, first.free, rehearsal, _rolling(basis, search, state))


def finish(fit: ForceFit, say: Say) -> SearchResult:
    """The candidates weighed beside what the force balance found, or, where rollouts must judge, searched on these."""
    if fit.rolling is None:
        return _assess(fit, say)
    say(fit.rolling.why)
    return search_on_rollouts(fit.rolling, say)


def search_of(basis: Basis) -> tuple[Search, FreeParameters | None]:
    """The search on the force balance of a log, and what of the file's numbers is fitted in all its models."""
    weak = basis.forces
    if not basis.settings.refit or weak.claimed:
        return basis.force_search, None
    free = free_parameters(weak, basis.nominal, basis.pool, basis.settings.search)
    return Search(weak, basis.nominal, free.pool, basis.settings.search), free


def _search(basis: Basis, say: Say) -> ForceFit:
    """Search the catalogue on a force balance."""
    search, free = search_of(basis)
    if free is not None:
        say(free.sentence)
    rehearsal = rehearse(search, basis.nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    say(identify(search, basis.nominal, search.nuisances, plausible).sentence)
    say(Stage("searching the catalogue of effects", SEARCHING))
    return ForceFit(basis, search, search.run(progress=say), free, rehearsal)


def _assess(found: ForceFit, say: Say) -> SearchResult:
    """All candidates weighed beside what a force balance found."""
    basis, search, state = found.basis, found.search, found.state
    weak, nominal, seed = basis.forces, basis.nominal, basis.settings.seed
    say(Stage("weighing the evidence", WEIGHING))
    rehearsal = found.rehearsal or rehearse(search, nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    weak.forget()
    trim_memory()
    evidence = add_faint_structure(search, state, known, assess_candidates(search, state, seed, known), seed)
    trim_memory()
    return SearchResult(
        basis,
        weak.motions,
        search,
        state,
        tuple(evidence),
        known,
        plausible,
        rehearsal,
        (search, state),
        notes=basis.remarks,
        free=found.free,
    )


def without_terms(looked: SearchResult, unsure: Sequence[str], say: Say) -> SearchResult | None:
    """The candidates weighed anew beside a model of a force balance with fewer terms; None where it needs them all.

    Of terms that cancel one another where the log has been, other turns would make a force that never was: of models
    that do as well the one with the fewest of them predicts best elsewhere (Hastie, Tibshirani and Friedman 2009,
    section 7.10).

    Parameters
    ----------
    unsure : terms that may go, in the order in which they are tried: each does while less than `materiality` of the
        nominal model's squared error comes back on every axis, as much as decides which model is written
    """
    search, state = looked.search, looked.state
    for key in unsure:
        less = search.without(state, key)
        lost = (less.fit.held_out - looked.state.fit.held_out) / np.maximum(search.nominal_error, 1e-300)
        if lost.max() < search.settings.materiality:
            state = less
    if state is looked.state:
        return None
    say(Stage(difference(looked.state.active, state.active)))
    return _assess(ForceFit(looked.basis, search, state, looked.free, looked.rehearsal), say)


def _rolling(basis: Basis, search: Search, state: State) -> Basis | None:
    """The basis by which rollouts judge a log of sensors that a model leaves structure of; None where it leaves none.

    None as well for a log that has too few rollouts, and where what is left is slight beside the force at work: a
    record of commands that is late by half a step leaves as much. What no model explains is no white noise, and the
    names of such a model are those of stand-ins.
    """
    left = search.leaves_more_than_slight(state.fit.held_out)
    if not left or not basis.has_sensor_noise or not has_residual_structure(search, state):
        return None
    basis.forces.forget()
    rolling = basis.with_rollouts(LEAVES, state.vehicle)
    try:
        rolling.balance()
    except RequestError:
        return None
    return rolling


def _with(search: Search, symbols: Sequence[str]) -> Search:
    """A search with unnamed terms among its candidates."""
    terms = [term_candidate(symbol, search.nominal) for symbol in symbols]
    return Search(search.balance, search.nominal, (*search.pool, *terms), search.settings)


def _with_terms(weak: WeakForm, named: Search, state: State, symbols: Sequence[str], say: Say) -> tuple[Search, State]:
    """Search again with a sparse shortlist of unnamed terms, from the named model and from nothing; keep the better.

    Terms that move much like a chosen one then join, so that a term is not blamed where its twin would do as well.
    """
    search = _with(named, symbols)
    best = search.best_of((state, None), say)
    terms = [c for c in search.pool if c.kind is Kind.TERM and c.key in best.active]
    taken = {s for c in named.pool if c.nuisance for s in c.symbols}
    alike = [s for s in find_twins(weak, best.vehicle, terms) if s not in {*taken, *symbols}]
    if not alike:
        return search, best
    search = _with(named, [*symbols, *alike])
    return search, search.run(start=best, progress=say)
