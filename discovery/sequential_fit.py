"""Effects that somebody chose by name: fitted one after the other, then together, then under the laws."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

from ..measurements.preparation.split import folds_of
from ..physics.effects import BY_NAME, effect_named
from ..physics.errors import RequestError
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle, lacking
from .balance.base import Balance
from .basis import LEAVES, Basis, DiscoverySettings, choose_balance
from .calibration.before_calibration import FreeParameters, free_parameters
from .candidates.candidate import CALIBRATED, Candidate, Kind, candidates, command_timing, measurable
from .candidates.linearisation import Option
from .candidates.unnamed_terms import term_candidate
from .findings import Findings
from .lawful.refit import Lawful, judge_passivity, lawful_model
from .run_models import FoldModels, RunModels, models_of_given, polish_on_rollouts, without_offset
from .search.estimation import Interval, intervals
from .search.floating import Search, State
from .search.gram import GramScores
from .selection import limit_surge_added_mass

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
    steps : the vehicle after each effect, the nominal one first, then that with its own numbers fitted, where they are,
        and the lawful one last
    scores : of the columns about the fit
    chosen : each effect as it was fitted
    lawful : the model under the laws
    ordered : each effect beside those before it
    run : the models of that run; None where there is none
    """

    basis: Basis
    search: Search
    state: State
    steps: tuple[Step, ...]
    scores: GramScores
    chosen: tuple[Option, ...]
    lawful: Lawful
    ordered: Ordered
    run: RunModels | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The effects, each on the thruster on which it was fitted."""
        return _names(self.steps)

    @property
    def whole(self) -> bool:
        """True when it is the model of the run, with all that this found and nothing else."""
        return self.run is not None and self.run.is_complete(self.names)

    @property
    def intervals(self) -> dict[str, Interval]:
        """See `intervals`; of the model of a run those that it told."""
        search, settings = self.search, self.basis.settings
        found = intervals(search.balance, self.scores, search.pool, self.chosen, self.state.vehicle, settings.seed)
        return found | dict(self.run.intervals) if self.run is not None and self.whole else found

    def unseen(self, *, last: bool = False) -> FoldModels:
        """The models of all steps, or of the `last` alone, fitted anew without each fold; see `models_of_given`.

        Those of steps of the run are the run's.
        """
        folds, asked = folds_of(self.basis.forces.motions), range(1, len(self.steps))
        known = [self._of_run(number, len(folds)) for number in (asked[-1:] if last else asked)]
        if known and all(known):
            return FoldModels(tuple(folds), (), (), tuple(known))
        made = models_of_given(self.search, folds, self.steps, self.lawful.passivity.envelope, last=last)
        if not known:
            return made
        return replace(made, steps=tuple(run or own for run, own in zip(known, made.steps, strict=True)))

    def _of_run(self, number: int, folds: int) -> tuple[Vehicle, ...]:
        """The run's models without each fold at a step; none where the step is not the run's."""
        step = self.run.step(_names(self.steps[: number + 1])) if self.run is not None else None
        same = step is not None and step.vehicle.values == self.steps[number][1].values
        return step.unseen if step is not None and same and len(step.unseen) == folds else ()


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
    return [limit_surge_added_mass(group, basis.nominal) for group in groups] if basis.uses_rollouts else groups


def own_numbers(basis: Basis) -> FreeParameters:
    """The model's own numbers that the log identifies, and the effects that are more than these."""
    weak = basis.cleared_forces() if basis.uses_rollouts else basis.forces
    result = free_parameters(weak, basis.nominal, basis.pool, basis.settings.search)
    if not basis.uses_rollouts:
        return result
    pool = limit_surge_added_mass(result.pool, basis.nominal)
    return result.seen([c for c in pool if not c.nuisance or basis.judges(c)])


def basis_for(
    motions: Sequence[Motion], nominal: Vehicle, settings: DiscoverySettings, searched: Findings | None
) -> Basis:
    """The basis on which effects are added: by rollouts, too, where a search was judged by them in the end.

    Parameters
    ----------
    motions : measured
    nominal : the model to which effects are added
    settings : of discovery
    searched : findings of a search of these motions, if there was one
    """
    basis, run = choose_balance(motions, nominal, settings), RunModels.of(searched, nominal)
    return basis.with_rollouts(LEAVES) if run is not None and run.rolls and not basis.uses_rollouts else basis


def fit_named(
    basis: Basis,
    names: Sequence[str],
    free: FreeParameters | None,
    begun: Ordered | None = None,
    searched: Findings | None = None,
) -> Fitted:
    """Fit effects by name, in the order given; see `named_candidates` and `fit_in_order`.

    Parameters
    ----------
    free : the model's own numbers that are fitted beside them, where they are; without any effect, they alone
    searched : findings of the run to which they are added: what its model has, has its numbers

    Raises
    ------
    RequestError
        for an effect that the model's own numbers would explain as well.
    """
    run = RunModels.of(searched, basis.nominal)
    run = run if run is not None and run.own == bool(free and free.symbols) else None
    groups = _groups(basis, names, free) if names or free is None else []
    own = [] if free is None else [c for c in free.pool if c.kind is Kind.NUISANCE]
    if run is None:
        return fit_in_order(basis, groups, begun, own)
    others = _groups(basis, run.names, free) if run.names else []
    found = [[candidate for candidate in group if candidate.key in run.names] or group for group in groups]
    return fit_in_order(basis, found, begun, own, (run, others))


def _groups(basis: Basis, names: Sequence[str], free: FreeParameters | None) -> list[list[Candidate]]:
    """The candidates of each name, as they are beside the model's own numbers where these are fitted."""
    groups = named_candidates(basis, names)
    if free is None:
        return groups
    told = [name for name in names if name in free.absorbed]
    if told:
        raise RequestError(f"add {told[0]}: the model's own numbers, which are fitted, would explain the same")
    return [_kept(name, group, free.pool) for name, group in zip(names, groups, strict=True)]


def _kept(name: str, group: Sequence[Candidate], free: Sequence[Candidate]) -> list[Candidate]:
    """The candidates of a name as they are beside the model's own numbers."""
    keys = {candidate.key for candidate in group}
    result = [candidate for candidate in free if candidate.key in keys] or (list(group) if ":" in name else [])
    if not result:
        raise RequestError(f"add {name}: it is one of the model's own numbers, which are fitted already")
    return result


def fit_in_order(
    basis: Basis,
    groups: Sequence[Sequence[Candidate]],
    begun: Ordered | None = None,
    free: Sequence[Candidate] = (),
    of_run: tuple[RunModels, Sequence[Sequence[Candidate]]] | None = None,
) -> Fitted:
    """Fit effects in the order given, then together, then under the laws.

    Parameters
    ----------
    groups : the candidates of each effect, of which the best is taken
    begun : the first of these effects, where they were fitted before
    free : numbers of the nominal model that are fitted beside them in every model
    of_run : the models of a run to which these are added, and the candidates of its effects: a step that is one of the
        run's is that model, and another part of the run's model is fitted from it, as the run fits its own

    Raises
    ------
    RequestError
        when a solver fails.
    """
    nominal, form = basis.nominal, basis.balance()
    run, others = of_run or (None, ())
    pooled = [*groups, *others, free]  # the last are never stepped to, but stand in the pool of the search
    whole = None
    if run is not None:
        form = form.refreshed(run.last.vehicle) if basis.uses_rollouts else form
        search = _search(basis, form, pooled)
        whole = search.evaluate(run.last.vehicle, run.names)
        start = search.restrict(whole, ())
    else:
        search = _search(basis, form, pooled)
        start = search.evaluate(nominal, ())
    ordered = begun or Ordered(start, _begin(nominal, start, free, run))
    first = len(_begin(nominal, start, free, run))
    for group in groups[len(ordered.steps) - first :]:
        before = _names(ordered.steps)
        key = group[0].key
        if run is not None and whole is not None and len(group) == 1 and run.holds((*before, key)):
            state = search.restrict(whole, (*before, key))
            known = run.step((*before, key))
        else:
            state, known = min((_with(search, ordered.state, one) for one in group), key=lambda s: s.score), None
            key = state.active[-1]
        vehicle = known.vehicle if known is not None else without_offset(state.vehicle)
        ordered = Ordered(state, (*ordered.steps, (key, vehicle)))
    if run is not None:  # what else the run found is no rival of what was asked for
        pooled = [*groups, free]
        search = _search(basis, form, pooled)
    names = _names(ordered.steps)
    state, known = ordered.state, run.step(names) if run is not None else None
    if run is None or not run.holds(names):
        state = search.reshape(state)
    if basis.uses_rollouts and known is None:
        search = _search(basis, form.refreshed(state.vehicle), pooled)
        state = search.evaluate(state.vehicle, state.active)
        state = search.reshape(polish_on_rollouts(search, state, state.active, basis.settings.shooting))
    _, scores, now = search.about(state)
    chosen = tuple(now.values())
    lawful = lawful_model(basis.motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    if run is not None and known is not None:
        lawful = _as_run(run, known.vehicle, lawful, whole=run.is_complete(names))
    steps = (*ordered.steps[:-1], (ordered.steps[-1][0], lawful.vehicle))
    return Fitted(basis, search, state, steps, scores, chosen, lawful, ordered, run)


def _names(steps: Sequence[Step]) -> tuple[str, ...]:
    """What steps added, without the fit of the model's own numbers."""
    return tuple(label for label, _ in steps if label not in (None, CALIBRATED))


def _begin(nominal: Vehicle, start: State, free: Sequence[Candidate], run: RunModels | None) -> tuple[Step, ...]:
    """The nominal model, and that with its own numbers fitted, where they are."""
    if not free:
        return ((None, nominal),)
    known = run.step(()) if run is not None else None
    return (None, nominal), (CALIBRATED, known.vehicle if known is not None else without_offset(start.vehicle))


def _as_run(run: RunModels, vehicle: Vehicle, fitted: Lawful, *, whole: bool) -> Lawful:
    """The model of a run's step in the place of the one that was fitted, unless a step on the way breaks the law."""
    told = run.findings.passivity if whole else None
    stands = told or judge_passivity(vehicle, fitted.passivity.envelope)
    return replace(fitted, vehicle=vehicle, passivity=stands) if whole or stands.verdict == "pass" else fitted


def _search(basis: Basis, form: Balance, groups: Sequence[Sequence[Candidate]]) -> Search:
    pool = list({candidate.key: candidate for group in groups for candidate in group}.values())
    if basis.timed and not basis.forces.claimed:
        pool.insert(0, command_timing(basis.motions))
    return Search(form, basis.nominal, pool, replace(basis.settings.search, refinements=6))


def _with(search: Search, state: State, candidate: Candidate) -> State:
    """The state with a candidate added in its best shape."""
    linear, scores, now = search.about(state)
    present = [option for option in linear.options[candidate.key] if option.present]
    best = min(present, key=lambda option: search.score_linearised(scores, {**now, candidate.key: option}))
    return search.apply(state, now, {**now, candidate.key: best}, scores)


def _candidates(name: str, vehicle: Vehicle) -> list[Candidate]:
    """The candidates that a name means: one, or one for each thruster."""
    if ":" in name:
        axis = name.split(":", 1)[0]
        if axis not in ("surge", "sway", "yaw"):
            raise RequestError(f"term {name!r}: expected surge:, sway: or yaw: before the form, for example yaw:u|r|")
        return [term_candidate(name, vehicle)]
    effect = effect_named(name.split("[")[0])
    result = [c for c in candidates(vehicle) if c.effect is effect and ("[" not in name or c.key == name)]
    if not result:
        keys = [c.key for c in candidates(vehicle)]
        near = get_close_matches(name, keys, n=1, cutoff=0.0)
        raise RequestError(f"unknown effect {name!r} for {vehicle.name}: did you mean {near[0]!r}?")
    return result
