"""Discovery on field logs: rollouts decide where the force balance errs by more than white noise.

The same search, evidence and lawful refit as on the weak form, on the balance of multiple shooting. Nuisances of the
sensors are taken away first, and weights follow the model that was found.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..physics.frames import AXES
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .evidence import Evidence, weigh
from .identifiability import identify
from .looked import Looked
from .nuisance import nuisances, part_by_sight
from .refit import freed
from .rehearsal import plausible_amounts, rehearse
from .search import Search
from .shooting import Shooting, ShootingSettings
from .weak import WeakForm, WeakSettings

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
    seen, unseen = part_by_sight(pool, clear.blind)
    unseen = [c for c in unseen if not c.nuisance]
    if free is not None:
        free = free.seen(seen)
        say(free.sentence)
    form = Shooting(clear.motions, nominal, shooting, clear.blind)
    search = Search(form, nominal, seen, settings)
    say("searching the catalogue of effects on open-loop rollouts")
    state = search.run(progress=say)
    for _ in range(_ROUNDS - 1):
        form = form.refreshed(state.vehicle)
        search = Search(form, nominal, seen, settings)
        again = search.run(start=state, progress=say)
        same = set(again.active) == set(state.active)
        state = again
        if same:
            break
    rehearsal = rehearse(search, nominal, search.nuisances)
    plausible = plausible_amounts(search, rehearsal)
    known = identify(search, state.vehicle, state.active, plausible)
    say("weighing the evidence")
    evidence = weigh(search, state, seed, known)
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
        (*clear.notes, *_disagreements(form, nominal, state.vehicle)),
        free,
    )


def _disagreements(form: Shooting, nominal: Vehicle, corrected: Vehicle) -> list[str]:
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
