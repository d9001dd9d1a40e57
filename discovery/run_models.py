"""Models of a run: its kept effects refitted, those of its steps, and those selected and fitted without one fold.

The models of a finished run carry the numbers it found; adding an effect of that run does not fit it a second way.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from ..measurements.preparation.split import Fold
from ..measurements.statistics.processors import parallel_map
from ..physics.effects import BY_NAME, COMMAND_OFFSET
from ..physics.laws.damping_power import Envelope
from ..physics.motion import AXES, FORCE_UNITS
from ..physics.plausibility import find_impossible
from ..physics.vehicle import Vehicle
from .balance.shooting import ShootingSettings
from .candidates.candidate import CALIBRATED, Kind, at_limit
from .candidates.linearisation import Linearisation, Option
from .effect_findings import FoldRecord, Folds
from .evidence.invariance import ENOUGH_BLOCKS
from .findings import Findings, Step
from .lawful.refit import passive_refit
from .search.estimation import Interval, polish
from .search.floating import Search, State, WithoutFold, hold_unseen
from .search.gram import GramScores
from .selection import without_effects

TOO_SHORT = "Undecided: this log is too short to be sure of anything."
WHY_TOO_SHORT = (
    "Rollouts with commands fill {blocks} independent blocks of it, and to be sure of anything takes {enough}; give a "
    "longer log, or several together."
)


def too_short(findings: Findings, blocks: int) -> Findings:
    """Findings of rollouts that do not say that nothing is missing where a log has too few blocks to be sure of it."""
    if findings.verdict != "nothing missing" or blocks >= ENOUGH_BLOCKS:
        return findings
    why = WHY_TOO_SHORT.format(blocks=blocks, enough=ENOUGH_BLOCKS)
    return findings.but(verdict="undecided", headline=TOO_SHORT, reasons=(why,))


def add_subthreshold(search: Search, final: State, untold: Sequence[str], shooting: ShootingSettings) -> State:
    """The kept effects with those beside them that the log cannot tell from nothing, where its unseen parts gain by it.

    What is named needs certainty, what predicts only the better guess. Where nothing is kept nothing joins it, nor does
    what stands at a limit, or what makes a hull impossible.

    Parameters
    ----------
    search : of the log
    final : the model with the kept effects
    untold : keys of the effects that may join, in the order in which they are tried
    shooting : of the rollouts on which they are polished
    """
    if not search.named(final.active):
        return final
    best = final
    for key in (key for key in untold if key not in final.active):
        active = (*best.active, key)
        more = polish_on_rollouts(search, search.evaluate(best.vehicle, active), active, shooting)
        if more.score < best.score and _possible(search, best, more, key):
            best = more
    return best


def _possible(search: Search, before: State, after: State, key: str) -> bool:
    """True when an effect that joins a model is one that a hull can have."""
    (candidate,) = (c for c in search.pool if c.key == key)
    nominal, found = search.nominal, after.vehicle
    if at_limit(candidate, nominal, found):
        return False
    known, now = (find_impossible(vehicle.values, vehicle.thrusters) for vehicle in (before.vehicle, found))
    return set(now) <= set(known)


def polish_on_rollouts(search: Search, state: State, kept: Sequence[str], shooting: ShootingSettings) -> State:
    """A model polished on its rollouts, where that betters its score; the same on the force balance.

    Parameters
    ----------
    search, state : the search and the model to polish
    kept : keys of its effects
    shooting : of the rollouts
    """
    form = search.balance
    symbols = [s for c in search.pool if c.fitted(kept) for s in c.symbols]
    if not symbols or form.forces:
        return state
    limits = {p.symbol: (p.lower, p.upper) for c in search.pool for p in c.parameters}
    polished = polish(form.motions, state.vehicle, symbols, shooting, limits=limits).vehicle
    return min((state, search.evaluate(polished, kept)), key=lambda s: s.score)


def add_stepwise(search: Search, final: State, corrected: Vehicle) -> tuple[tuple[str | None, Vehicle], ...]:
    """Calibrate, where that is wanted, and add the kept effects one by one, the most valuable first, refitted.

    Parameters
    ----------
    final : the model with the kept effects
    corrected : the vehicle that is written, for the last step
    """
    found: list[tuple[str | None, Vehicle]] = [(None, search.nominal)]
    effects: Sequence[str] = search.named(final.active)
    if search.of_kind(search.nuisances, Kind.NUISANCE):
        found.append((CALIBRATED, without_effects(search, final) if effects else corrected))
    chosen: tuple[str, ...] = ()
    fitted = partial(search.restrict, final)
    while len(chosen) < len(effects) - 1:
        more: list[tuple[str, ...]] = [(*chosen, key) for key in effects if key not in chosen]
        # On the force balance a model is fitted before a process would be forked.
        trials = list(map(fitted, more)) if search.balance.forces else parallel_map(fitted, more)
        best, chosen = min(zip(trials, more, strict=True), key=lambda pair: pair[0].score)
        found.append((chosen[-1], best.vehicle))
    found += [(key, corrected) for key in effects if key not in chosen]
    return tuple((label, without_offset(vehicle)) for label, vehicle in found)


def without_offset(vehicle: Vehicle) -> Vehicle:
    """A vehicle without what the record of the commands does wrong: the model's, not the log's."""
    return vehicle.with_values({COMMAND_OFFSET.symbol: 0.0})


@dataclass(frozen=True, slots=True, eq=False)
class RunStep:
    """A step of a run: what it added, the model after it, and the same fitted without each fold, where any was."""

    label: str
    vehicle: Vehicle
    unseen: tuple[Vehicle, ...]


@dataclass(frozen=True, slots=True, eq=False)
class RunModels:
    """The models of a run, step by step.

    Attributes
    ----------
    findings : of the run
    nominal : the vehicle that it corrects
    steps : after the nominal model
    """

    findings: Findings
    nominal: Vehicle
    steps: tuple[RunStep, ...]

    @classmethod
    def of(cls, findings: Findings | None, nominal: Vehicle) -> "RunModels | None":
        """The models that findings hold; None where they hold none, as those of an earlier version."""
        steps = findings.steps[1:] if findings else ()
        if findings is None or not steps or not all(step.values for step in steps):
            return None
        name = f"{nominal.name}, corrected"
        judged = findings.folds is not None and bool(findings.folds.models)  # by folds, and not by a part kept aside
        made = [
            RunStep(
                _label(step),
                nominal.with_values(step.values, name=name),
                tuple(nominal.with_values(values) for values in step.unseen) if judged else (),
            )
            for step in steps
        ]
        return cls(findings, nominal, tuple(made))

    @property
    def own(self) -> bool:
        """True when the file's own numbers are fitted in them."""
        return self.steps[0].label == CALIBRATED

    @property
    def rolls(self) -> bool:
        """True when rollouts judged the run, and not the force balance."""
        return self.findings.criterion.unit.get(AXES[0], FORCE_UNITS[0]) != FORCE_UNITS[0]

    @property
    def names(self) -> tuple[str, ...]:
        """The effects and terms of the run's model, in the order of its steps."""
        return tuple(step.label for step in self.steps if step.label != CALIBRATED)

    @property
    def last(self) -> RunStep:
        """The run's model."""
        return self.steps[-1]

    def holds(self, names: Sequence[str]) -> bool:
        """True when the run's model has all of these."""
        return set(names) <= set(self.names)

    def is_complete(self, names: Sequence[str]) -> bool:
        """True when these are all that the run's model has."""
        return set(names) == set(self.names)

    def step(self, names: Sequence[str]) -> RunStep | None:
        """The step of the run whose model has these effects and no others; None where it has none."""
        found: set[str] = set()
        for one in self.steps:
            found |= {one.label} - {CALIBRATED}
            if found == set(names):
                return one
        return None

    @property
    def intervals(self) -> Mapping[str, Interval]:
        """95 % intervals of the numbers of the run's model, by symbol, as a corrected file has them."""
        found = {one.symbol: one.ci95 for one in self.findings.calibrated if one.ci95 is not None}
        for effect in self.findings.added:
            for term in effect.terms:
                if term.ci95 is not None:
                    added = effect.effect in BY_NAME and BY_NAME[effect.effect].added
                    more = self.nominal.value(term.symbol) if added else 0.0
                    found[term.symbol] = Interval(term.ci95.lower + more, term.ci95.upper + more)
        return found | {f"{t.axis}:{t.form}": t.ci95 for t in self.findings.unnamed if t.ci95 is not None}


def resolve_names(findings: Findings | None, effects: Sequence[str]) -> list[str]:
    """Effects by name, each on the thrusters on which a run found it where the name tells no thruster."""
    steps = [step for step in findings.steps if step.thruster] if findings else []
    found = [(name, [_label(step) for step in steps if step.added == name]) for name in effects]
    return [each for name, meant in found for each in (meant or [name])]


def values_of_step(vehicle: Vehicle, nominal: Vehicle) -> dict[str, float]:
    """Values of a model in the place of the nominal model's numbers, by symbol."""
    return {symbol: value for symbol, value in vehicle.values.items() if value != nominal.value(symbol)}


def _label(step: Step) -> str:
    return f"{step.added}[{step.thruster}]" if step.thruster else str(step.added)


@dataclass(frozen=True, slots=True)
class FoldModels:
    """Models of a discovery, each selected and fitted without one fold.

    Attributes
    ----------
    folds : what each model has not seen
    named : the effects of each model, of which the whole log is not unsure
    found : the effects of the whole log that come out of the fold whatever its search begins with, or of which the rest
        of the log shows too little
    steps : for each step of the discovery after the nominal model, the vehicle of each fold
    """

    folds: tuple[Fold, ...]
    named: tuple[tuple[str, ...], ...]
    found: tuple[tuple[str, ...], ...]
    steps: tuple[tuple[Vehicle, ...], ...]

    def recorded(self, nominal: Vehicle, sources: Sequence[str]) -> tuple[FoldRecord, ...]:
        """The folds and what their last models change of the nominal one, for logs by their sources."""
        last = self.steps[-1] if self.steps else (nominal,) * len(self.folds)
        return tuple(
            FoldRecord(
                stretches=tuple((sources.index(source), begin, end) for source, begin, end in fold.stretches),
                values=values_of_step(vehicle, nominal),
            )
            for fold, vehicle in zip(self.folds, last, strict=True)
        )

    def counted(self, kept: Sequence[str]) -> Folds:
        """In how many folds each effect came out, and all that were kept with no other."""
        named = Counter(key for names in self.found for key in names)
        every = {key: named[key] for key in dict.fromkeys((*kept, *sorted(named)))}
        pairs = zip(self.named, self.found, strict=True)
        same = sum(set(names) == set(sure) == set(kept) for names, sure in pairs)
        return Folds(count=len(self.folds), same_names=same, named=every)


def fold_models(
    search: Search,
    folds: Sequence[Fold],
    state: State,
    final: State,
    about: tuple[Linearisation, GramScores],
    envelope: Envelope,
    untold: Collection[str] = (),
) -> FoldModels:
    """Select and fit anew without each fold; of the steps the last alone, see `with_steps`.

    Parameters
    ----------
    folds : of the whole log: where rollouts judge, what is too short for one is not in the search, but it is judged
    state : what the search selected on the whole log
    final : the part of it that was kept; what was not is kept out of the models of folds, too
    about : columns and scores about it
    envelope : over which the laws hold
    untold : effects that are in the model and not named; they are not counted

    Raises
    ------
    RequestError
        when a solver fails.
    """
    unsure = set(search.named(state.active)) - set(search.named(final.active))
    linear, whole = about
    blind = [WithoutFold(search, fold) for fold in folds]

    def anew(one: WithoutFold) -> tuple[tuple[str, ...], tuple[str, ...], Vehicle]:
        scores = one.seen(linear, whole)
        chosen, found = one.choose(linear, scores, final, untold)
        kept = [option for key, option in chosen.items() if key not in unsure or not option.present]
        named = one.named([option.key for option in kept if option.present and option.key not in untold])
        sure = tuple(key for key in found if key not in unsure and key not in untold)
        return named, sure, _fitted(scores, kept, search.nominal, envelope)

    selected = parallel_map(anew, blind)
    named, sure = tuple(names for names, _, _ in selected), tuple(names for _, names, _ in selected)
    last = tuple(vehicle for _, _, vehicle in selected)
    return FoldModels(tuple(folds), named, sure, (last,))


def with_steps(
    unseen: FoldModels, search: Search, steps: Sequence[tuple[str | None, Vehicle]], envelope: Envelope
) -> FoldModels:
    """The models of all steps of a discovery without each fold, where those of the last are known; none without steps.

    Parameters
    ----------
    steps : of the discovery, the nominal model first
    """
    blind = [WithoutFold(search, fold) for fold in unseen.folds]
    between = _refitted(search, blind, steps[1:-1], envelope)
    return replace(unseen, steps=(*between, *unseen.steps) if len(steps) > 1 else ())


def models_of_given(
    search: Search,
    folds: Sequence[Fold],
    steps: Sequence[tuple[str | None, Vehicle]],
    envelope: Envelope,
    *,
    last: bool = False,
) -> FoldModels:
    """Fit effects that somebody chose, so that no fold selects any, anew without each fold; see `fold_models`.

    Parameters
    ----------
    last : of the last step alone
    """
    blind = [WithoutFold(search, fold) for fold in folds]
    known = {candidate.key for candidate in search.pool}
    before = [label for label, _ in steps[1:-1] if label in known] if last else []
    asked = steps[-1:] if last else steps[1:]
    return FoldModels(tuple(folds), (), (), tuple(_refitted(search, blind, asked, envelope, before)))


def _refitted(
    search: Search,
    blind: Sequence[WithoutFold],
    steps: Sequence[tuple[str | None, Vehicle]],
    envelope: Envelope,
    before: Sequence[str | None] = (),
) -> list[tuple[Vehicle, ...]]:
    """The models of steps fitted without each fold: a Gauss-Newton step from the fit to the whole log.

    Parameters
    ----------
    before : what the steps before these added
    """
    result, named = [], [key for key in before if key is not None]
    known = {candidate.key: candidate for candidate in search.pool}
    for label, vehicle in steps:
        named += [label] if label in known else []
        active = [*(c.key for c in search.pool if c.nuisance and c.fitted(named)), *named]
        linear, whole = search.linearise(vehicle, active, pool=[known[key] for key in active], standing=True)
        chosen = [linear.options[key][0] for key in active]
        scores = [one.seen(linear, whole) for one in blind]
        result.append(tuple(_fitted(one, chosen, search.nominal, envelope) for one in scores))
    return result


def _fitted(scores: GramScores, chosen: Sequence[Option], nominal: Vehicle, envelope: Envelope) -> Vehicle:
    shown = hold_unseen(scores, chosen, nominal)
    return without_offset(nominal.with_values(passive_refit(scores, shown, nominal, envelope).values))
