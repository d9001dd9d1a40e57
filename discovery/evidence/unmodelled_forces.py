"""Forces outside the catalogue: named effects refitted beside free forms, replaced by one, or changing within a log.

A name may be right about the axis and wrong about the cause. So the residual is searched by forward selection for
`free_forms`, kept where no surrogate shows as much, and each effect's change beside them is recorded (extreme bounds;
Leamer 1985). A form that explains more in the place of an effect outdoes its law (encompassing; Mizon and Richard
1986). An effect's own force is tested for a break in time or regime against copies of the noise (Andrews 1993), always
on the force balance, since rollouts know the size of an effect in part of a log badly.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..balance.base import Balance
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Candidate, Kind
from ..candidates.unnamed_terms import FINE, finer_forms, free_forms, onsets, places, several_logs
from ..findings import OtherForm
from ..search.floating import Search, State
from ..search.surrogates import NoiseCopies
from .invariance import regions
from .residual_selection import FormColumns, ResidualSelection


class FreeFormRefit(NamedTuple):
    """Refit of an effect beside the free forms, and the best single form in its place.

    Attributes
    ----------
    change : share of its force by which it changes beside the forms that the rest follows
    by : change of each of its numbers, by symbol, beside them: it widens its interval
    margin : log-likelihood by which one free force in its place explains more than it does; below nothing: less
    form : what that force follows
    """

    change: float = 0.0
    by: Mapping[str, float] = {}
    margin: float | None = None
    form: OtherForm | None = None

    @property
    def sentence(self) -> str:
        """The substitute of the effect, as the end of a sentence."""
        return f"in its place {self.form.in_words if self.form else 'one free force'} explains more"


class Substitute(NamedTuple):
    """A form in the place of an effect.

    Attributes
    ----------
    form : what it follows
    margin : log-likelihood by which it explains more than the effect does; below nothing where it explains less
    """

    form: OtherForm
    margin: float


@dataclass(frozen=True, slots=True)
class UnmodelledForces:
    """Free forms that the residual follows, and the refit of each effect beside them, by key."""

    selected: tuple[OtherForm, ...] = ()
    refits: Mapping[str, FreeFormRefit] = field(default_factory=dict)


def fit_unmodelled_forces(search: Search, state: State, kept: Sequence[str], seed: int) -> UnmodelledForces:
    """Forms that the rest of a model follows on the force balance, and what becomes of its effects beside them.

    Parameters
    ----------
    search : on the force balance
    state : the model with everything that was selected, sure or not
    kept : effects in question
    seed : of the copies of the rest
    """
    there = [key for key in kept if key in state.active]
    seen = ~search.quiet
    if not seen.any():
        return UnmodelledForces()
    weak = search.balance
    assert isinstance(weak, WeakForm), "forms are looked for on the force balance"
    columns = FormColumns(search, state, seen, free_forms(weak, state.vehicle))
    whole, rest = ResidualSelection(columns), ResidualSelection(columns)
    found = tuple(rest.select_forms(NoiseCopies(search.balance, state.vehicle, seed)))
    asked = {c.key: c for c in search.pool if c.kind is Kind.EFFECT and not c.effect.general}
    beside = {}
    for key in there:
        single = substitute_forces(columns, whole, asked[key]) if key in asked else None
        change, by = rest.change(key) if found else (0.0, {})
        beside[key] = FreeFormRefit(change, by, single.margin, single.form) if single else FreeFormRefit(change, by)
    return UnmodelledForces(found, beside)


def substitute_forces(columns: FormColumns, rest: ResidualSelection, candidate: Candidate) -> Substitute | None:
    """The form that does most in the place of an effect, on an axis where it acts; None where there is none.

    Parameters
    ----------
    columns : of the model, with all free forms
    rest : what the model leaves with the effect
    """
    weak = columns.search.balance
    assert isinstance(weak, WeakForm), "forms are looked for on the force balance"
    grows = any(p.unit.endswith("/min") for p in candidate.parameters)  # what grows may have set in at once
    letters = sorted({c for p in candidate.parameters for c in p.form if c in "uvr"})
    finer = [""] if grows else letters
    tried = [columns, *(columns.of(finer_forms(weak, columns.state.vehicle, by)) for by in finer)]
    key = candidate.key
    without = [(ResidualSelection(these, (key,)), these.no_substitutes(key)) for these in tried]
    found = [one for rest, barred in without if (one := rest.best_single_form(barred))]
    if not found:
        return None
    best = min(found, key=lambda one: one.worth)
    return Substitute(best.form, rest.log_loss - best.worth)


def rollouts_of_several_logs(judge: Balance) -> bool:
    """True when rollouts of several logs judged: what they name holds in each, and the balance of one is no witness."""
    return not judge.forces and several_logs(np.concatenate([motion.minutes for motion in judge.motions]))


_LEAST = 0.1
"""Share of itself below which a change is none that is worth a word."""


class _Part(NamedTuple):
    """A part of a log, as the beginning of a sentence, and which tests belong to it."""

    name: str
    tests: NDArray[np.bool_]


def find_changing_forces(search: Search, state: State, kept: Sequence[str], seed: int) -> dict[str, str]:
    """In which part of the log each effect's force differs, and by how much, as a sentence; those that keep it, not.

    Parameters
    ----------
    search : on the force balance
    state : the model with everything that was selected, sure or not
    kept : effects in question
    seed : of the copies of the noise
    """
    seen = ~search.quiet
    asked = {c.key for c in search.pool if c.kind is Kind.EFFECT and not c.effect.general}
    parts = list(_parts(search))
    there = [key for key in kept if key in state.active and key in asked]
    if not there or not seen.any():
        return {}
    rest = ResidualSelection(FormColumns(search, state, seen))
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
