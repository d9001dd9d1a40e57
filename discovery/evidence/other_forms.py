"""Whether what was named keeps its size beside forms that have no name: a cause does, a stand-in gives way.

A drag that sets in at some speed is fitted by linear and quadratic drag together, thrust that is lost in turns by a
weaker thruster. Such names are right about the axis and wrong about the cause, and every block of the log agrees on
them. So the rest of the corrected model is searched for anything that follows motion, thrust, heading or time (see
`free_forms`), by forward selection, and what no copy of the rest would have shown stays beside the model. An effect
whose force then becomes another was the nearest name for something else (extreme bounds; Leamer 1985). Where the model
is right nothing is left to follow, and nothing is doubted.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...physics.frames import AXES, FORCE_UNITS, Array
from ..balance.base import Balance
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Kind
from ..candidates.free_forms import free_forms
from ..findings import OtherForm
from ..search.floating import Search, State
from ..search.gram import RIDGE
from ..search.noise_copies import NoiseCopies
from .weighing import TELL_APART, parameter_total

_NOTHING = 1e-300
"""Squares below which an axis that is not looked at has none."""
_MOST = 6
"""Forms that may stand beside a model: the force of most laws is one or two."""
_LEAST = 0.002
"""Share of the force at work below which a rest is nothing to look into."""
_NEW = 1e-4
"""Share of its square that a form must have beside the model, or it is part of it."""
_OTHER = 0.3
"""Share of an effect's force by which it changes beside other forms from which it is another effect: of right names in
30 logs it changed by 0.16 or less, of stand-ins by 0.4 and more."""
_OTHER_THERE = 0.6
"""The same where rollouts judged: the balance of such a log is no witness of half a size."""


@dataclass(frozen=True, slots=True)
class OtherForms:
    """What the rest of a model follows, and why effects are not certain for it, by key, as the end of a sentence."""

    found: tuple[OtherForm, ...]
    doubts: Mapping[str, str]


def other_forms(search: Search, state: State, kept: Sequence[str], seed: int, judge: Balance) -> OtherForms:
    """Forms that the rest of a model follows on the force balance, and the effects that give way to them.

    Parameters
    ----------
    search : on the force balance
    state : the corrected model
    kept : effects in question
    seed : of the copies of the rest
    judge : the balance that judged them, of forces or of rollouts; on an axis to which it is blind nothing is told
    """
    if not kept:
        return OtherForms((), {})
    there = [key for key in kept if key in state.active]
    rest = _Rest(search, state, ~(search.quiet | np.array(judge.blind)))
    doubts = {}
    for group in _in_question(search, there):
        one = _Rest(search, state, rest.seen, group, rest).in_one()
        if one.worth < rest.worth + TELL_APART:
            doubts |= dict.fromkeys(group, f"instead of {' and '.join(group)}, {one.form.in_words} does as well")
    found = rest.followed(NoiseCopies(search.balance, seed))
    if found:
        doubts |= {
            key: why for key in there if (why := rest.gives_way(key, found, _OTHER if judge.forces else _OTHER_THERE))
        }
    return OtherForms(tuple(found), doubts)


def _in_question(search: Search, keys: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Effects in whose place one form may do as well.

    Several that act on one axis and follow one velocity alone are any law of it, and what changes all the time may have
    changed at once.
    """
    groups: dict[tuple[int | None, str], list[str]] = {}
    for candidate in (c for c in search.pool if c.key in keys and c.parameters):
        first, *others = candidate.parameters
        letters = {letter for letter in first.form if letter in "uvr"}
        if len(letters) == 1 and not others:
            groups.setdefault((first.axis, letters.pop()), []).append(candidate.key)
        if first.unit.endswith("/min"):
            yield (candidate.key,)
    yield from (tuple(group) for group in groups.values() if len(group) > 1)


class _One(NamedTuple):
    """The form that explains most alone, and the log-likelihood that is lost with it: the smaller the better."""

    form: OtherForm
    worth: float


class _Rest:
    """The balance of a model, weighted, the columns that its fit moves, and the forms that are taken beside it.

    All products are cleared of what sensor noise adds to them, as in every fit.
    """

    def __init__(
        self,
        search: Search,
        state: State,
        seen: NDArray[np.bool_],
        gone: Sequence[str] = (),
        like: "_Rest | None" = None,
    ) -> None:
        self.seen = seen
        self._search, self._state = search, state
        self._linear, scores = search.linearise(state.vehicle, state.active)
        chosen = [self._linear.options[key][key in gone] for key in state.active]
        fit = scores.fit(chosen)
        self._moved = fit.columns[~fit.held]
        both, left = np.append(self._moved, -1), [option.offset for option in chosen if option.key in gone]
        rows, noise = self._linear.columns[:, :, both], self._linear.noise[:, :, :, both]
        rows[:, :, -1] -= self._linear.columns[:, :, left].sum(axis=2)
        noise[..., -1] -= self._linear.noise[..., left].sum(axis=3)
        self._floor = (_LEAST * search.force_scale) ** 2
        error = (rows[:, :, -1] ** 2).mean(axis=0)
        self._weight = like._weight if like else np.where(seen, 1.0 / np.sqrt(error + self._floor), 0.0)
        rows, noise = rows * self._weight[:, None], noise * self._weight[:, None]
        self._columns, self._balance = rows[:, :, :-1].transpose(1, 0, 2), rows[:, :, -1].T
        blurred, blur = noise[..., :-1].transpose(0, 2, 1, 3), noise[..., -1].transpose(0, 2, 1)
        assert isinstance(search.balance, WeakForm)
        self._forms = like._forms if like else free_forms(search.balance, state.vehicle)
        forms, unclear = self._forms.columns, self._forms.noise
        share = scores.noise_taken(self._moved) / max(len(noise), 1)
        self._inner = np.einsum("ati,atj->ij", self._columns, self._columns, optimize=True)
        self._inner -= share * np.einsum("cati,catj->ij", blurred, blurred, optimize=True)
        self._pull = np.einsum("ati,at->i", self._columns, self._balance, optimize=True)
        self._pull -= share * np.einsum("cati,cat->i", blurred, blur, optimize=True)
        self._beside = np.einsum("ati,tk->aik", self._columns, forms, optimize=True)
        self._beside -= share * np.einsum("cati,ctk->aik", blurred, unclear, optimize=True)
        self._wanted = np.einsum("at,tk->ak", self._balance, forms, optimize=True)
        self._wanted -= share * np.einsum("cat,ctk->ak", blur, unclear, optimize=True)
        added = share * np.einsum("cti,ctk->ik", unclear, unclear, optimize=True)
        self._among, self._least = forms.T @ forms - added, np.diag(added)
        self._taken: list[tuple[int, int]] = []

    @property
    def worth(self) -> float:
        """Log-likelihood lost by what is left: half the independent tests times the log of its mean square."""
        normal, right, _ = self._system()
        return self._worth((self._rest(np.linalg.solve(normal, right).astype(float)) ** 2).sum(axis=1))

    def in_one(self) -> _One:
        """The form that explains most of what is left, and what is lost beside it."""
        drops, _, rest, _ = self._drops()
        axis, form = _largest(self._gains(drops, (rest**2).sum(axis=1)))
        self._taken.append((axis, form))
        return _One(self._told(axis, form, drops), self.worth)

    def followed(self, copies: NoiseCopies) -> list[OtherForm]:
        """Take the form that explains most, again and again, while it explains more than any does of every copy."""
        found: list[OtherForm] = []
        while len(found) < _MOST:
            drops, left, rest, system = self._drops()
            gains = self._gains(drops, (rest**2).sum(axis=1))
            axis, form = _largest(gains)
            least = self._search.settings.unnamed_price
            if gains[axis, form] <= least or gains[axis, form] <= self._by_chance(copies, rest, left, system):
                break
            self._taken.append((axis, form))
            found.append(self._told(axis, form, drops))
        return found

    def _drops(self) -> tuple[Array, Array, Array, tuple[Array, Array]]:
        """By how much each form lowers the squares of the rest, (3, forms), what of it is new, the rest, the system."""
        normal, right, beside = self._system()
        left = self._left(normal, beside)
        change = np.linalg.solve(normal, right).astype(float)
        drops = (self._wanted * self._weight[:, None] - change @ beside) ** 2 / left
        return drops, left, self._rest(change), (normal, beside)

    def _told(self, axis: int, form: int, drops: Array) -> OtherForm:
        force = float(np.sqrt(drops[axis, form] / self._balance.shape[1])) / float(self._weight[axis])
        share = force / float(self._search.force_scale[axis])
        follows = self._forms.names[form]
        return OtherForm(axis=AXES[axis], follows=follows, force=force, share=share, unit=FORCE_UNITS[axis])

    def gives_way(self, key: str, found: Sequence[OtherForm], other: float) -> str:
        """Why an effect is another one beside the forms that were taken, as the end of a sentence; or nothing."""
        option, gone = self._linear.options[key][:2]
        free = dict(zip(option.free, option.symbols, strict=True))
        own = {free[k]: place for place, k in enumerate(self._moved.tolist()) if k in free}
        if option.kind is not Kind.EFFECT or not own:
            return ""
        moved, (normal, right, _) = self._moved.size, self._system()
        # What the fit itself moves is not the doing of the forms: rollouts may have judged, and not this balance.
        change = np.linalg.solve(normal, right)[:moved]
        change -= np.linalg.solve(normal[:moved, :moved], right[:moved])
        force = {symbol: self._columns[:, :, place] * change[place] for symbol, place in own.items()}
        whole = self._linear.columns[:, :, gone.offset].T * self._weight[:, None]
        if _size(np.asarray(sum(force.values()))) <= other * _size(whole):
            return ""
        symbol = max(force, key=lambda s: _size(force[s]))
        (candidate,) = (c for c in self._search.pool if c.key == key)
        value = parameter_total(self._search.nominal, candidate, self._state.vehicle, symbol)
        near = [form for form in found if _size(whole[AXES.index(form.axis)]) > 0.0] or found
        return f"beside {near[0].in_words}, {symbol} is {value + change[own[symbol]]:.3g} instead of {value:.3g}"

    def _system(self) -> tuple[Array, Array, Array]:
        """Normal equations of what the fit moves and of the forms taken, and their products with forms on each axis."""
        moved, weight = self._moved.size, self._weight
        count = moved + len(self._taken)
        beside = np.zeros((3, count, self._among.shape[0]))
        beside[:, :moved] = self._beside * weight[:, None, None]
        right = np.append(self._pull, [self._wanted[axis, form] * weight[axis] for axis, form in self._taken])
        for place, (axis, form) in enumerate(self._taken, moved):
            beside[axis, place] = self._among[form] * weight[axis] ** 2
        normal = np.zeros((count, count))
        normal[:moved, :moved] = self._inner
        for place, (axis, form) in enumerate(self._taken, moved):
            normal[:, place] = normal[place] = beside[axis, :, form]
        size = np.diag(normal)
        return normal + np.diag(np.where(size > 0.0, RIDGE * size, 1.0)), right, beside

    def _left(self, normal: Array, beside: Array) -> Array:
        """Square of what of each form is new beside the model and clear of noise, (3, forms); no end of it else."""
        whole = np.diag(self._among) * (self._weight**2)[:, None]
        left = whole - np.stack([(side * np.linalg.solve(normal, side)).sum(axis=0) for side in beside])
        least = np.maximum(_NEW * whole, self._least * (self._weight**2)[:, None])
        return np.where((left > least) & (whole > 0.0), left, np.inf)

    def _rest(self, change: Array) -> Array:
        """What is left of the balance, weighted, (3, tests)."""
        moved = self._moved.size
        rest = self._balance - self._columns @ change[:moved]
        for (axis, form), size in zip(self._taken, change[moved:], strict=True):
            rest[axis] -= size * self._weight[axis] * self._forms.columns[:, form]
        return rest

    def _gains(self, drops: Array, square: Array) -> Array:
        """Log-likelihood that drops (3, ..., forms) of squared rests (3, ...) are worth."""
        tests = self._balance.shape[1]
        floor = (self._floor * self._weight**2 * tests).reshape(3, *(1,) * (square.ndim - 1)) + _NOTHING
        after = np.maximum(square[..., None] - drops, 0.0) + floor[..., None]
        return np.asarray(0.5 * self._search.balance.independent * np.log((square + floor)[..., None] / after))

    def _worth(self, square: Array) -> float:
        error = square / self._balance.shape[1] + self._floor * self._weight**2 + _NOTHING
        return float(0.5 * self._search.balance.independent * np.log(error).sum())

    def _by_chance(self, copies: NoiseCopies, rest: Array, left: Array, system: tuple[Array, Array]) -> float:
        """The most that any form is worth in any copy of the rest."""
        most, (normal, beside) = 0.0, system
        forms = self._forms.columns.astype(np.float32)
        columns = self._columns.astype(np.float32)
        for drawn in copies.of(rest.T.astype(np.float32)):
            pulls = (drawn @ forms).astype(float) * self._weight[:, None, None]
            of_model = (drawn @ columns).sum(axis=0).astype(float)
            taken = [pulls[axis, :, form] for axis, form in self._taken]
            solved = np.linalg.solve(normal, np.column_stack([of_model, *taken]).T)
            drops = (pulls - np.einsum("pc,apk->ack", solved, beside, optimize=True)) ** 2 / left[:, None]
            most = max(most, float(self._gains(drops, (drawn**2).sum(axis=2).astype(float)).max()))
        return most


def _largest(gains: Array) -> tuple[int, int]:
    axis, form = np.unravel_index(int(np.argmax(gains)), gains.shape)
    return int(axis), int(form)


def _size(force: Array) -> float:
    return float(np.sqrt((force**2).sum()))
