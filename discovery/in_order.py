"""Effects that somebody chose by name: fitted one after the other, then together, then under the laws."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

from ..measurements.preparation.held_out import folds_of
from ..physics.effects import BY_NAME, effect_named
from ..physics.errors import RequestError
from ..physics.vehicle import Vehicle, lacking
from .balance.base import Balance
from .basis import Basis
from .calibration.beside_effects import Freed, freed
from .candidates.candidate import Candidate, Kind, candidates, measurable, part_by_sight
from .candidates.linearisation import Option
from .candidates.nuisance import command_timing
from .candidates.unnamed_terms import term_candidate
from .fold_models import FoldModels, models_of_given
from .kept_effects import on_rollouts, without_offset
from .lawful.passivity import Lawful, lawful_model
from .rollout_selection import slender
from .search.bootstrap import Interval, intervals
from .search.floating import Search, State
from .search.gram import GramScores

Step = tuple[str | None, Vehicle]
"""What was added, None for the nominal model, and the vehicle with it."""


@dataclass(frozen=True, slots=True, eq=False)
class Ordered:
    """Effects in the order in which they were added, each fitted beside those before it.

    Attributes
    ----------
    state : of the search after the last
    steps : the vehicle after each, the nominal one first
    """

    state: State
    steps: tuple[Step, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """Effects that somebody chose, fitted together.

    Attributes
    ----------
    basis : what judges the log
    search : over these effects alone
    state : where their fit ended, before the laws
    steps : the vehicle after each effect, the nominal one first and the lawful one last
    scores : of the columns about the fit
    chosen : each effect as it was fitted
    lawful : the model under the laws
    ordered : each effect beside those before it
    """

    basis: Basis
    search: Search
    state: State
    steps: tuple[Step, ...]
    scores: GramScores
    chosen: tuple[Option, ...]
    lawful: Lawful
    ordered: Ordered

    @property
    def intervals(self) -> dict[str, Interval]:
        """See `intervals`."""
        search, settings = self.search, self.basis.settings
        return intervals(search.balance, self.scores, search.pool, self.chosen, self.state.vehicle, settings.seed)

    def unseen(self, *, last: bool = False) -> FoldModels:
        """The models of all steps, or of the `last` alone, fitted anew without each fold; see `models_of_given`."""
        folds = folds_of(self.basis.forces.motions)
        return models_of_given(self.search, folds, self.steps, self.lawful.passivity.envelope, last=last)


def named_candidates(basis: Basis, names: Sequence[str]) -> list[list[Candidate]]:
    """The candidates of each name, as what judges the log can show them.

    Raises
    ------
    RequestError
        for an unknown effect or thruster, an effect given twice, one whose channels a log lacks or for which the
        vehicle file states too little, one that a field log cannot show because its compass is not trusted, or none.
    """
    if not names:
        raise RequestError("add: expected at least one effect by name, for example surge_quadratic_damping")
    for name in names:
        effect = BY_NAME.get(name)
        if effect is not None and (lacks := lacking(basis.nominal, effect)):
            raise RequestError(f"add: {name} {lacks}")
        if effect is not None and effect not in measurable(basis.forces.motions):
            raise RequestError(f"add {name}: expected the channels {' and '.join(effect.channels)} in every log")
    groups = [_candidates(name, basis.nominal) for name in names]
    if len(set(names)) < len(names):
        raise RequestError(f"add: an effect is given twice in {', '.join(names)}; give each once")
    return _visible(basis, names, groups) if basis.rolls else groups


def own_numbers(basis: Basis) -> Freed:
    """The model's own numbers that the log identifies, and the effects that are more than these."""
    weak = basis.cleared_forces() if basis.rolls else basis.forces
    found = freed(weak, basis.nominal, basis.pool, basis.settings.search)
    if not basis.rolls:
        return found
    return found.seen(part_by_sight(slender(found.pool, basis.nominal), basis.blind)[0])


def fit_named(basis: Basis, names: Sequence[str], free: Freed | None, begun: Ordered | None = None) -> Fitted:
    """Fit effects by name, in the order given; see `named_candidates` and `fit_in_order`.

    Parameters
    ----------
    free : the model's own numbers that are fitted beside them, where they are; without any effect, they alone

    Raises
    ------
    RequestError
        for an effect that the model's own numbers would explain as well.
    """
    groups = named_candidates(basis, names) if names or free is None else []
    if free is None:
        return fit_in_order(basis, groups, begun)
    told = [name for name in names if name in free.absorbed]
    if told:
        raise RequestError(f"add {told[0]}: the model's own numbers, which are fitted, would explain the same")
    groups = [_kept(name, group, free.pool) for name, group in zip(names, groups, strict=True)]
    return fit_in_order(basis, groups, begun, [c for c in free.pool if c.kind is Kind.NUISANCE])


def _kept(name: str, group: Sequence[Candidate], free: Sequence[Candidate]) -> list[Candidate]:
    """The candidates of a name as they are beside the model's own numbers."""
    keys = {candidate.key for candidate in group}
    found = [candidate for candidate in free if candidate.key in keys] or (list(group) if ":" in name else [])
    if not found:
        raise RequestError(f"add {name}: it is one of the model's own numbers, which are fitted already")
    return found


def fit_in_order(
    basis: Basis,
    groups: Sequence[Sequence[Candidate]],
    begun: Ordered | None = None,
    free: Sequence[Candidate] = (),
) -> Fitted:
    """Fit effects in the order given, then together, then under the laws.

    Parameters
    ----------
    groups : the candidates of each effect, of which the best is taken
    begun : the first of these effects, where they were fitted before
    free : numbers of the nominal model that are fitted beside them in every model

    Raises
    ------
    RequestError
        when a solver fails.
    """
    nominal, form = basis.nominal, basis.balance()
    groups = [*groups, free]  # the last is never stepped to, but stands in the pool of the search
    search = _search(basis, form, groups)
    ordered = begun or Ordered(search.evaluate(nominal, ()), ((None, nominal),))
    for group in groups[len(ordered.steps) - 1 : -1]:
        state = min((_with(search, ordered.state, candidate) for candidate in group), key=lambda s: s.score)
        ordered = Ordered(state, (*ordered.steps, (state.active[-1], without_offset(state.vehicle))))
    state = search.reshape(ordered.state)
    if basis.rolls:
        search = _search(basis, form.refreshed(state.vehicle), groups)
        state = search.evaluate(state.vehicle, state.active)
        state = search.reshape(on_rollouts(search, state, state.active, basis.settings.shooting))
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    chosen = tuple(linear.options[key][0] for key in state.active)
    lawful = lawful_model(basis.motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    steps = (*ordered.steps[:-1], (ordered.steps[-1][0], lawful.vehicle))
    return Fitted(basis, search, state, steps, scores, chosen, lawful, ordered)


def _search(basis: Basis, form: Balance, groups: Sequence[Sequence[Candidate]]) -> Search:
    pool = list(dict.fromkeys(candidate for group in groups for candidate in group))
    if basis.timed and not basis.forces.claimed:
        pool.insert(0, command_timing(basis.motions))
    return Search(form, basis.nominal, pool, replace(basis.settings.search, refinements=6))


def _with(search: Search, state: State, candidate: Candidate) -> State:
    """The state with a candidate added in its best shape."""
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    now = {key: linear.options[key][0] for key in state.active}
    present = [option for option in linear.options[candidate.key] if option.present]
    best = min(present, key=lambda option: search.quick(scores, {**now, candidate.key: option}))
    return search.apply(state, now, {**now, candidate.key: best}, scores)


def _visible(basis: Basis, names: Sequence[str], groups: Sequence[list[Candidate]]) -> list[list[Candidate]]:
    """The candidates of each name, as rollouts can judge them."""
    seen = []
    for name, group in zip(names, groups, strict=True):
        visible, unseen = part_by_sight(slender(group, basis.nominal), basis.blind)
        if unseen:
            raise RequestError(
                f"add {name}: expected a log that shows forces in sway, but {'; '.join(basis.notes)}; leave {name} "
                "out, or give logs with straight runs on several headings and a compass that is right"
            )
        seen.append(visible)
    return seen


def _candidates(name: str, vehicle: Vehicle) -> list[Candidate]:
    """The candidates that a name means: one, or one for each thruster."""
    if ":" in name:
        axis = name.split(":", 1)[0]
        if axis not in ("surge", "sway", "yaw"):
            raise RequestError(f"term {name!r}: expected surge:, sway: or yaw: before the form, for example yaw:u|r|")
        return [term_candidate(name, vehicle)]
    effect = effect_named(name.split("[")[0])
    found = [c for c in candidates(vehicle) if c.effect is effect and ("[" not in name or c.key == name)]
    if not found:
        keys = [c.key for c in candidates(vehicle)]
        near = get_close_matches(name, keys, n=1, cutoff=0.0)
        raise RequestError(f"unknown effect {name!r} for {vehicle.name}: did you mean {near[0]!r}?")
    return found
