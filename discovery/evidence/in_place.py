"""Whether one form without a name does in the place of effects what they do: then they are not known to be the cause.

Two effects for which one form does as well are one cause too many. A single effect is more than a stand-in unless a
form in its place explains more, steadily from block to block or by much, and leaves nothing for it to explain: the form
encompasses the effect, and not the other way about (Mizon and Richard 1986). A law of the catalogue that holds is
beaten by none.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ...physics.frames import AXES, Array
from ..balance.base import Balance
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Candidate, Kind
from ..candidates.free_forms import finer_forms
from ..findings import OtherForm
from ..search.floating import Search
from .rest_beside_forms import FormColumns, OneForm, RestBesideForms
from .weighing import TELL_APART

_STEADY = 2.0
"""Standard errors, of blocks, by which a form explains more from block to block."""
_MUCH = 0.25
"""Share of what an effect explains that a form must explain beyond it where one stretch of the log decides."""


class Group(NamedTuple):
    """Effects in whose place one form may do, the velocities whose forms are tried in finer steps, and what they are.

    A law is all that follows one velocity on one axis; what grows all the time may have set in at once (growth); what
    the thrusters do, they do on each axis on which they push or turn (thrust).
    """

    keys: tuple[str, ...]
    letters: str = ""
    law: bool = False
    growth: bool = False
    thrust: bool = False


def in_question(search: Search, keys: Sequence[str]) -> Iterator[Group]:
    """Every group of effects of a model in whose place one form may do: single ones, any two on an axis, and laws.

    Several that act on one axis and follow one velocity alone, or nothing, are any law of it.
    """
    named = [c for c in search.pool if c.key in keys and c.kind is Kind.EFFECT and not c.effect.general]
    for candidate in named:
        growth = any(p.unit.endswith("/min") for p in candidate.parameters)
        yield Group((candidate.key,), _letters(candidate), growth=growth)
    for one, other in combinations(named, 2):
        if _axes(one) & _axes(other):
            thrust = "thruster" in (one.effect.family, other.effect.family)
            yield Group((one.key, other.key), _letters(one, other), thrust=thrust)
    laws: dict[tuple[int | None, str], list[str]] = {}
    steady: dict[int, str] = {}
    for candidate in named:
        first, *others = candidate.parameters
        letters = _letters(candidate)
        if len(letters) == 1 and not others:
            laws.setdefault((first.axis, letters), []).append(candidate.key)
        if first.axis is not None and not first.form:
            steady[first.axis] = candidate.key
    for (axis, letter), law in laws.items():
        whole = (*law, *(key for of, key in steady.items() if of == axis))
        if len(whole) > 1:
            yield Group(whole, letter, law=True)


class Substitute(NamedTuple):
    """A form in the place of effects.

    Attributes
    ----------
    form : what it follows
    margin : log-likelihood by which it explains more than they do; below nothing where it explains less
    does : whether it does what they do, and leaves nothing for them to explain
    """

    form: OtherForm
    margin: float
    does: bool


def in_place(columns: FormColumns, rest: RestBesideForms, group: Group, judge: Balance) -> Substitute | None:
    """The form that does most in the place of a group of effects; None where there is none at all.

    Parameters
    ----------
    columns : of the model, with all free forms
    rest : what the model leaves with the effects
    judge : the balance that judged them; which law of a speed it is, that of forces cannot tell where rollouts judged
    """
    weak = columns.search.balance
    assert isinstance(weak, WeakForm), "forms are looked for on the force balance"
    seen = [letter for letter in group.letters if not judge.blind["uvr".index(letter)]]
    finer = [""] if group.growth else seen
    tried = [columns, *(columns.of(finer_forms(weak, columns.state.vehicle, by, judge.blind)) for by in finer)]
    found = []
    for these in tried:
        without = RestBesideForms(these, group.keys)
        same = these.same(group.keys)
        axes = [k for k in np.flatnonzero(these.axes(group.keys)).tolist() if not judge.blind[k]]
        one = without.in_one_on_each(same, axes) if group.thrust else without.in_one(same)
        if one is not None:
            found.append((one, without.worth, these))
    if not found:
        return None
    one, without, these = min(found, key=lambda f: f[0].worth)
    margin = rest.worth - one.worth
    return Substitute(one.form, margin, _does(columns, these, rest, group, one, without - rest.worth, judge))


def _does(
    columns: FormColumns,
    these: FormColumns,
    rest: RestBesideForms,
    group: Group,
    one: OneForm,
    lost: float,
    judge: Balance,
) -> bool:
    """Whether a form does in the place of effects what they do, and they add nothing beside it.

    Parameters
    ----------
    these : the columns of the forms among which it is
    lost : log-likelihood that is lost without the effects
    """
    more = rest.worth - one.worth
    if more < -TELL_APART:
        return False
    if group.growth or (group.law and judge.forces):
        return True
    for key in group.keys:
        others = [other for other in group.keys if other != key]
        explains = RestBesideForms(columns, [key]).worth - rest.worth
        adds = one.worth - RestBesideForms(these, others).beside(*one.places).worth
        if explains < 2.0 * TELL_APART or adds > TELL_APART:
            return False  # what explains nothing has nothing to give way with
    if judge.forces and len(group.keys) > 1:
        return True
    weak = columns.search.balance
    return more > TELL_APART and (more > _MUCH * lost or _steadiness(weak, one.left, rest.left) > _STEADY)


def _steadiness(weak: Balance, one: Array, other: Array) -> float:
    """Standard errors, of blocks, by which squares (3, tests) are smaller than others."""
    least = np.finfo(float).tiny
    whole = np.maximum((other**2 + one**2).sum(axis=1, keepdims=True), least)
    gain = np.bincount(weak.block, ((other**2 - one**2) / whole).sum(axis=0))
    return float(gain.sum() / max(np.std(gain, ddof=1) * np.sqrt(gain.size), least))


def _letters(*candidates: Candidate) -> str:
    """The velocities that the forms of candidates take."""
    return "".join(sorted({c for candidate in candidates for p in candidate.parameters for c in p.form if c in "uvr"}))


def _axes(candidate: Candidate) -> set[int]:
    """Axes on which a candidate acts: all of them where it says none."""
    axes: set[int] = set()
    for parameter in candidate.parameters:
        axes |= set(range(len(AXES))) if parameter.axis is None else {parameter.axis}
    return axes
