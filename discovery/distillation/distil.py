"""Distillation: the correction of any model, split into named effects, unnamed terms and memory.

The search runs on what the model claims in place of the measurement: along measured motions the correction is the force
`F_c = M (a_model - a_nominal)`, and it takes the measured side of the weak form.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...measurements.statistics.processors import single_threaded
from ...physics.effects import Effect
from ...physics.errors import RequestError
from ...physics.forces import modelled_acceleration
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import AXES, FORCE_UNITS, Array, Motion
from ...physics.stage import Say, Stage
from ...physics.vehicle import Vehicle
from ...residuals.models.base import Model
from ..balance.weak_form import WeakForm
from ..basis import choose_balance
from ..candidates.candidate import Kind, candidates, measurable
from ..effect_findings import FittedTerm
from ..evidence.weighing import Evidence, found_terms
from ..search.estimation import intervals
from ..search.floating import Search, State
from ..selection import select
from ..settings import DiscoverySettings
from .distilled import AxisShare, Distilled, NamedPart, past_of


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
    return _distilled(model, motions, claims, nominal, settings, say)


def _distilled(
    model: Model,
    motions: Sequence[Motion],
    claims: Sequence[Array],
    nominal: Vehicle,
    settings: DiscoverySettings,
    say: Callable[[str], None],
) -> Distilled:
    name, pool = model.name, candidates(nominal, measurable(motions))
    if not model.remembers:
        pool = tuple(candidate for candidate in pool if not _delays(candidate.effect))
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


def _delays(effect: Effect) -> bool:
    """True when an effect makes the force depend on the motion or the command before: it has a time constant."""
    return any(parameter.unit == "s" for parameter in effect.parameters)


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
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    chosen = [linear.options[key][0] for key in state.active]
    ends = intervals(search.balance, scores, search.pool, chosen, state.vehicle, seed)
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
