"""What a search looks at and keeps: on the force balance where noise is white, on rollouts elsewhere.

Search, evidence and look-alikes are the same on forces and on rollouts. What differs is where a search begins, and what
is tried after it: a force balance may leave structure for terms that nobody has named; rollouts are weighed by the
model that was found, and lose what cannot be told from nothing.
"""

from collections.abc import Iterable
from functools import cached_property, partial

from ..measurements.statistics.second_processor import shared
from ..physics.errors import RequestError
from ..physics.freed_memory import hand_back
from ..physics.stage import SEARCHING, WEIGHING, Say, Stage
from .balance.weak_form import WeakForm
from .basis import LEAVES, Basis, beside_few, plenty
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
from .selected import Found, Selected, Unsettled, base

_FEW = 6
"""Forces on each axis beside what is calibrated: of 240 logs in which the catalogue holds what is hidden, up to three
effects, none was left structure by its first search and by these; a hundred columns explain nearly any log."""


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
    """What is selected of a log, in steps that are taken when they are asked for, see `select`.

    Parameters
    ----------
    basis : what judges until forces turn out to explain too little
    say : told a line for each step
    thorough : terms are looked for even where few forces leave structure, for who compares what is left

    Attributes
    ----------
    given : the basis that it began with
    """

    def __init__(self, basis: Basis, say: Say, *, thorough: bool = False) -> None:
        self.given, self.say, self._thorough = basis, say, thorough

    @cached_property
    def first(self) -> Found | None:
        """Where the first search of the catalogue on the force balance ends, where that is asked."""
        return None if self.given.rolls else _searched(self.given, self.say)

    @cached_property
    def _searched_on(self) -> Found | Unsettled | None:
        return self.first and _on_forces(self.first, self.say, self._thorough)

    def search_on(self) -> None:
        """Search on from there, ahead of who asks for it."""
        _ = self._searched_on

    @property
    def settled(self) -> Found | None:
        """What the force balance found, where it was asked and settles it."""
        return self._searched_on if isinstance(self._searched_on, Found) else None

    @property
    def unsettled(self) -> Unsettled | None:
        """The same where it was asked and rollouts must judge."""
        return self._searched_on if isinstance(self._searched_on, Unsettled) else None

    @property
    def basis(self) -> Basis:
        """What judges in the end."""
        return self.unsettled.rolling if self.unsettled else self.given

    @cached_property
    def selected(self) -> Selected:
        """By whichever judges, weighed."""
        if self.settled:
            return _weighed(self.settled, self.say)
        if self.unsettled:
            self.say(self.basis.why)
        return on_rollouts(self.basis, self.say)

    @property
    def found(self) -> Found | Selected:
        """The same, weighed where that comes with it."""
        return self.settled or self.selected


def _searched(basis: Basis, say: Say) -> Found:
    """Search the catalogue on a force balance."""
    weak, search, free = basis.forces, basis.instant, None
    if basis.settings.refit and not weak.claimed:
        free = freed(weak, basis.nominal, basis.pool, basis.settings.search)
        say(free.sentence)
        search = Search(weak, basis.nominal, free.pool, basis.settings.search)
    rehearsal = rehearse(search, basis.nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    say(identify(search, basis.nominal, search.nuisances, plausible).sentence)
    say(Stage("searching the catalogue of effects", SEARCHING))
    return Found(basis, search, search.run(progress=say), free, rehearsal)


def _on_forces(first: Found, say: Say, thorough: bool) -> Found | Unsettled:
    """Search again without each name where a first search explains a log, and for terms where names leave structure.

    Of a log without noise, which rollouts never judge, names that leave structure are searched again, too, unless a few
    forces leave some. What leaves structure for all that, in a log that is long enough for rollouts, is not settled.
    """
    basis, search, state = first.basis, first.search, first.state
    beyond = not thorough and _beyond_few(first)
    unsettled = _unsettled(basis, search, state) if beyond else None
    if unsettled:
        return unsettled
    if first.explains or not (beyond or basis.sensed):
        state = search.again(state, say)
    if leaves_structure(search, state):  # a model of fewer names may, where the first left none
        say(Stage("named effects leave structure: looking for terms that nobody has named"))
        search, state = _with_terms(basis.forces, search, state, say)
    state = in_plain_words(search, state)
    rehearsal = first.rehearsal if search is first.search else None  # of terms, too, another is held
    return _unsettled(basis, search, state) or Found(basis, search, state, first.free, rehearsal)


def _weighed(found: Found, say: Say) -> Selected:
    """All candidates weighed beside what a force balance found."""
    basis, search, state = found.basis, found.search, found.state
    weak, nominal, seed = basis.forces, basis.nominal, basis.settings.seed
    say(Stage("weighing the evidence", WEIGHING))
    rehearsal = found.rehearsal or rehearse(search, nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    weak.forget()
    hand_back()
    evidence = with_faint(search, state, known, weigh(search, state, seed, known), seed)
    hand_back()
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
        free=found.free,
    )


def _beyond_few(first: Found) -> bool:
    """Whether the few forces that explain most of a log, free on each axis, would leave structure of it, too.

    Not asked of a log that is too short to say so, nor where a coarse record of the commands may leave it.
    """
    basis, search = first.basis, first.search
    if not plenty(basis.forces) or coarse_records(basis.forces.motions) or first.explains:
        return False
    return search.leaves_structure(beside_few(basis.forces, search, _FEW))


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

    before, after = shared(partial(shortlist, weak), (base(named, state), state.vehicle))
    symbols = [*before, *after]
    search = widened(symbols)
    best = search.best_of((state, None), say)
    alike = [s for s in twins(weak, best.vehicle, search.of_kind(best.active, Kind.TERM)) if s not in taken]
    if not alike:
        return search, best
    search = widened([*symbols, *alike])
    return search, search.run(start=best, progress=say)
