"""How much better one force without a name does in the place of an effect, or how much worse.

A law that holds is beaten by none: a form in its place explains less, by much on a good log. One that explains more
says that the effect is the nearest name for something else (encompassing; Mizon and Richard 1986).
"""

from typing import NamedTuple

from ..balance.base import Balance
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Candidate
from ..candidates.free_forms import finer_forms
from ..findings import OtherForm
from .rest_beside_forms import FormColumns, RestBesideForms


class Substitute(NamedTuple):
    """A form in the place of an effect.

    Attributes
    ----------
    form : what it follows
    margin : log-likelihood by which it explains more than the effect does; below nothing where it explains less
    """

    form: OtherForm
    margin: float


def in_place(columns: FormColumns, rest: RestBesideForms, candidate: Candidate, judge: Balance) -> Substitute | None:
    """The form that does most in the place of an effect; None where there is none at all.

    Parameters
    ----------
    columns : of the model, with all free forms
    rest : what the model leaves with the effect
    judge : the balance that judged it; which law of a speed it is, that of forces cannot tell where rollouts judged
    """
    weak = columns.search.balance
    assert isinstance(weak, WeakForm), "forms are looked for on the force balance"
    grows = any(p.unit.endswith("/min") for p in candidate.parameters)  # what grows may have set in at once
    letters = sorted({c for p in candidate.parameters for c in p.form if c in "uvr"})
    finer = [""] if grows else [letter for letter in letters if not judge.blind["uvr".index(letter)]]
    tried = [columns, *(columns.of(finer_forms(weak, columns.state.vehicle, by, judge.blind)) for by in finer)]
    keys = (candidate.key,)
    found = [one for these in tried if (one := RestBesideForms(these, keys).in_one(these.same(keys)))]
    if not found:
        return None
    best = min(found, key=lambda one: one.worth)
    return Substitute(best.form, rest.worth - best.worth)
