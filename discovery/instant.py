"""Discovery on logs whose noise is white: the force balance is searched instant by instant; rollouts may object."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .equivalent import in_plain_words
from .evidence import weigh
from .faint import with_faint
from .identifiability import identify
from .library import shortlist, term_candidate, twins
from .looked import Looked, base
from .rehearsal import plausible_amounts, rehearse
from .rollouts import WHOLE_HORIZON, rollout_squares, rollouts_object
from .search import Search, State
from .weak import WeakForm

_STRUCTURE = 1.5
"""A force error above this many times what sensor noise explains is structure that the model leaves."""


def look_at_forces(weak: WeakForm, search: Search, seed: int, say: Callable[[str], None]) -> Looked:
    """Search the catalogue on the force balance, then terms where named effects leave structure, and weigh all.

    Parameters
    ----------
    weak : the force balance
    search : on it
    seed : of the block resamples
    """
    nominal, pool, motions = search.nominal, search.pool, weak.motions
    rehearsal = rehearse(search, nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    say(identify(search, nominal, search.nuisances, plausible).sentence)
    say("searching the catalogue of effects")
    state = search.run(progress=say)
    if leaves_structure(search, state):
        say("named effects leave structure: looking for terms that nobody has named")
        search, state = _with_terms(weak, search, state, say)
    else:
        state = search.again(state, say)
    state = in_plain_words(search, state)
    say("weighing the evidence")
    if search.pool != pool:
        rehearsal = rehearse(search, nominal, search.nuisances)
        plausible = plausible_amounts(search, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    evidence = with_faint(search, state, known, weigh(search, state, seed, known), seed)
    kept = tuple(e.key for e in evidence if e.sure)
    if kept and not weak.claimed:
        corrected = search.restrict(state, kept).vehicle
        if worse_as_a_whole(motions, base(search, state), corrected):
            evidence = [replace(e, rollouts_object=e.selected) for e in evidence]
    return Looked(motions, search, state, tuple(evidence), known, plausible, rehearsal, (search, state))


def worse_as_a_whole(motions: Sequence[Motion], nominal: Vehicle, corrected: Vehicle) -> bool:
    """True when 10 s open-loop rollouts of a corrected model are significantly worse than the nominal model's.

    A force balance can ask for effects that wreck predictions; then none of them is called missing.
    """
    before, after = (rollout_squares(motions, vehicle, WHOLE_HORIZON) for vehicle in (nominal, corrected))
    return rollouts_object(before, after)


def leaves_structure(search: Search, state: State) -> bool:
    """True when the force error on some axis is neither immaterial nor explained by sensor noise."""
    error = np.sqrt(state.fit.held_out)
    return bool((error > np.maximum(np.sqrt(search.floor), _STRUCTURE * search.noise_error)).any())


def _with_terms(weak: WeakForm, named: Search, state: State, say: Callable[[str], None]) -> tuple[Search, State]:
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
    alike = [s for s in twins(weak, best.vehicle, [key for key in best.active if ":" in key]) if s not in taken]
    if not alike:
        return search, best
    search = widened([*symbols, *alike])
    return search, search.run(start=best, progress=say)
