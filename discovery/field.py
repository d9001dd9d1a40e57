"""Discovery on field logs: rollouts decide where the force balance errs by more than white noise.

The same search, evidence and lawful refit as on the weak form, on the balance of multiple shooting. Nuisances of the
sensors are taken away first, and weights follow the model that was found.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..physics.frames import AXES
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .evidence import TELL_APART, Evidence, weigh
from .identifiability import identify
from .looked import Looked
from .nuisance import nuisances, part_by_sight
from .options import Candidate
from .polish import polish
from .refit import freed
from .rehearsal import plausible_amounts, rehearse
from .rollouts import rollouts_object
from .search import Search, State
from .shooting import Shooting, ShootingSettings
from .weak import WeakForm, WeakSettings

ENOUGH_BLOCKS = 5
"""Blocks of rollouts from which anything can be sure: fewer may all agree by chance in more than one of ten logs."""
TOO_SHORT = (
    "Undecided: rollouts with commands fill {blocks} independent blocks of this log, and to be sure of anything takes "
    "{enough}; give a longer log, or several together."
)
_REFINEMENTS = 3
_STATIC = ("hull", "coupling", "mass", "thruster")
_POLISHES = 10
_SPHERE = 0.5
_ROUNDS = 3
"""Searches at most, each with weights about the model of the one before."""


def look_at_rollouts(
    motions: Sequence[Motion],
    instant: Search,
    shooting: ShootingSettings,
    seed: int,
    say: Callable[[str], None],
    refit: bool = False,
) -> Looked:
    """Search the catalogue on open-loop rollouts of motions that are cleared of nuisances, and weigh all.

    Parameters
    ----------
    instant : the search on the force balance that these rollouts take the place of
    seed : of the block resamples
    refit : True to calibrate the parameters of the nominal model in every model

    Raises
    ------
    RequestError
        when the log is too short for a few blocks of rollouts.
    """
    nominal, settings = instant.nominal, instant.settings
    clear = nuisances(motions)
    for note in clear.notes:
        say(note)
    pool, free = instant.pool, None
    if refit:
        free = freed(WeakForm(clear.motions, WeakSettings()), nominal, pool, settings)
        pool = free.pool
    seen, unseen = part_by_sight(slender(pool, nominal), clear.blind)
    unseen = [c for c in unseen if not c.nuisance]
    if free is not None:
        free = free.seen(seen)
        say(free.sentence)
    form = Shooting(clear.motions, nominal, shooting, clear.blind)
    settings = replace(settings, refinements=_REFINEMENTS)
    search = Search(form, nominal, seen, settings)
    say("searching the catalogue of effects on open-loop rollouts")
    state = min((search.run(s, say) for s in _starts(search, shooting)), key=lambda s: s.score)
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
    say("weighing the evidence")
    evidence = modest(weigh(search, state, seed, known), form)
    nothing = np.zeros(3)
    evidence += [Evidence(c.key, False, 0.0, nothing, 0.0, 0.0, (), False, dormant=True) for c in unseen]
    forces = Search(WeakForm(clear.motions, WeakSettings()), nominal, seen, replace(settings, refinements=0))
    return Looked(
        clear.motions,
        search,
        state,
        tuple(evidence),
        known,
        plausible,
        rehearsal,
        (forces, forces.evaluate(state.vehicle, state.active)),
        tuple(unseen),
        (*clear.notes, *disagreements(form, nominal, state.vehicle)),
        free,
    )


def _starts(search: Search, shooting: ShootingSettings) -> Iterator[State]:
    """Models to search from: the nominal one with what it has fitted, and that with every static effect fitted.

    A wrong nominal number bends rollouts so much that no single effect looks right beside it, and a search that begins
    there ends soon. These are polished on the rollouts first, and lose what they do not need in the search. Weaker
    thrusters and another power of thrust belong to it: either alone looks wrong without the other. One thruster is the
    measure of the rest. Added mass in surge stays out: rollouts cannot tell a heavy hull with strong thrusters from a
    light one with weak ones.
    """
    first = next((c.key for c in search.pool if c.effect.per_thruster), "")
    static = [
        c
        for c in search.pool
        if c.effect.family in _STATIC
        and not (c.effect.shapes or c.effect.general or c.nuisance)
        and c.key not in ("surge_added_mass", first)
    ]
    fitted = [
        c
        for c in static
        if c.key == "thrust_scale"
        or c.effect.family == "mass"
        or any(search.nominal.value(p.symbol) != p.null for p in c.parameters)
    ]
    form = search.weak
    blind = form.blind if isinstance(form, Shooting) else (False, False, False)
    for group in dict.fromkeys((tuple(fitted), tuple(static))):
        symbols = [s for c in search.pool if c in group or c.nuisance for s in c.symbols]
        if symbols:
            begun = polish(form.motions, search.nominal, symbols, shooting, blind=blind, rounds=_POLISHES).vehicle
            yield search.evaluate(begun, tuple(c.key for c in group))


def lean(search: Search, state: State) -> State:
    """The model without effects that earn less than it takes to tell two effects apart, the least of them first.

    A log cannot tell such an effect from nothing, and beside it others look less sure than they are.
    """
    while search.named(state.active):
        without = min((search.without(state, key) for key in search.named(state.active)), key=lambda s: s.score)
        if without.score >= state.score + TELL_APART:
            break
        state = without
    return state


def modest(evidence: Sequence[Evidence], form: Shooting) -> list[Evidence]:
    """The evidence with no more confidence than a sign test's, 1 - 2^(1 - blocks): few may all agree by chance."""
    most = 1.0 - 0.5 ** int(form.block.max())
    return [replace(e, confidence=min(e.confidence, most)) for e in evidence]


def slender(pool: Sequence[Candidate], nominal: Vehicle) -> list[Candidate]:
    """Candidates with added mass in surge held to half the hull's mass: that of a sphere, and a hull is longer.

    Nothing else keeps a hull from growing heavy together with its thrusters (Lamb 1932, article 114: at most 1/2).
    """
    found = []
    for c in pool:
        limited = tuple(replace(p, lower=-_SPHERE * nominal.mass) if p.symbol == "X_udot" else p for p in c.parameters)
        found.append(replace(c, parameters=limited))
    return found


def settle(search: Search, state: State, kept: Sequence[str], shooting: ShootingSettings) -> State:
    """The model with the kept effects alone, polished; with none, where rollouts get worse with all of them."""
    final = on_rollouts(search, search.restrict(state, kept), kept, shooting)
    form = search.weak
    if not kept or not isinstance(form, Shooting):
        return final
    nothing = search.restrict(state, ())
    worse = rollouts_object(form.squares(nothing.vehicle), form.squares(final.vehicle))
    return nothing if worse else final


def on_rollouts(search: Search, state: State, kept: Sequence[str], shooting: ShootingSettings) -> State:
    """A model polished on its rollouts, where that betters its score; the same on the force balance."""
    form = search.weak
    symbols = [s for c in search.pool if c.key in kept or c.nuisance for s in c.symbols]
    if not symbols or not isinstance(form, Shooting):
        return state
    limits = {p.symbol: (p.lower, p.upper) for c in search.pool for p in c.parameters}
    polished = polish(form.motions, state.vehicle, symbols, shooting, blind=form.blind, limits=limits).vehicle
    return min((state, search.evaluate(polished, kept)), key=lambda s: s.score)


def disagreements(form: Shooting, nominal: Vehicle, corrected: Vehicle) -> list[str]:
    """Sentences on logs in which rollouts of the corrected model are worse than the nominal model's on some axis."""
    before, after = form.squares(nominal), form.squares(corrected)
    sources = form.sources
    if len(set(sources)) < 2:
        return []
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
