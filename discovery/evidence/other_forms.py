"""Whether what was named keeps its size beside forms that have no name: a cause does, a stand-in gives way.

A drag that sets in at some speed is fitted by linear and quadratic drag together, thrust that is lost in turns by a
weaker thruster. Such names are right about the axis and wrong about the cause, and every block of the log agrees on
them. So the rest of the model is searched for anything that follows motion, thrust, heading or time (see `free_forms`),
by forward selection, and what no copy of the rest would have shown stays beside the model. An effect whose force then
becomes another was the nearest name for something else (extreme bounds; Leamer 1985). Where the model is right nothing
is left to follow, and nothing is doubted.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...physics.frames import AXES
from ..balance.base import Balance
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Kind
from ..candidates.free_forms import finer_forms, free_forms, several
from ..findings import OtherForm
from ..search.floating import Search, State
from ..search.noise_copies import NoiseCopies
from .rest_beside_forms import Change, FormColumns, RestBesideForms
from .weighing import TELL_APART, parameter_total

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
    rivals = {}
    groups = list(_in_question(search, state.active))
    for group, law_of in groups:
        if law_of and not judge.forces:
            continue  # which law of a speed it is, the balance of such a log cannot tell
        finer = FormColumns(search, state, seen, finer_forms(weak, state.vehicle, law_of, judge.blind))
        tried = (RestBesideForms(these, group).in_one(these.same(group)) for these in (columns, finer))
        one = min((one for one in tried if one is not None), key=lambda one: one.worth, default=None)
        if one is not None and one.worth < rest.worth + TELL_APART:
            listed = " and ".join(key.replace("_", " ") for key in group)
            rivals |= dict.fromkeys(group, Rival(one.form, f"in place of {listed}, {one.form.in_words} does as well"))
    found = rest.followed(NoiseCopies(search.balance, seed))
    changes: dict[str, float] = {}
    much = least_change(judge)
    for key in there if found else ():
        change = rest.change(key)
        if change is None:
            continue
        changes[key] = change.share
        if change.share > much:
            rivals[key] = Rival(*_given_way(columns, key, change, found))
    for group, _ in groups:  # of one law no part is right where another is not, whoever judges
        given = next((rivals[key] for key in group if key in rivals), None)
        if given is not None:
            rivals |= {key: given for key in group if key not in rivals}
    return OtherForms(tuple(found), {key: rivals[key] for key in there if key in rivals}, changes)


def _in_question(search: Search, keys: Sequence[str]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Effects of a model in whose place one form may do as well, and the velocity whose law they are, if any.

    Several that act on one axis and follow one velocity alone, or nothing, are any law of it, and what changes all the
    time may have changed at once.
    """
    groups: dict[tuple[int | None, str], list[str]] = {}
    steady: dict[int, str] = {}
    for candidate in (c for c in search.pool if c.key in keys and c.kind is Kind.EFFECT):
        first, *others = candidate.parameters
        letters = {letter for letter in first.form if letter in "uvr"}
        if len(letters) == 1 and not others:
            groups.setdefault((first.axis, letters.pop()), []).append(candidate.key)
        if first.axis is not None and not first.form:
            steady[first.axis] = candidate.key
        if first.unit.endswith("/min"):
            yield (candidate.key,), ""
    for (axis, letter), group in groups.items():
        whole = (*group, *(key for of, key in steady.items() if of == axis))
        if len(whole) > 1:
            yield whole, letter


def least_change(judge: Balance) -> float:
    """Share of an effect's force by which it must change to be another effect, by what judged it."""
    in_logs = several(np.concatenate([motion.minutes for motion in judge.motions]))
    return _OTHER_IN_LOGS if in_logs and not judge.forces else _OTHER


def _given_way(columns: FormColumns, key: str, change: Change, found: Sequence[OtherForm]) -> tuple[OtherForm, str]:
    """The form that an effect gives way to, on an axis on which it acts if there is one, and what is told of that."""
    (candidate,) = (c for c in columns.search.pool if c.key == key)
    value = parameter_total(columns.search.nominal, candidate, columns.state.vehicle, change.symbol)
    form = next((form for form in found if change.axes[AXES.index(form.axis)]), found[0])
    others = f" and {len(found) - 1} more" if len(found) > 1 else ""
    return form, f"beside {form.in_words}{others}, {change.symbol} is {value + change.by:.3g} instead of {value:.3g}"
