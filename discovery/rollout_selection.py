"""What a search on rollouts looks at and keeps, where the force balance leaves more than white noise.

It begins at several models, is weighed by the model that was found, and loses what cannot be told from nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..physics.stage import SEARCHING, WEIGHING, Say, Stage
from ..physics.vehicle import Vehicle
from .balance.shooting import ShootingSettings
from .basis import Basis
from .calibration.beside_effects import freed
from .candidates.candidate import Candidate, Kind, part_by_sight
from .evidence.disagreements import disagreements
from .evidence.weighing import TELL_APART, Evidence, modest, weigh
from .identifiability.identifiable_effects import identify
from .identifiability.rehearsal import plausible_amounts, rehearse
from .search.floating import Search, State, static_effects
from .search.output_error import polish
from .selected import Selected

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


def on_rollouts(basis: Basis, say: Say) -> Selected:
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
    state = search.best_of(list(_starts(search, basis.settings.shooting)), say)
    for _ in range(_ROUNDS - 1):
        form = form.refreshed(state.vehicle)
        search = Search(form, nominal, seen, settings)
        again = search.run(start=state, progress=say)
        same = set(again.active) == set(state.active)
        state = again
        if same:
            break
    state, whole = lean(search, state), state
    rehearsal = rehearse(search, nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    say(Stage("weighing the evidence", WEIGHING))
    evidence = modest(weigh(search, state, seed, known), form)
    nothing = np.zeros(3)
    evidence += [Evidence(c.key, c.kind, False, 0.0, nothing, 0.0, 0.0, (), dormant=True) for c in unseen]
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
        tuple(key for key in search.named(whole.active) if key not in state.active),
    )


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
