"""The two steps of a calibration: the force balance, and from there the rollouts; each ends under the laws."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...measurements.preparation.held_out import Fold
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..balance.base import SEEING, Balance
from ..balance.shooting import Shooting
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Candidate
from ..candidates.linearisation import Linearisation, Option
from ..lawful.passivity import Lawful, lawful_model
from ..lawful.refit import passive_refit
from ..search.bootstrap import Interval, intervals
from ..search.floating import Search
from ..search.gram import GramScores
from ..search.output_error import polish
from ..search.unseen_fold import held_where_silent, without_fold
from ..settings import DiscoverySettings
from .before_calibration import ROLLOUTS

SUFFIX = ", calibrated"
"""Behind the name of a vehicle that was calibrated."""
_ROUNDS = 6
"""Times that columns are taken anew about the fit at most; a judgement, as a fit that has settled stops earlier."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """Parameters fitted to some motions: a lawful vehicle, 95 % intervals by symbol, and vehicles without each fold."""

    lawful: Lawful
    intervals: dict[str, Interval]
    unseen: tuple[tuple[Fold, Vehicle], ...] = ()


def convex_step(
    motions: Sequence[Motion],
    nominal: Vehicle,
    pool: Sequence[Candidate],
    settings: DiscoverySettings,
    folds: Sequence[Fold] = (),
) -> Fitted:
    """The first step: the lawful fit to the weak form."""
    weak = WeakForm(motions, settings.weak)
    search = Search(weak, nominal, pool, replace(settings.search, refinements=_ROUNDS))
    state = search.reshape(search.evaluate(nominal, ()))
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    chosen = [linear.options[key][0] for key in state.active]
    lawful = lawful_model(motions, scores, chosen, nominal, _name(nominal))
    unseen = _without(folds, weak, linear, scores, chosen, lawful, nominal)
    return Fitted(lawful, intervals(weak, scores, pool, chosen, state.vehicle, settings.seed), unseen)


def rollout_step(
    motions: Sequence[Motion],
    start: Vehicle,
    nominal: Vehicle,
    pool: Sequence[Candidate],
    blind: Sequence[bool] = SEEING,
    folds: Sequence[Fold] = (),
) -> Fitted:
    """The second step: rollouts fitted from a start, the first step's vehicle as a rule, then held to the laws."""
    symbols = [p.symbol for c in pool for p in c.parameters if not p.stepped]
    polished = polish(motions, start, symbols, ROLLOUTS, blind=blind)
    form = Shooting(motions, polished.vehicle, ROLLOUTS, blind)
    linear = Linearisation(form, polished.vehicle, nominal, pool, [c.key for c in pool])
    scores = GramScores(linear.columns, linear.noise, form.block, 1.0 / form.scale**2)
    chosen = [linear.options[c.key][0] for c in pool]
    lawful = lawful_model(motions, scores, chosen, nominal, _name(nominal))
    unseen = _without(folds, form, linear, scores, chosen, lawful, nominal)
    return Fitted(lawful, polished.intervals, unseen)


def _without(
    folds: Sequence[Fold],
    balance: Balance,
    linear: Linearisation,
    scores: GramScores,
    chosen: Sequence[Option],
    lawful: Lawful,
    nominal: Vehicle,
) -> tuple[tuple[Fold, Vehicle], ...]:
    """Vehicles fitted without each fold: a Gauss-Newton step from the fit to everything, under the same laws."""
    found = []
    for fold in folds:
        seen = without_fold(balance, linear, scores, fold)
        shown = held_where_silent(seen, chosen, nominal)
        fit = passive_refit(seen, shown, lawful.vehicle, lawful.passivity.envelope)
        found.append((fold, lawful.vehicle.with_values(fit.values)))
    return tuple(found)


def _name(nominal: Vehicle) -> str:
    return nominal.name if nominal.name.endswith(SUFFIX) else f"{nominal.name}{SUFFIX}"
