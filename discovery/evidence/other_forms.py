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
from .in_place import Substitute, in_place, in_question
from .rest_beside_forms import Change, FormColumns, RestBesideForms
from .weighing import parameter_total

_SLIGHT = 0.05
"""Share of its force from which a change is worth a word."""


class Beside(NamedTuple):
    """What becomes of an effect beside the forms, or of them in its place.

    Attributes
    ----------
    change : share of its force by which it changes beside the forms that the rest follows
    by : change of each of its numbers, by symbol: what is left widens its interval
    margin : log-likelihood by which one free force in its place explains more than it does; below nothing: less
    does : whether a force does in its place, or in that of a group it belongs to
    told : what is told of it, as the end of a sentence
    form : that force, or the form beside which it changes
    """

    change: float = 0.0
    by: Mapping[str, float] = {}
    margin: float | None = None
    does: bool = False
    told: str = ""
    form: OtherForm | None = None


@dataclass(frozen=True, slots=True)
class OtherForms:
    """What the rest of a model follows, and by key what becomes of its effects beside that."""

    found: tuple[OtherForm, ...] = ()
    beside: Mapping[str, Beside] = field(default_factory=dict)


def other_forms(search: Search, state: State, kept: Sequence[str], seed: int, judge: Balance) -> OtherForms:
    """Forms that the rest of a model follows on the force balance, and what becomes of its effects beside them.

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
    margins: dict[str, Substitute] = {}
    doing: dict[str, tuple[OtherForm, str]] = {}
    for group in in_question(search, state.active):
        one = in_place(columns, rest, group, judge)
        if one is None:
            continue
        if len(group.keys) == 1:
            margins[group.keys[0]] = one
        if one.does:
            listed = " and ".join(words(key) for key in group.keys)
            doing |= dict.fromkeys(group.keys, (one.form, f"in place of {listed}, {one.form.in_words} does as well"))
    found = tuple(rest.followed(NoiseCopies(search.balance, state.vehicle, seed)))
    beside = {}
    for key in there:
        change = rest.change(key) if found else None
        form, told = doing.get(key, (None, ""))
        if change is not None and not told and change.share >= _SLIGHT:
            form, told = _given_way(columns, key, change, found)
        single = margins.get(key)
        beside[key] = Beside(
            change.share if change else 0.0,
            change.by if change else {},
            single.margin if single else None,
            key in doing,
            told,
            form,
        )
    return OtherForms(found, beside)


def judged_in_logs(judge: Balance) -> bool:
    """Whether rollouts of several logs judged: what they name holds in each, and the balance of one is no witness."""
    return not judge.forces and several(np.concatenate([motion.minutes for motion in judge.motions]))


def _given_way(columns: FormColumns, key: str, change: Change, found: Sequence[OtherForm]) -> tuple[OtherForm, str]:
    """The form that an effect gives way to, on an axis on which it acts if there is one, and what is told of that."""
    (candidate,) = (c for c in columns.search.pool if c.key == key)
    symbol = max(change.by, key=lambda s: abs(change.by[s]))
    value = parameter_total(columns.search.nominal, candidate, columns.state.vehicle, symbol)
    form = next((form for form in found if change.axes[AXES.index(form.axis)]), found[0])
    others = f" and {len(found) - 1} more" if len(found) > 1 else ""
    return form, f"beside {form.in_words}{others}, {symbol} is {value + change.by[symbol]:.3g} instead of {value:.3g}"
