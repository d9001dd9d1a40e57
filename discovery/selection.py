"""What a search looks at and keeps: on the force balance where noise is white, on rollouts elsewhere.

Search, evidence and look-alikes are the same on forces and on rollouts. What differs is where a search begins, and what
is tried after it: a force balance may leave structure for terms that nobody has named; rollouts are weighed by the
model that was found, and lose what cannot be told from nothing.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..physics.errors import RequestError
from ..physics.freed_memory import hand_back
from ..physics.stage import SEARCHING, WEIGHING, Say, Stage
from .balance.rollout_test import worse_as_a_whole
from .balance.weak_form import WeakForm
from .basis import LEAVES, Basis, unexplained
from .calibration.beside_effects import freed
from .candidates.candidate import Kind
from .candidates.unnamed_terms import shortlist, term_candidate, twins
from .evidence.quiet_axes import with_faint
from .evidence.weighing import weigh
from .identifiability.identifiable_effects import identify
from .identifiability.rehearsal import plausible_amounts, rehearse
from .rollout_selection import on_rollouts
from .search.command_resolution import coarse_records, leaves_structure
from .search.equivalent_thruster_scales import in_plain_words
from .search.floating import Search, State
from .selected import Selected, Unsettled, base


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
    return Selection(basis, say).selected


class Selection:
    """What is selected of a log; what rollouts select is made when it is asked for, see `select`.

    Attributes
    ----------
    settled, unsettled : what the force balance found, where it was asked: one of the two
    basis : what judges
    say : told a line for each step
    thorough : a log that no forces explain is searched to its end on them all the same, for who compares what is left
    """

    def __init__(self, basis: Basis, say: Say, *, thorough: bool = False) -> None:
        found = None if basis.rolls else _on_forces(basis, say, thorough)
        self.settled = found if isinstance(found, Selected) else None
        self.unsettled = found if isinstance(found, Unsettled) else None
        self.basis = self.unsettled.rolling if self.unsettled else basis
        self.say = say

    @cached_property
    def selected(self) -> Selected:
        """By whichever judges."""
        if self.settled:
            return self.settled
        if self.unsettled:
            self.say(self.basis.why)
        return on_rollouts(self.basis, self.say)

    @property
    def explained(self) -> bool:
        """Whether forces leave nothing of the log."""
        return self.settled is not None and not leaves_structure(self.settled.search, self.settled.state)


def _on_forces(basis: Basis, say: Say, thorough: bool) -> Selected | Unsettled:
    """Search the catalogue on a force balance, then terms where named effects leave structure; rollouts may object.

    Where structure is left for all that, in a log that is long enough for rollouts, nothing is weighed.
    """
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
    state = search.run(progress=say)
    if not thorough and _beyond_all(basis, search, state):
        unsettled = _unsettled(basis, search, state)
        if unsettled:
            return unsettled
    state = search.again(state, say)
    if leaves_structure(search, state):
        say(Stage("named effects leave structure: looking for terms that nobody has named"))
        search, state = _with_terms(weak, search, state, say)
    state = in_plain_words(search, state)
    unsettled = _unsettled(basis, search, state)
    if unsettled:
        return unsettled
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


def _beyond_all(basis: Basis, search: Search, state: State) -> bool:
    """Whether all forces together would leave structure of a log, too, not only a model.

    Not asked of a log that is too short to say so, nor where a coarse record of the commands may leave it.
    """
    if not basis.sensed or not leaves_structure(search, state) or coarse_records(basis.forces.motions):
        return False
    bound = unexplained(basis.forces, search)
    return bound.plenty and search.leaves_structure(np.square(bound.error))


def _unsettled(basis: Basis, search: Search, state: State) -> Unsettled | None:
    """A model that explains no log of sensors, where that has rollouts enough to judge by; else None.

    What no model explains is no white noise, and the names of such a model are those of stand-ins.
    """
    if not basis.sensed or not leaves_structure(search, state):
        return None
    basis.forces.forget()
    rolling = basis.rolling(LEAVES)
    try:
        rolling.balance()
    except RequestError:
        return None
    return Unsettled(rolling, search, state)


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
