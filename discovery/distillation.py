"""Distillation: the correction of any model, split into named effects, unnamed terms and memory.

The search runs on what the model claims in place of the measurement: along measured motions the correction is the force
`F_c = M (a_model - a_nominal)`, and it takes the measured side of the weak form. Memory is what lagged motion and
thrust predict on held-out blocks beyond the present state.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import PlainSerializer, SerializerFunctionWrapHandler, model_serializer

from ..measurements.statistics.processors import single_threaded
from ..physics.errors import RequestError
from ..physics.file_records import Number, Record
from ..physics.forces import actuation, modelled_acceleration
from ..physics.momentum_balance import mass_matrix
from ..physics.motion import AXES, FORCE_UNITS, Array, Motion
from ..physics.presentation import listing, words
from ..physics.stage import Say, Stage
from ..physics.vehicle import Vehicle
from ..residuals.models.base import Model
from .balance.weak_form import WeakForm
from .basis import DiscoverySettings, choose_balance
from .candidates.candidate import Kind, candidates, measurable
from .candidates.unnamed_terms import features_along
from .effect_findings import FittedTerm, found_terms
from .evidence.weighing import Evidence
from .search.estimation import intervals
from .search.floating import Search, State
from .selection import select

LAGS = (0.3, 0.6, 1.2, 2.4, 4.8)
"""How long before the present velocities and thrusts are looked at [s]."""
_RIDGES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0)
"""In units of a column's mean square: from next to none to as large as the column; the best counts."""
_GUARD = 3.0
"""Rows so near [s] to those that are predicted are not fitted: they share motion with them."""
_FOLDS = 8
"""Stretches of which each is predicted by the others; each fit then sees seven eighths of the log."""


@dataclass(frozen=True, slots=True)
class Past:
    """Shares of the mean square of a force on one axis that linear regressions predict on held-out blocks, 0..1.

    Attributes
    ----------
    present : from the present state: monomials of u, v, r and their moduli to degree three, thrusts and their squares
    memory : what velocities and thrusts at earlier times predict beyond that
    """

    present: float
    memory: float


def past_of(weak: WeakForm, vehicle: Vehicle, force: Array, axes: Sequence[int]) -> dict[int, Past]:
    """Ask of a tested force on some axes what predicts it: the present state, or the past beside it.

    Ridge regressions are fitted to all of the log but one of eight stretches and predict that one; rows within 3 s of
    it are left out of the fit. The best of five ridges counts, for the present and for the past alike.

    Parameters
    ----------
    force : (tests, 3) [N, N, N m]
    axes : indices of the axes that are asked about
    """
    now = np.column_stack([features_along(weak, vehicle, 3)[1], _thrusts(weak, vehicle), np.ones(weak.time.size)])
    both = np.column_stack([now, _before(weak, vehicle)])
    folds = np.minimum(np.arange(weak.time.size) * _FOLDS // weak.time.size, _FOLDS - 1)
    guard = round(_GUARD / weak.settings.stride)
    result = {}
    for axis in axes:
        present, with_past = (_predicted(x, force[:, axis], folds, guard) for x in (now, both))
        result[axis] = Past(present, max(with_past - present, 0.0))
    return result


def _thrusts(weak: WeakForm, vehicle: Vehicle) -> Array:
    """Thrust of each thruster, its modulus and signed square, tested, (tests, 3 thrusters)."""
    thrusts = [actuation(vehicle, motion).thrust.T for motion in weak.motions]
    return weak.average([np.column_stack([t, np.abs(t), t * np.abs(t)]) for t in thrusts])


def _before(weak: WeakForm, vehicle: Vehicle) -> Array:
    """Velocities and thrusts at each lag, tested, (tests, lags (3 + thrusters)); the first row lasts before a log."""
    series = []
    for motion in weak.motions:
        state = np.column_stack([motion.velocity, actuation(vehicle, motion).thrust.T])
        rows = np.arange(state.shape[0])
        series.append(np.column_stack([state[np.maximum(rows - round(s / motion.time_step), 0)] for s in LAGS]))
    return weak.average(series)


def _predicted(features: Array, target: Array, folds: np.ndarray, guard: int) -> float:
    """Share of the mean square of a target that ridge regression predicts on held-out folds, 0..1."""
    scale = np.sqrt((features**2).mean(axis=0))
    alive = scale > 1e-9 * scale.max()
    x = features[:, alive] / scale[alive]
    error = np.zeros(len(_RIDGES))
    for fold in range(_FOLDS):
        rows = np.flatnonzero(folds == fold)
        fitted = np.ones(target.size, dtype=bool)
        fitted[max(rows[0] - guard, 0) : rows[-1] + guard + 1] = False
        left = x[fitted].T @ x[fitted] / fitted.sum()
        right = x[fitted].T @ target[fitted] / fitted.sum()
        for k, ridge in enumerate(_RIDGES):
            answer = np.linalg.solve(left + ridge * np.eye(left.shape[0]), right)
            error[k] += ((target[rows] - x[rows] @ answer) ** 2).sum()
    return float(np.clip(1.0 - error.min() / max(float((target**2).sum()), 1e-300), 0.0, 1.0))


_MOSTLY, _CLEARLY = 0.5, 0.25
"""Share of a remainder that must be predicted for its cause to be told, and the share from which it is memory."""


Told = Annotated[
    FittedTerm, PlainSerializer(lambda term: term.model_dump(mode="json", exclude={"in_model", "inclusion"}))
]
"""A number of a correction: no corrected model holds it, and no ensemble was asked for it."""


class AxisShare(Record):
    """The correction on one axis, and what explains it.

    Attributes
    ----------
    axis, unit : its name, and the unit of its force
    correction : root mean square of the correction's force
    at_work : root mean square of the largest force at work on the axis
    named : share of the correction's mean square that effects explain that are sure; None, as all that follows, where
        the correction is too small to matter. All axes are fitted at once, so that it may be negative here for more on
        another axis, and fall as effects are added
    possible : the same with effects that are not sure
    explained : the same with terms that nobody has named
    remainder : root mean square of what is left after all of these
    past : what predicts the remainder; None where it is too small to matter
    """

    axis: str
    unit: str
    correction: Number
    at_work: Number
    named: Number | None = None
    possible: Number | None = None
    explained: Number | None = None
    remainder: Number | None = None
    past: Past | None = None

    @property
    def matters(self) -> bool:
        """True when the correction is large enough to ask what it is."""
        return self.named is not None

    @property
    def traded(self) -> bool:
        """True when more effects explain less of this axis, or they make it worse: they were fitted for another one."""
        if self.named is None or self.possible is None or self.explained is None:
            return False
        return self.named < -0.01 or self.possible < self.named - 0.01 or self.explained < self.possible - 0.01

    @property
    def sentence(self) -> str:
        """The axis in words."""
        size = f"{self.correction:.2g} {self.unit}, {_percent(self.correction / self.at_work)} of the force at work"
        if self.named is None or self.possible is None or self.explained is None:
            return f"{self.axis}: the correction ({size}) is too small to matter."
        text = f"{self.axis}: of the correction ({size}), named effects explain {_share(self.named)}"
        if abs(self.possible - self.named) > 0.01:
            text += f", with effects that are not sure {_share(self.possible)}"
        if abs(self.explained - self.possible) > 0.01:
            text += f", with terms that nobody has named {_share(self.explained)}"
        if self.traded:
            text += " (all axes are fitted at once, and some effects explain less here for more on another axis)"
        if self.past is None:
            return f"{text}; what remains is too small to matter."
        return f"{text}. Of what remains ({self.remainder:.2g} {self.unit}), {_cause(self.past)}."

    @model_serializer(mode="wrap")
    def _with_shares_together(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        content: dict[str, object] = handler(self)
        told = {name: content[name] for name in ("axis", "unit", "correction", "at_work")}
        share = {"named": self.named, "with_possible": self.possible, "with_unnamed": self.explained}
        rest = {"remainder": content["remainder"], "share_of_remainder": content["past"]}
        return {**told, "matters": self.matters, "share": share, **rest}


class NamedPart(Record):
    """An effect of the catalogue in a correction.

    Attributes
    ----------
    effect, meaning : its name, and what it is
    verdict : "named" when it is sure, else "possible"
    confidence : share of block resamples in which it earns its price and matters, divided by its look-alikes
    share : share of the correction's mean square that only it explains, by axis on which the correction matters
    indistinguishable_from : effects that explain the correction as well in its place
    terms : its numbers
    """

    effect: str
    meaning: str
    verdict: Literal["named", "possible"]
    confidence: Number
    share: dict[str, Number]
    indistinguishable_from: tuple[str, ...]
    terms: tuple[Told, ...]


class Distilled(Record):
    """Shares of a model's correction: named effects, terms, memory, and the remainder.

    Attributes
    ----------
    model, nominal : names of the model, and of the vehicle that it corrects
    axes : surge, sway and yaw
    effects : of the catalogue, the sure and the largest first
    unnamed : terms that no effect stands for
    seconds : of motion along which the correction was looked at [s]
    """

    model: str
    nominal: str
    axes: tuple[AxisShare, ...]
    effects: tuple[NamedPart, ...]
    unnamed: tuple[Told, ...]
    seconds: Number

    SCHEMA: ClassVar[str] = "undertow.distillation/1"

    @property
    def headline(self) -> str:
        """The answer in a sentence."""
        if not any(axis.matters for axis in self.axes):
            return f"Nothing to distil: what {self.model} adds to {self.nominal} is too small to matter on every axis."
        names = [words(part.effect) for part in self.effects if part.verdict == "named"]
        if not names:
            return f"No named effect is found for sure in what {self.model} adds to {self.nominal}."
        return f"Along this motion, what {self.model} adds to {self.nominal} holds {listing(names)}."

    @property
    def sentences(self) -> list[str]:
        """The answer, and each axis, in words."""
        return [self.headline, *(axis.sentence for axis in self.axes)]

    @model_serializer(mode="wrap")
    def _with_sentences(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        content: dict[str, object] = handler(self)
        names = {"model": content.pop("model"), "nominal": content.pop("nominal")}
        data = {"seconds": content.pop("seconds")}
        return {**names, "headline": self.headline, "sentences": self.sentences, **content, "data": data}


def _cause(past: Past) -> str:
    memory, present = _percent(past.memory), _percent(past.present)
    if past.memory >= _CLEARLY:
        return (
            f"{memory} is memory: it follows from the motion before, beyond what the present state predicts ({present})"
        )
    if past.memory + past.present < _MOSTLY:
        return (
            f"the present state predicts {present} and the motion before {memory} more: most of it is neither a law of "
            "the state nor a memory of the last seconds"
        )
    return f"the present state predicts {present}, in no form that has a name, and the motion before {memory} more"


def _share(share: float) -> str:
    """A share of the correction, in words where it has no meaning: what is left may be larger than all of it."""
    return _percent(share) if share > -0.01 else "nothing"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if abs(share) >= 0.01 else "less than 1 %"


@single_threaded
def distil_model(
    model: Model,
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings | None = None,
    progress: Say | None = None,
) -> Distilled:
    """Name what a model adds to a nominal vehicle along measured motions.

    Parameters
    ----------
    model : any model of accelerations; a network knows only the time step that it was trained on
    motions : gap-free stretches with that time step, prepared as for the model
    nominal : what the correction is a correction of
    settings : of the search
    progress : called with a line for each step

    Raises
    ------
    RequestError
        when the motions are too short, or the model gives accelerations that are not finite.
    """
    settings, say = settings or DiscoverySettings(), progress or (lambda text: None)
    claims = [np.asarray(model.acceleration(motion), dtype=float) for motion in motions]
    if not all(np.isfinite(claim).all() for claim in claims):
        raise RequestError(f"distil {model.name}: expected finite accelerations, got some that are not; train it again")
    name, pool = model.name, candidates(nominal, measurable(motions))
    if not model.remembers:  # no effect with a time constant, by which the force depends on what was before
        pool = tuple(c for c in pool if not any(parameter.unit == "s" for parameter in c.parameters))
    basis = choose_balance(motions, nominal, settings, claims, pool)
    weak, search = basis.forces, basis.force_search
    correction = weak.residual(nominal)
    size = np.sqrt((correction**2).mean(axis=0))
    smallest = settings.search.materiality * search.force_scale
    matters = size >= smallest
    seconds = float(sum(motion.duration for motion in motions))

    def blank(axis: int) -> AxisShare:
        scale = float(search.force_scale[axis])
        return AxisShare(axis=AXES[axis], unit=FORCE_UNITS[axis], correction=float(size[axis]), at_work=scale)

    if not matters.any():
        axes = tuple(map(blank, range(3)))
        return Distilled(model=name, nominal=nominal.name, axes=axes, effects=(), unnamed=(), seconds=seconds)
    weak.independent = seconds / max(settings.weak.half_width, _memory_time(correction, size / smallest, weak))
    looked = select(basis, say)
    search, state = looked.search, looked.state

    def left(of: State) -> Array:
        """What a model leaves of the correction, tested, (tests, 3), as a force on the nominal mass."""
        pairs = zip(motions, claims, strict=True)
        return weak.average([(c - modelled_acceleration(of.vehicle, m)) @ mass_matrix(nominal) for m, c in pairs])

    def share(of: State) -> Array:
        return 1.0 - (left(of) ** 2).mean(axis=0) / np.maximum(size**2, 1e-300)

    selected = [e for e in looked.evidence if e.selected]
    sure = [e.key for e in selected if e.sure and e.kind is Kind.EFFECT]
    perhaps = [e.key for e in selected if not e.sure and e.kind is Kind.EFFECT]
    certain, named = search.restrict(state, sure), search.restrict(state, [*sure, *perhaps])
    remainder = left(state)
    rest = np.sqrt((remainder**2).mean(axis=0))
    say(Stage("asking what remains for memory"))
    past = past_of(weak, nominal, remainder, [a for a in range(3) if matters[a] and rest[a] >= smallest[a]])
    if not model.remembers:  # what goes with the past goes with it through the present state
        past = {axis: replace(found, memory=0.0) for axis, found in past.items()}
    shares = np.stack([share(certain), share(named), share(state)], axis=1).tolist()
    axes = tuple(
        blank(a).but(named=x[0], possible=x[1], explained=x[2], remainder=float(rest[a]), past=past.get(a))
        if matters[a]
        else blank(a)
        for a, x in enumerate(shares)
    )
    terms = _terms(search, state, nominal, settings.seed)
    parts = tuple(_part(search, state, e, terms[e.key], share, matters) for e in selected if e.kind is Kind.EFFECT)
    parts = tuple(sorted(parts, key=lambda part: (part.verdict != "named", -max(part.share.values()))))
    unnamed = tuple(t for e in selected if e.kind is Kind.TERM for t in terms[e.key])
    return Distilled(model=name, nominal=nominal.name, axes=axes, effects=parts, unnamed=unnamed, seconds=seconds)


def _part(
    search: Search,
    state: State,
    e: Evidence,
    terms: tuple[FittedTerm, ...],
    share: Callable[[State], Array],
    matters: np.ndarray,
) -> NamedPart:
    lost = share(state) - share(search.without(state, e.key))
    by_axis = {AXES[a]: float(np.clip(lost[a], 0.0, 1.0)) for a in range(3) if matters[a]}
    effect = next(c.effect for c in search.pool if c.key == e.key)
    return NamedPart(
        effect=effect.name,
        meaning=effect.meaning,
        verdict="named" if e.sure else "possible",
        confidence=e.confidence,
        share=by_axis,
        indistinguishable_from=e.indistinguishable_from,
        terms=terms,
    )


def _terms(search: Search, state: State, nominal: Vehicle, seed: int) -> dict[str, tuple[FittedTerm, ...]]:
    """Numbers of everything in a model, with intervals, by key."""
    _, scores, now = search.about(state)
    ends = intervals(search.balance, scores, search.pool, list(now.values()), state.vehicle, seed)
    pool = {candidate.key: candidate for candidate in search.pool}
    return {key: found_terms(pool[key], nominal, state.vehicle, ends) for key in state.active}


def _memory_time(correction: Array, weight: Array, weak: WeakForm) -> float:
    """Time over which the largest part of the correction is correlated with itself [s].

    Twice the integral of the autocorrelation up to its first zero: stretches shorter than that are no independent
    evidence for a name, or a slow random force would be taken for a law.
    """
    y = correction[:, int(np.argmax(weight))]
    y = y - y.mean()
    spectrum = np.fft.rfft(y, 2 * y.size)
    rho = np.fft.irfft(np.abs(spectrum) ** 2)[: y.size]
    rho = rho / max(float(rho[0]), 1e-300)
    first = int(np.argmax(rho <= 0.0)) if (rho <= 0.0).any() else y.size
    return weak.settings.stride * (1.0 + 2.0 * float(rho[1:first].sum()))
