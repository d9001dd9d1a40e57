"""Whether what was named keeps its size beside forms that have no name: a cause does, a stand-in gives way.

A drag that sets in at some speed is fitted by linear and quadratic drag together, thrust that is lost in turns by a
weaker thruster. Such names are right about the axis and wrong about the cause, and every block of the log agrees on
them. So the rest of the model is searched for anything that follows motion, thrust, heading or time (see `free_forms`),
by forward selection, and what no copy of the rest would have shown stays beside the model. An effect whose force then
becomes another was the nearest name for something else (extreme bounds; Leamer 1985). Where the model is right nothing
is left to follow, and nothing is doubted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...physics.frames import AXES
from ...physics.in_words import words
from ..balance.base import Balance
from ..balance.weak_form import WeakForm
from ..candidates.free_forms import free_forms, several
from ..findings import OtherForm
from ..search.floating import Search, State
from ..search.noise_copies import NoiseCopies
from .in_place import following, in_place, in_question
from .rest_beside_forms import Change, FormColumns, RestBesideForms
from .weighing import parameter_total

_OTHER = 0.3
"""Share of an effect's force by which it changes beside other forms from which it is another effect; what stand-ins and
causes change by stands in docs/foreign_causes.md."""
_OTHER_IN_LOGS = 0.6
"""The same where rollouts judged several logs: each was left out once, and the balance of one in coloured noise is no
witness of half a size against that."""


class Rival(NamedTuple):
    """A form that makes another of an effect, or does as well in its place, and what is told of that."""

    form: OtherForm
    told: str


@dataclass(frozen=True, slots=True)
class OtherForms:
    """What the rest of a model follows; by key what rivals effects, and by what share of it their force changes."""

    found: tuple[OtherForm, ...] = ()
    rivals: Mapping[str, Rival] = field(default_factory=dict)
    changes: Mapping[str, float] = field(default_factory=dict)

    @property
    def taking(self) -> tuple[OtherForm, ...]:
        """The forms beside the model to which an effect gives way: they doubt other names, whoever judges."""
        forms = [rival.form for rival in self.rivals.values()]
        return tuple(form for form in self.found if form in forms)


def other_forms(search: Search, state: State, kept: Sequence[str], seed: int, judge: Balance) -> OtherForms:
    """Forms that the rest of a model follows on the force balance, and the effects that give way to them.

    Parameters
    ----------
    search : on the force balance
    state : the model with everything that was selected, sure or not
    kept : effects in question
    seed : of the copies of the rest
    judge : the balance that judged them, of forces or of rollouts; an axis to which it is blind is not looked at
    """
    there = [key for key in kept if key in state.active]
    seen = ~(search.quiet | np.array(judge.blind))
    if not there or not seen.any():
        return OtherForms()
    weak = search.balance
    assert isinstance(weak, WeakForm), "forms are looked for on the force balance"
    columns = FormColumns(search, state, seen, free_forms(weak, state.vehicle, judge.blind))
    rest = RestBesideForms(columns)
    rivals: dict[str, Rival] = {}
    groups = list(in_question(search, state.active))
    for group in groups:
        form = in_place(columns, rest, group, judge)
        if form is not None:
            listed = " and ".join(words(key) for key in group.keys)
            rivals |= dict.fromkeys(group.keys, Rival(form, f"in place of {listed}, {form.in_words} does as well"))
    found = rest.followed(NoiseCopies(search.balance, state.vehicle, seed))
    changes: dict[str, float] = {}
    much = least_change(judge)
    for key in there if found else ():
        change = rest.change(key)
        if change is None:
            continue
        changes[key] = change.share
        if change.share > much:
            rivals[key] = Rival(*_given_way(columns, key, change, found))
    for group in (group for group in groups if group.law):  # of one law no part is right where another is not
        given = next((rivals[key] for key in group.keys if key in rivals), None)
        if given is not None:
            rivals = dict.fromkeys((*group.keys, *following(search.pool, group.letters)), given) | rivals
    return OtherForms(tuple(found), {key: rivals[key] for key in there if key in rivals}, changes)


def least_change(judge: Balance) -> float:
    """Share of an effect's force by which it must change to be another effect, by what judged it."""
    return _OTHER_IN_LOGS if judged_in_logs(judge) else _OTHER


def judged_in_logs(judge: Balance) -> bool:
    """Whether rollouts of several logs judged: what they name holds in each, and the balance of one is no witness."""
    return not judge.forces and several(np.concatenate([motion.minutes for motion in judge.motions]))


def _given_way(columns: FormColumns, key: str, change: Change, found: Sequence[OtherForm]) -> tuple[OtherForm, str]:
    """The form that an effect gives way to, on an axis on which it acts if there is one, and what is told of that."""
    (candidate,) = (c for c in columns.search.pool if c.key == key)
    value = parameter_total(columns.search.nominal, candidate, columns.state.vehicle, change.symbol)
    form = next((form for form in found if change.axes[AXES.index(form.axis)]), found[0])
    others = f" and {len(found) - 1} more" if len(found) > 1 else ""
    return form, f"beside {form.in_words}{others}, {change.symbol} is {value + change.by:.3g} instead of {value:.3g}"
