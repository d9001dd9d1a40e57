"""Discovery on field logs: rollouts decide where the force balance errs by more than white noise.

The same search, evidence and lawful refit as on the weak form, on the balance of multiple shooting. Nuisances of the
sensors are taken away first, and weights follow the model that was found.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..physics.frames import AXES
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .evidence import Evidence, weigh
from .identifiability import Identifiability, identify
from .nuisance import nuisances, part_by_sight
from .options import Candidate, candidates
from .refit import Freed, freed
from .rehearsal import Rehearsal, plausible_amounts, rehearse
from .search import Search, SearchSettings, State
from .shooting import Shooting, ShootingSettings
from .weak import WeakForm, WeakSettings

_ROUNDS = 3
"""Searches at most, each with weights about the model of the one before."""


@dataclass(frozen=True, slots=True)
class Found:
    """What the search on rollouts found, for `discover` to conclude from.

    Attributes
    ----------
    motions : without the sensors' nuisances
    search, state : the search on rollouts, and the model that it ended with
    known : what the log can show and tell apart
    plausible, rehearsal : amounts and trials for the advice
    unseen : candidates that the log cannot judge because an axis is blind
    notes : what was done to the log, in words
    free : what is calibrated in every model, if anything
    """

    motions: tuple[Motion, ...]
    search: Search
    state: State
    known: Identifiability
    plausible: dict[str, tuple[float, ...]]
    rehearsal: Rehearsal | None
    unseen: tuple[Candidate, ...]
    notes: tuple[str, ...]
    free: Freed | None = None

    def forces(self) -> tuple[Search, State]:
        """The same model on the weak form, nothing fitted again: forces [N, N, N m], for the advice and the report."""
        search = self.search
        settings = replace(search.settings, refinements=0)
        weak = Search(WeakForm(self.motions, WeakSettings()), search.nominal, search.pool, settings)
        return weak, weak.evaluate(self.state.vehicle, self.state.active)


def search_on_rollouts(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: SearchSettings,
    shooting: ShootingSettings,
    say: Callable[[str], None],
    refit: bool = False,
) -> Found:
    """Search the catalogue on open-loop rollouts of motions that are cleared of nuisances.

    Parameters
    ----------
    refit : True to calibrate the parameters of the nominal model in every model

    Raises
    ------
    RequestError
        when the log is too short for a few blocks of rollouts.
    """
    clear = nuisances(motions)
    for note in clear.notes:
        say(note)
    pool, free = candidates(nominal), None
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
    notes = (*clear.notes, *_disagreements(form, nominal, state.vehicle))
    return Found(clear.motions, search, state, known, plausible, rehearsal, tuple(unseen), notes, free)


def weigh_on_rollouts(found: Found, seed: int) -> list[Evidence]:
    """Evidence for every candidate; those that a blind axis hides are dormant."""
    evidence = weigh(found.search, found.state, seed, found.known)
    nothing = np.zeros(3)
    return evidence + [Evidence(c.key, False, 0.0, nothing, 0.0, 0.0, (), False, dormant=True) for c in found.unseen]


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
