"""Calibration: the parameters of a nominal model fitted to logs under their limits and the law of dissipation.

First least squares on the weak form, with sensor noise taken off the normal equations (errors in variables; Carroll et
al. 2006, chapter 5); then output error on rollouts (`search/estimation.py`), kept unless it predicts held-out quarters
of the logs worse. Both end in the lawful refit. On field logs whose force balance is not white (`basis.py`) the first
step is left out. A parameter that the logs do not identify keeps its value, with the reason.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...measurements.preparation.split import Fold
from ...measurements.statistics.processors import single_threaded
from ...physics.errors import RequestError
from ...physics.laws.damping_power import mass_margin
from ...physics.motion import Array, Motion
from ...physics.stage import CALIBRATING, PREDICTED, Say, Stage
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..balance.shooting import (
    HORIZON,
    WHOLE_HORIZON,
    Shooting,
    ShootingSettings,
    error_increase,
    rollout_overlap,
    rollouts_contradict,
)
from ..balance.weak_form import WeakForm
from ..basis import Basis, DiscoverySettings
from ..candidates.candidate import Candidate, limit_at, nuisance_candidates
from ..candidates.linearisation import Linearisation, Option
from ..findings import Calibrated
from ..lawful.refit import Lawful, judge_passivity, lawful_model, passive_refit
from ..search.estimation import Interval, intervals, polish
from ..search.floating import Search, hold_unseen, scores_without_fold
from ..search.gram import GramScores
from .before_calibration import ROLLOUTS, calibration_rows, prepare_calibration, rollouts_over

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


@dataclass(frozen=True, slots=True)
class Steps:
    """The two steps of a calibration, on some motions or on a part of them.

    Attributes
    ----------
    nominal : the model whose parameters are fitted, and to which limits and notes refer
    pool : nuisance candidates, one for each parameter
    settings : of discovery
    shooting : the rollouts; None for those that the motions hold, see `rollouts_over`
    """

    nominal: Vehicle
    pool: Sequence[Candidate]
    settings: DiscoverySettings
    shooting: ShootingSettings | None = None

    def convex(self, motions: Sequence[Motion], folds: Sequence[Fold] = ()) -> Fitted:
        """The first step: the lawful fit to the weak form; repeated without each fold, a part of the motions."""
        weak = WeakForm(motions, self.settings.weak)
        search = Search(weak, self.nominal, self.pool, replace(self.settings.search, refinements=_ROUNDS))
        state = search.reshape(search.evaluate(self.nominal, ()))
        linear, scores, now = search.about(state)
        chosen = list(now.values())
        lawful, unseen = self._lawful(motions, weak, linear, scores, chosen, folds)
        return Fitted(lawful, intervals(weak, scores, self.pool, chosen, state.vehicle, self.settings.seed), unseen)

    def rollouts(self, motions: Sequence[Motion], start: Vehicle, folds: Sequence[Fold] = ()) -> Fitted:
        """The second step: rollouts fitted from a start, then held to the laws.

        Parameters
        ----------
        motions : measured
        start : the vehicle at which the fit begins, the first step's as a rule
        folds : parts of the motions without each of which the fit is repeated
        """
        symbols = [p.symbol for c in self.pool for p in c.parameters if not p.stepped]
        shooting = self.shooting or rollouts_over(motions, self.nominal, start)
        polished = polish(motions, start, symbols, shooting)
        form = Shooting(motions, polished.vehicle, shooting)
        linear = Linearisation(form, polished.vehicle, self.nominal, self.pool, [c.key for c in self.pool])
        scores = GramScores(linear.columns, linear.noise, form.block, 1.0 / form.scale**2)
        chosen = [linear.options[c.key][0] for c in self.pool]
        lawful, unseen = self._lawful(motions, form, linear, scores, chosen, folds)
        return Fitted(lawful, polished.intervals, unseen)

    def _lawful(
        self,
        motions: Sequence[Motion],
        balance: Balance,
        linear: Linearisation,
        scores: GramScores,
        chosen: Sequence[Option],
        folds: Sequence[Fold],
    ) -> tuple[Lawful, tuple[tuple[Fold, Vehicle], ...]]:
        """The lawful fit, and by a Gauss-Newton step from it vehicles fitted without each fold, under the same laws."""
        name = f"{self.nominal.name.removesuffix(SUFFIX)}{SUFFIX}"
        lawful, unseen = lawful_model(motions, scores, chosen, self.nominal, name), []
        for fold in folds:
            seen = scores_without_fold(balance, linear, scores, fold)
            shown = hold_unseen(seen, chosen, self.nominal)
            fit = passive_refit(seen, shown, lawful.vehicle, lawful.passivity.envelope)
            unseen.append((fold, lawful.vehicle.with_values(fit.values)))
        return lawful, tuple(unseen)


QUARTERS = 4
"""Parts into which logs are cut."""
_GUARD = 1.0
"""Left out on each side of a quarter that is predicted [s]."""
_LEAST_STRETCH = 2.5
"""Shorter stretches are left out [s]."""


def quarter(motions: Sequence[Motion], number: int) -> tuple[tuple[Motion, ...], tuple[Motion, ...]]:
    """The stretches inside a quarter of the logs, and those outside it by a second or more."""
    ends = np.cumsum([0.0, *(m.duration for m in motions)])
    low, high = ends[-1] * number / QUARTERS, ends[-1] * (number + 1) / QUARTERS
    inside: list[Motion] = []
    outside: list[Motion] = []
    for motion, begun in zip(motions, ends[:-1], strict=True):
        spans = ((outside, -np.inf, low - _GUARD), (inside, low, high), (outside, high + _GUARD, np.inf))
        for kept, start, stop in spans:
            rows = np.clip((np.array([start, stop]) - begun) / motion.time_step, 0, motion.time.size)
            first, last = (int(row) for row in np.round(rows))
            if (last - first) * motion.time_step >= _LEAST_STRETCH:
                kept.append(motion.slice(first, last))
    return tuple(inside), tuple(outside)


def as_good(weak: Array, rolled: Array, overlap: int) -> bool:
    """True unless rollouts err more, by more than a standard error, under the second step than under the first.

    Sensor noise stands in both errors, so that a plain comparison is half chance where both are good; on known hulls
    the second step is nearly always nearer the truth (`benchmarks/calibration.py`).

    Parameters
    ----------
    weak, rolled : (starts, 3) squared errors
    overlap : rollouts that run at any time, which are not independent
    """
    rise = error_increase(weak, rolled, overlap)
    return rise.error is None or rise.difference <= rise.error


Method = Literal["weak form", "output error"]
_SPACING = 1.0
"""Distance between the starts of rollouts by which the steps are compared [s]."""
_DIGITS = 9
"""Significant digits that a solver's tolerance leaves, so that equal inputs give equal files."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """A finished calibration.

    Attributes
    ----------
    nominal : the vehicle before
    lawful : the calibrated vehicle, and how the law stands in it
    parameters : what was calibrated
    reasons : why not, by symbol, for what was to be calibrated and is left as it was
    method : the step that the numbers come from
    horizon : length of the rollouts by which the methods were compared [s]
    held_out : (3,) root mean square error of rollouts on parts that were not fitted [m/s, m/s, rad/s], for "nominal"
        and each method; empty where the logs are too short to hold parts out
    worse : True when those of the chosen method are significantly worse than the nominal model's
    force_error : (3,) root mean square of the weak residual that remains [N, N, N m]
    noise_error : (3,) what sensor noise alone would leave [N, N, N m]
    force_scale : (3,) size of the forces at work [N, N, N m]
    notes : what was done to the motions, in words
    """

    nominal: Vehicle
    lawful: Lawful
    parameters: tuple[Calibrated, ...]
    reasons: dict[str, str]
    method: Method
    horizon: float
    held_out: dict[str, Array]
    worse: bool
    force_error: Array
    noise_error: Array
    force_scale: Array
    notes: tuple[str, ...]

    @property
    def vehicle(self) -> Vehicle:
        """The calibrated vehicle."""
        return self.lawful.vehicle


@single_threaded
def calibrate(
    motions: Sequence[Motion],
    nominal: Vehicle,
    free: Sequence[str] = (),
    hold: Sequence[str] = (),
    settings: DiscoverySettings | None = None,
    progress: Say | None = None,
) -> Calibration:
    """Fit the parameters of a nominal model to measured motions.

    Parameters
    ----------
    motions : gap-free stretches, unfiltered
    free, hold : symbols to calibrate beside those that have a value in the file, and symbols to leave
    progress : called with a line for each step

    Raises
    ------
    RequestError
        for an unknown symbol, when nothing is left to calibrate, when the motions are too short, when a solver fails,
        or when the damping of the nominal model creates energy beyond what its freed parameters can mend.
    """
    settings = settings or DiscoverySettings()
    say = progress or (lambda text: None)
    ground = prepare_calibration(motions, nominal, settings, free, hold)
    motions, known, basis = ground.basis.motions, ground.known, ground.basis
    say(Stage(f"calibrating {', '.join(known.symbols)}", CALIBRATING))
    pool = nuisance_candidates(nominal, known.symbols)
    long = sum(m.duration for m in motions) >= 1.5 * QUARTERS * WHOLE_HORIZON
    horizon = WHOLE_HORIZON if long else HORIZON
    fitted = Steps(nominal, pool, settings).convex(motions)
    start = nominal if basis.uses_rollouts else fitted.lawful.vehicle
    shooting = rollouts_over(motions, nominal, start)
    if shooting.horizon < rollouts_over(motions).horizon:
        horizon = shooting.horizon
    steps = Steps(nominal, pool, settings, shooting)
    _demand_lawful(fitted.lawful, known.symbols)
    held_out = _held_out(motions, steps, horizon, basis.uses_rollouts, say)
    best: Method = "weak form"
    overlap = rollout_overlap(horizon, _SPACING)
    if held_out and as_good(held_out["weak form"], held_out["output error"], overlap):
        best, fitted = "output error", steps.rollouts(motions, start)
        _demand_lawful(fitted.lawful, known.symbols)
    fitted = _rounded(fitted, nominal, known.symbols)
    search = Search(ground.weak, nominal, (), settings.search)
    error = np.sqrt((ground.weak.residual(fitted.lawful.vehicle) ** 2).mean(axis=0))
    return Calibration(
        nominal,
        fitted.lawful,
        calibration_rows(known.symbols, nominal, fitted.lawful, fitted.intervals),
        known.reasons,
        best,
        horizon,
        {name: np.sqrt(squares.mean(axis=0)) for name, squares in held_out.items()},
        bool(held_out) and rollouts_contradict(held_out["nominal"], held_out[best], overlap),
        error,
        search.noise_error,
        search.force_scale,
        (*filter(None, [basis.part]), *basis.notes),
    )


@single_threaded
def calibrate_once(
    motions: Sequence[Motion],
    nominal: Vehicle,
    basis: Basis | None = None,
    folds: Sequence[Fold] = (),
) -> tuple[Fitted, tuple[str, ...]]:
    """Fit the parameters of a nominal model to the rollouts of measured motions, without trying it on held-out parts.

    The numbers are those of `calibrate` where it ends with the output-error step, at a fifth of its time. Where no
    rollout can be fitted, they are those of the weak form. A `basis` that a discovery chose for these motions and this
    model is not chosen again.

    Parameters
    ----------
    folds : parts of the motions, without each of which a vehicle is fitted, too

    Returns
    -------
    (fitted, symbols)
        the calibrated vehicle, that without each fold, and the symbols of what was fitted

    Raises
    ------
    RequestError
        as `calibrate` does.
    """
    settings = DiscoverySettings()
    ground = prepare_calibration(motions, nominal, settings, basis=basis)
    motions, known, rolls = ground.basis.motions, ground.known, ground.basis.uses_rollouts
    steps = Steps(nominal, nuisance_candidates(nominal, known.symbols), settings)
    start = nominal if rolls else steps.convex(motions).lawful.vehicle
    try:
        fitted = steps.rollouts(motions, start, folds)
    except RequestError:  # stretches too short for a rollout, or a start that diverges: the first step stands
        fitted = steps.convex(motions, folds)
    _demand_lawful(fitted.lawful, known.symbols)
    return _rounded(fitted, nominal, known.symbols), known.symbols


def _demand_lawful(lawful: Lawful, symbols: Sequence[str]) -> None:
    """Raise unless damping takes energy out everywhere in the envelope, and mass is positive."""
    if lawful.passivity.verdict == "fail" or mass_margin(lawful.vehicle) <= 0.0:
        raise RequestError(
            f"fit: no values of {', '.join(symbols)} make {lawful.vehicle.name.removesuffix(SUFFIX)} lawful: "
            f"{lawful.passivity.sentence} Mend the other damping parameters in the vehicle file, or free them"
        )


def _rounded(fitted: Fitted, nominal: Vehicle, symbols: Sequence[str]) -> Fitted:
    """The same with nine significant digits, so that the last bits of a solver do not reach a file."""
    lawful = fitted.lawful
    values = {s: float(f"{lawful.vehicle.value(s):.{_DIGITS}g}") for s in symbols}
    for symbol in symbols:
        limit = limit_at(nominal.parameter(symbol), values[symbol])
        values[symbol] = values[symbol] if limit is None else limit
    vehicle = nominal.with_values(values, name=lawful.vehicle.name)
    still = judge_passivity(vehicle, lawful.passivity.envelope).verdict == "pass"
    return replace(fitted, lawful=replace(lawful, vehicle=vehicle)) if still else fitted


def _held_out(
    motions: Sequence[Motion], steps: Steps, horizon: float, rolls: bool, say: Callable[[str], None]
) -> dict[str, Array]:
    """Squared errors (starts, 3) of rollouts on each part under models fitted to the others, by method.

    Rollouts begin from calmed states, and errors of the start are whitened out: from noisy ones, a model that forgets
    its start too soon predicts best. Empty where a part holds too few rollouts or the others are too short for a fit.

    Parameters
    ----------
    steps : of the calibration, whose rollouts are fitted to all of the log, and so to the parts
    rolls : the error of the force balance is coloured, and rollouts are fitted from the nominal model
    """
    found: dict[str, list[Array]] = {"nominal": [], "weak form": [], "output error": []}
    judged = replace(ROLLOUTS, horizon=horizon, spacing=_SPACING, robust=np.inf)
    for k in range(QUARTERS):
        inside, outside = quarter(motions, k)
        try:
            convex = steps.convex(outside).lawful.vehicle
            rolled = steps.rollouts(outside, steps.nominal if rolls else convex).lawful.vehicle
            judge_by = Shooting(inside, rolled, judged)
        except RequestError:
            return {}
        for name, vehicle in zip(found, (steps.nominal, convex, rolled), strict=True):
            found[name].append(judge_by.squares(vehicle))
        say(Stage(f"predicted part {k + 1} of {QUARTERS} by models fitted to the others", PREDICTED[k]))
    return {name: np.concatenate(parts) for name, parts in found.items()}
