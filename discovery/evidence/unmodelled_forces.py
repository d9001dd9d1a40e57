"""Forces outside the catalogue: named effects refitted beside free forms, or replaced by one.

A name may be right about the axis and wrong about the cause. So forward selection on the residual of a force balance
looks for `free_forms` that gain more than any form does in any of 999 surrogate copies of that residual, and each
effect's change beside them is recorded (extreme bounds; Leamer 1985). A form that explains more in the place of an
effect outdoes its law (encompassing; Mizon and Richard 1986). Products are cleared of what sensor noise adds to them.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import AXES, FORCE_UNITS, Array
from ..balance.base import Balance
from ..balance.starts import LEAST_BLOCKS
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Candidate, Kind
from ..candidates.unnamed_terms import FreeForms, finer_forms, free_forms
from ..findings import OtherForm
from ..search.floating import Search, State
from ..search.gram import RIDGE, shares_taken
from ..search.surrogates import NoiseCopies

_NOTHING = 1e-300
"""Square that stands for none, on an axis that is not looked at."""
MOST_FORMS = 6
"""Forms, or terms, that are tried one after the other beside a model: the force of most laws is one or two, and more
than six that nobody has named are no physics to look for."""
_LEAST = 0.002
"""Share of the force at work that regularises the logarithm of a rest, which may be nothing in a simulator's log."""
_NEW = 1e-4
"""Share of its square that a form must have beside the model, or it is part of it to rounding and noise."""
_CLEAR = 1e-3
"""The same of an effect's force in a part of the log, which is like the whole of it but for rounding and noise."""
_SAME = 1e-9
"""Share of its square that a form may have beside effects and be nothing else than they: that of rounding."""
_TRIED = 10
"""Forms that promise most that are tried, of which the one that keeps it is taken: noise in a form promises more than
it keeps."""


class OwnChange(NamedTuple):
    """In which part of a log an effect differs most from elsewhere, by what share of itself, and what that lowers.

    Worth is the square that is explained by it, chance the most in any copy of what is left beside it.
    """

    part: int
    share: float
    worth: float
    chance: float


class FormColumns:
    """Columns of a model about itself and of the free forms, weighted by the residual."""

    def __init__(self, search: Search, state: State, seen: NDArray[np.bool_], forms: FreeForms | None = None) -> None:
        self.search, self.state = search, state
        pool = [c for c in search.pool if c.key in state.active]
        self.linear, self.scores = search.linearise(state.vehicle, state.active, pool=pool)
        copies, tests = self.linear.noise.shape[:2]
        self.forms = forms or FreeForms((), np.empty((tests, 0)), np.empty((copies, tests, 0)))
        self.floor = (_LEAST * search.force_scale) ** 2
        error = (self.linear.columns[:, :, -1] ** 2).mean(axis=0)
        self.weight = np.where(seen, 1.0 / np.sqrt(error + self.floor), 0.0)

    def of(self, forms: FreeForms) -> Self:
        """The same with other forms."""
        other = copy(self)
        other.forms = forms
        return other

    def no_substitutes(self, key: str) -> NDArray[np.bool_]:
        """Forms that cannot stand in the place of an effect, (3, forms): on axes where it does nothing, and itself."""
        own = self.linear.columns[:, :, self.linear.options[key][1].offset]
        return self._same(key) | ~(own != 0.0).any(axis=0)[:, None]

    def _same(self, key: str) -> NDArray[np.bool_]:
        """Forms that are an effect by another name: nothing of them is new beside its columns, (3, forms)."""
        own = [k for k in self.linear.options[key][0].free if k >= 0]
        forms = self.forms.columns
        result = np.zeros((3, forms.shape[1]), dtype=bool)
        for axis, same in enumerate(result):
            columns = self.linear.columns[:, axis, own]
            basis = np.linalg.qr(columns[:, (columns != 0.0).any(axis=0)])[0]
            left = ((forms - basis @ (basis.T @ forms)) ** 2).sum(axis=0)
            same[:] = left <= _SAME * (forms**2).sum(axis=0)
        return result


class ResidualSelection:
    """Residual of a model, with effects taken out, beside free forms that are taken.

    All products are cleared of what sensor noise adds to them, as in every fit.
    """

    def __init__(self, columns: FormColumns, gone: Sequence[str] = ()) -> None:
        self._of = columns
        linear, weight = columns.linear, columns.weight
        options = [linear.options[key] for key in columns.state.active]
        chosen = [absent if here.key in gone else here for here, absent, *_ in options]
        fit = columns.scores.fit(chosen)
        self._moved = fit.columns[~fit.held]
        both, out = np.append(self._moved, -1), [option.offset for option in chosen if option.key in gone]
        rows, noise = linear.columns[:, :, both], linear.noise[:, :, :, both]
        rows[:, :, -1] -= linear.columns[:, :, out].sum(axis=2)
        noise[..., -1] -= linear.noise[..., out].sum(axis=3)
        rows, noise = rows * weight[:, None], noise * weight[:, None]
        self._columns, self._balance = rows[:, :, :-1].transpose(1, 0, 2), rows[:, :, -1].T
        blurred, blur = noise[..., :-1].transpose(0, 2, 1, 3), noise[..., -1].transpose(0, 2, 1)
        forms, unclear = columns.forms.columns, columns.forms.noise
        copies = max(len(noise), 1)
        total = _summed("ati,atj->ij", self._columns, self._columns)
        added = _summed("cati,catj->ij", blurred, blurred) / copies
        share = float(shares_taken(total[None], added[None])[0]) if len(noise) and self._moved.size else 1.0
        self._inner = total - share * added
        share /= copies
        self._share, self._blur = share, (blurred, blur)
        self._pull = _summed("ati,at->i", self._columns, self._balance) - share * _summed("cati,cat->i", blurred, blur)
        self._cross_products = _summed("ati,tk->aik", self._columns, forms) - share * _summed(
            "cati,ctk->aik", blurred, unclear
        )
        self._wanted = _summed("at,tk->ak", self._balance, forms) - share * _summed("cat,ctk->ak", blur, unclear)
        among = share * _summed("cti,ctk->ik", unclear, unclear)
        self._among, self._least = forms.T @ forms - among, np.diag(among)
        self._taken: list[tuple[int, int]] = []

    @property
    def log_loss(self) -> float:
        """Log-likelihood lost by what is left: half the independent tests times the log of its mean square."""
        square = (self.residual**2).sum(axis=1)
        error = square / self._balance.shape[1] + self._of.floor * self._of.weight**2 + _NOTHING
        return float(0.5 * self._of.search.balance.independent * np.log(error).sum())

    def best_single_form(self, barred: NDArray[np.bool_]) -> tuple[float, OtherForm] | None:
        """What is lost beside the form that explains most of what is left and is not barred, and that form."""
        drops, _, rest, _ = self._drops()
        best = self._best(self._gains(np.where(barred, 0.0, drops), (rest**2).sum(axis=1)))
        if best is None:
            return None
        axis, form, worth = best
        return worth, self._form(axis, form, drops)

    def with_forms(self, *places: tuple[int, int]) -> Self:
        """The same beside more forms, each of an axis."""
        more = copy(self)
        more._taken = [*self._taken, *places]
        return more

    @property
    def residual(self) -> Array:
        """Residual of the balance, weighted, (3, tests)."""
        normal, right, _ = self._system()
        return self._residual(np.linalg.solve(normal, right).astype(float))

    def select_forms(self, copies: NoiseCopies) -> list[OtherForm]:
        """Take the form that explains most, again and again, while it explains more than any does of every copy."""
        result: list[OtherForm] = []
        while len(result) < MOST_FORMS:
            drops, left, rest, system = self._drops()
            gains = self._gains(drops, (rest**2).sum(axis=1))
            best = self._best(gains)
            if best is None:
                break
            axis, form, worth = best
            # What a model lets through of noise depends on its coefficients: a form must promise its gain and keep it.
            gain = min(float(gains[axis, form]), self.log_loss - worth)
            if gain <= self._of.search.settings.unnamed_price or gain <= self._by_chance(copies, rest, left, system):
                break
            self._taken.append((axis, form))
            result.append(self._form(axis, form, drops))
        return result

    def change(self, key: str) -> tuple[float, dict[str, float]]:
        """By what share of its force an effect changes beside the forms that were taken, and its numbers, by symbol."""
        option, gone, *_ = self._of.linear.options[key]
        free = dict(zip(option.free, option.symbols, strict=True))
        own = {free[k]: place for place, k in enumerate(self._moved.tolist()) if k in free}
        if option.kind is not Kind.EFFECT or not own:
            return 0.0, {}
        moved, (normal, right, _) = self._moved.size, self._system()
        # What the fit itself moves is not the doing of the forms: rollouts may have judged, and not this balance.
        by = np.linalg.solve(normal, right)[:moved]
        by -= np.linalg.solve(normal[:moved, :moved], right[:moved])
        force = sum(self._columns[:, :, place] * by[place] for place in own.values())
        whole = self._of.linear.columns[:, :, gone.offset].T * self._of.weight[:, None]
        share = _size(np.asarray(force)) / max(_size(whole), _NOTHING)
        return share, {symbol: float(by[place]) for symbol, place in own.items()}

    def own_change(self, key: str, parts: NDArray[np.bool_], least: float, copies: NoiseCopies) -> OwnChange | None:
        """The part of the log in which an effect's own force differs most from what it is elsewhere, if it does.

        The column of an effect is what the balance loses with it, its force with the other sign.

        Parameters
        ----------
        parts : (parts, tests) which tests belong to each
        least : share of itself by which an effect must differ; where it does in no part, there is no change
        """
        linear, weight = self._of.linear, self._of.weight[:, None]
        option, gone, *_ = linear.options[key]
        if not set(option.free) & set(self._moved.tolist()):
            return None  # beside an effect that nothing moves, what it has too little of all over is in every part
        place = gone.offset
        whole, block = linear.columns[:, :, place].T * weight, self._of.search.balance.block
        force = np.sqrt((whole**2).sum(axis=0))
        told = [
            all(effective_blocks(force * inside, block) >= LEAST_BLOCKS for inside in (part, ~part)) for part in parts
        ]
        own = whole[None] * parts[:, None]
        blur = np.einsum("cta,pt->pcat", linear.noise[:, :, :, place] * weight[:, 0], parts)
        blurred, noise = self._blur
        beside = _summed("ati,pat->ip", self._columns, own) - self._share * _summed("cati,pcat->ip", blurred, blur)
        pull = _summed("at,pat->p", self._balance, own) - self._share * _summed("cat,pcat->p", noise, blur)
        square = _summed("pat,pat->p", own, own)
        normal, right, _ = self._system()
        solved, change = np.linalg.solve(normal, beside), np.linalg.solve(normal, right)
        left = square - self._share * _summed("pcat,pcat->p", blur, blur) - (beside * solved).sum(axis=0)
        left = np.where((left > _CLEAR * square) & told, left, np.inf)
        sizes = (pull - change @ beside) / left
        drops = np.where(np.abs(sizes) > least, (pull - change @ beside) ** 2 / left, 0.0)
        best = int(np.argmax(drops))
        if drops[best] <= 0.0:
            return None
        new = own[best] - self._columns @ solved[:, best]
        rest = self._balance - self._columns @ change - sizes[best] * new
        chance, columns, own = 0.0, self._columns.astype(np.float32), own.astype(np.float32)
        for drawn in copies.of(rest.T.astype(np.float32)):
            pulls = _summed("act,pat->pc", drawn, own) - solved.T @ _summed("act,ati->ic", drawn, columns)
            chance = max(chance, float((pulls**2 / left[:, None]).max()))
        return OwnChange(best, -float(sizes[best]), float(drops[best]), chance)

    def _best(self, gains: Array) -> tuple[int, int, float] | None:
        """Axis and form that lower the log-likelihood lost most, of those that promise most, and what is lost then."""
        promising = [int(k) for k in np.argsort(-gains, axis=None)[:_TRIED] if gains.flat[k] > 0.0]
        tried = []
        for k in promising:
            axis, form = (int(place) for place in np.unravel_index(k, gains.shape))
            tried.append((axis, form, self.with_forms((axis, form)).log_loss))
        return min(tried, key=lambda one: one[2], default=None)

    def _drops(self) -> tuple[Array, Array, Array, tuple[Array, Array]]:
        """By how much each form lowers the squares of the rest, (3, forms), what of it is new, the rest, the system."""
        normal, right, beside = self._system()
        left = self._new_squares(normal, beside)
        change = np.linalg.solve(normal, right).astype(float)
        drops = (self._wanted * self._of.weight[:, None] - change @ beside) ** 2 / left
        return drops, left, self._residual(change), (normal, beside)

    def _form(self, axis: int, form: int, drops: Array) -> OtherForm:
        force = float(np.sqrt(drops[axis, form] / self._balance.shape[1])) / float(self._of.weight[axis])
        share = force / float(self._of.search.force_scale[axis])
        follows = self._of.forms.names[form]
        return OtherForm(axis=AXES[axis], follows=follows, force=force, share=share, unit=FORCE_UNITS[axis])

    def _system(self) -> tuple[Array, Array, Array]:
        """Normal equations of what the fit moves and of the forms taken, and their products with forms on each axis."""
        moved, weight = self._moved.size, self._of.weight
        count = moved + len(self._taken)
        beside = np.zeros((3, count, self._among.shape[0]))
        beside[:, :moved] = self._cross_products * weight[:, None, None]
        right = np.append(self._pull, [self._wanted[axis, form] * weight[axis] for axis, form in self._taken])
        for place, (axis, form) in enumerate(self._taken, moved):
            beside[axis, place] = self._among[form] * weight[axis] ** 2
        normal = np.zeros((count, count))
        normal[:moved, :moved] = self._inner
        for place, (axis, form) in enumerate(self._taken, moved):
            normal[:, place] = normal[place] = beside[axis, :, form]
        size = np.diag(normal)
        return normal + np.diag(np.where(size > 0.0, RIDGE * size, 1.0)), right, beside

    def _new_squares(self, normal: Array, beside: Array) -> Array:
        """Square of what of each form is new beside the model and clear of noise, (3, forms); no end of it else."""
        whole = np.diag(self._among) * (self._of.weight**2)[:, None]
        left = whole - np.stack([(side * np.linalg.solve(normal, side)).sum(axis=0) for side in beside])
        least = np.maximum(_NEW * whole, self._least * (self._of.weight**2)[:, None])
        return np.where((left > least) & (whole > 0.0), left, np.inf)

    def _residual(self, change: Array) -> Array:
        """What is left of the balance, weighted, (3, tests)."""
        moved = self._moved.size
        rest = self._balance - self._columns @ change[:moved]
        for (axis, form), size in zip(self._taken, change[moved:], strict=True):
            rest[axis] -= size * self._of.weight[axis] * self._of.forms.columns[:, form]
        return rest

    def _gains(self, drops: Array, square: Array) -> Array:
        """Log-likelihood that drops (3, ..., forms) of squared rests (3, ...) are worth."""
        tests = self._balance.shape[1]
        floor = (self._of.floor * self._of.weight**2 * tests).reshape(3, *(1,) * (square.ndim - 1)) + _NOTHING
        after = np.maximum(square[..., None] - drops, 0.0) + floor[..., None]
        return np.asarray(0.5 * self._of.search.balance.independent * np.log((square + floor)[..., None] / after))

    def _by_chance(self, copies: NoiseCopies, rest: Array, left: Array, system: tuple[Array, Array]) -> float:
        """The most that any form is worth in any copy of the rest."""
        most, (normal, beside) = 0.0, system
        forms = self._of.forms.columns.astype(np.float32)
        columns = self._columns.astype(np.float32)
        for drawn in copies.of(rest.T.astype(np.float32)):
            pulls = (drawn @ forms).astype(float) * self._of.weight[:, None, None]
            of_model = (drawn @ columns).sum(axis=0).astype(float)
            taken = [pulls[axis, :, form] for axis, form in self._taken]
            solved = np.linalg.solve(normal, np.column_stack([of_model, *taken]).T)
            drops = (pulls - np.einsum("pc,apk->ack", solved, beside, optimize=True)) ** 2 / left[:, None]
            most = max(most, float(self._gains(drops, (drawn**2).sum(axis=2).astype(float)).max()))
        return most


def _summed(how: str, one: NDArray[np.floating], other: NDArray[np.floating]) -> Array:
    """An Einstein sum of two arrays, as products of matrices where that is faster."""
    return np.asarray(np.einsum(how, one, other, optimize=True))


def _size(force: Array) -> float:
    return float(np.sqrt((force**2).sum()))


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
    lost, form = min(found, key=lambda one: one[0])
    return Substitute(form, rest.log_loss - lost)


def rollouts_of_several_logs(judge: Balance) -> bool:
    """True when rollouts of several logs judged: what they name holds in each, and the balance of one is no witness."""
    return not judge.forces and len({motion.source for motion in judge.motions}) > 1


def effective_blocks(column: Array, block: NDArray[np.int64]) -> float:
    """Effective number of blocks that carry the square of a column: all where they carry alike, one where one does."""
    carried = np.bincount(block, column**2)
    return float(carried.sum() ** 2 / max(float((carried**2).sum()), np.finfo(float).tiny))
