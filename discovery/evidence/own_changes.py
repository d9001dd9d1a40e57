"""Whether an effect's own force changes at some time, or with the motion, more than the noise of the log would show.

A propeller that is hit half way is a weak thruster on the mean, and what is left has the colour of its own thrust:
copies of that change as much. So the noise is what is left beside the change itself, and a change counts that no copy
of this noise has (a break at an unknown time; Andrews 1993). This is asked of the force balance whatever judged the
log: rollouts know the size of an effect in a part of a log far too badly.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..balance.base import Balance
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Kind
from ..candidates.free_forms import FINE, onsets, places
from ..search.floating import Search, State
from ..search.noise_copies import NoiseCopies
from .invariance import regions
from .rest_beside_forms import FormColumns, RestBesideForms

_LEAST = 0.1
"""Share of itself below which a change is none that is worth a word."""


class _Part(NamedTuple):
    """A part of a log, as the beginning of a sentence, and which tests belong to it."""

    name: str
    tests: NDArray[np.bool_]


def own_changes(search: Search, state: State, kept: Sequence[str], seed: int, judge: Balance) -> dict[str, str]:
    """In which part of the log each effect's force differs, and by how much, as a sentence; those that keep it, not.

    Parameters
    ----------
    search : on the force balance
    state : the model with everything that was selected, sure or not
    kept : effects in question
    seed : of the copies of the noise
    judge : the balance that judged them; an axis to which it is blind is not looked at
    """
    seen = ~(search.quiet | np.array(judge.blind))
    asked = {c.key for c in search.pool if c.kind is Kind.EFFECT and not c.effect.general}
    parts = list(_parts(search))
    there = [key for key in kept if key in state.active and key in asked]
    if not there or not seen.any():
        return {}
    rest = RestBesideForms(FormColumns(search, state, seen))
    copies, tests = NoiseCopies(search.balance, state.vehicle, seed), np.stack([part.tests for part in parts])
    found = {}
    for key in there:
        change = rest.own_change(key, tests, _LEAST, copies)
        if change is not None and change.worth > change.chance:
            where, more = parts[change.part].name, "more" if change.share > 0.0 else "less"
            found[key] = f"{where[0].upper()}{where[1:]} it is {100.0 * abs(change.share):.0f} % {more} than elsewhere."
    return found


def _parts(search: Search) -> Iterator[_Part]:
    """What begins at some time, and the parts of a log that are told apart by the motion."""
    weak = search.balance
    assert isinstance(weak, WeakForm), "an effect's own force is that on the force balance"
    minutes = weak.average([m.minutes[:, None] for m in weak.motions])[:, 0]
    for told, begun in onsets(minutes, FINE):
        yield _Part(told, begun)
    for told, there in places(minutes, weak.average([m.position for m in weak.motions]).T):
        yield _Part(told, there)
    for region in regions(search):
        yield _Part(f"where the boat is {region.names[0]}", region.tests)
