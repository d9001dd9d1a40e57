"""Preparation of a calibration: corrected motions, the parameters they identify, and the parameters freed in a search.

Parameters of the vehicle file that are free while effects are judged make a named effect mean structure: something
that no values of the model's own parameters explain.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ...physics.errors import RequestError
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..balance.starts import HORIZON, LEAST_BLOCKS, LEAST_STARTS, WHOLE_HORIZON, ShootingSettings, limit_horizon
from ..balance.weak_form import WeakForm
from ..basis import Basis, DiscoverySettings, choose_balance
from ..candidates.candidate import (
    Candidate,
    Kind,
    calibratable,
    limit_at,
    nuisance_candidates,
    remaining_candidates,
)
from ..findings import Calibrated, Findings, NotCalibrated
from ..identifiability.identifiable_effects import Identified, identified
from ..lawful.refit import Lawful
from ..search.estimation import Interval, polish
from ..search.floating import SearchSettings

_MASSES = ("X_udot", "Y_vdot", "N_rdot")
_THRUST = "thrust_scale"


@dataclass(frozen=True, slots=True)
class FreeParameters:
    """Nuisance parameters and effects of a search in which the file's own numbers are free.

    Attributes
    ----------
    pool : candidates for a search: the parameters that are free in every model, and the effects beside them
    reasons : why others are not free, by symbol
    absorbed : names of effects that the calibration would explain as well, so that they are not candidates
    """

    pool: tuple[Candidate, ...]
    reasons: Mapping[str, str]
    absorbed: tuple[str, ...]

    @property
    def symbols(self) -> tuple[str, ...]:
        """The parameters that are free."""
        return tuple(s for c in self.pool if c.kind is Kind.NUISANCE for s in c.symbols)

    @property
    def sentence(self) -> str:
        """The free parameters, for a line of progress."""
        return f"calibrating {', '.join(self.symbols) or 'nothing'} in every model"

    def seen(self, pool: Sequence[Candidate]) -> "FreeParameters":
        """The same for a log that can judge a part of the pool only."""
        return replace(self, pool=tuple(pool))


def free_parameters(
    weak: WeakForm, nominal: Vehicle, pool: Sequence[Candidate], settings: SearchSettings
) -> FreeParameters:
    """Free the parameters that have a value in the vehicle file, and leave the effects that are more than those.

    Parameters that the log tells apart only vaguely are free too: an effect must not be named for what some values of
    them would explain. Their intervals are wide. A common scale of all thrust is no candidate where all added masses
    are free, or the free parameters together make up the thrust: masses and damping are then known in proportion to it.

    Parameters
    ----------
    weak : the log, as a force balance
    nominal : the model whose parameters are freed
    pool : the candidates of the search
    settings : by which a parameter counts as identified
    """
    symbols = calibratable(nominal)
    known = identified(weak, nominal, (*symbols, *({_THRUST} - {*symbols})), settings, vague=True)
    nuisances = nuisance_candidates(nominal, [s for s in known.symbols if s in symbols])
    effects = remaining_candidates(pool, symbols)
    only = [f"{t.name}_scale" for t in nominal.thrusters] if len(nominal.thrusters) == 1 else []
    proportional = _THRUST in known.reasons or set(_MASSES) <= set(known.symbols)
    lost = [c for c in effects if c.symbols[0] in (_THRUST, *only) and proportional]
    left = [c for c in effects if c not in lost]
    reasons = {s: why for s, why in known.reasons.items() if s in symbols}
    return FreeParameters((*nuisances, *left), reasons, tuple(c.effect.name for c in lost))


def calibration_rows(
    symbols: Sequence[str], nominal: Vehicle, lawful: Lawful, intervals: Mapping[str, Interval]
) -> tuple[Calibrated, ...]:
    """A row for each parameter that was free: before, after, interval.

    Parameters
    ----------
    symbols : of the parameters that were free
    nominal : values before
    lawful : values after, and as wanted without the laws
    intervals : 95 % intervals by symbol; one at a limit is left out
    """
    rows = []
    for symbol in symbols:
        parameter, wanted = nominal.parameter(symbol), lawful.unconstrained.value(symbol)
        near = limit_at(parameter, wanted) is not None
        rows.append(
            Calibrated(
                symbol=symbol,
                before=nominal.value(symbol),
                after=lawful.vehicle.value(symbol),
                wanted=wanted,
                unit=parameter.unit,
                ci95=None if near else intervals.get(symbol),
                at_limit=near,
            )
        )
    return tuple(rows)


def with_calibration(
    findings: Findings, free: FreeParameters, nominal: Vehicle, lawful: Lawful, intervals: Mapping[str, Interval]
) -> Findings:
    """Findings that say what was calibrated, and what the verdict therefore means.

    Parameters
    ----------
    findings : of the discovery
    free : which parameters were free, and why others were not
    nominal, lawful, intervals : as `calibrated` has them
    """
    rows = calibration_rows(free.symbols, nominal, lawful, intervals)
    headline = findings.headline
    if findings.verdict == "nothing missing":
        headline = "Nothing material is missing: once calibrated, the model explains this log."
    elif findings.verdict == "missing":
        headline = f"{headline.removesuffix('.')}, also once its own numbers are calibrated."
    left = tuple(NotCalibrated(symbol=symbol, why=why) for symbol, why in free.reasons.items())
    return findings.but(headline=headline, calibrated=rows, left=left, absorbed=free.absorbed)


ROLLOUTS = ShootingSettings(horizon=WHOLE_HORIZON, step=0.05, free_starts=True)
"""Rollouts of the output-error step (Ljung 1999, chapter 7); no log is thinned, lest thinning biases the masses."""


def rollouts_over(motions: Sequence[Motion], *vehicles: Vehicle) -> ShootingSettings:
    """The rollouts of the output-error step over some motions.

    They are 10 s long: on the mean of kinds of logs of 45 s and more they come nearer the truth than 5 s
    (`benchmarks/calibration.py --horizons`); 5 s where half of the motions, as folds leave them, would hold too few,
    and less where errors of their starts grow, see `limit_horizon`.

    Parameters
    ----------
    motions : gap-free stretches
    vehicles : of which some may be near the truth
    """
    begun = sum(max(motion.duration - ROLLOUTS.horizon, 0.0) for motion in motions)
    enough = 0.5 * begun >= LEAST_BLOCKS * LEAST_STARTS * ROLLOUTS.spacing
    return limit_horizon(ROLLOUTS if enough else replace(ROLLOUTS, horizon=HORIZON), motions, *vehicles)


@dataclass(frozen=True, slots=True)
class CalibrationSetup:
    """The start of a calibration: motions, balance, and the parameters that they identify.

    Attributes
    ----------
    basis : the motions as they are fitted, and what judges them
    weak : the force balance of those motions
    known : the parameters that the motions identify, at least one
    """

    basis: Basis
    weak: WeakForm
    known: Identified


def prepare_calibration(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings,
    free: Sequence[str] = (),
    hold: Sequence[str] = (),
    basis: Basis | None = None,
) -> CalibrationSetup:
    """Clear motions, and find out which parameters of a nominal model they identify; see `calibrate.calibrate`.

    A `basis` that was chosen for these motions and this model already is not chosen again.

    Parameters
    ----------
    motions : measured, uncorrected
    nominal : the model to calibrate
    settings : of discovery
    free, hold : symbols to calibrate beside those with a value in the file, and symbols to leave as they are
    basis : what judges the log, where that was chosen already

    Raises
    ------
    RequestError
        for an unknown symbol, when nothing is left to calibrate, or the motions identify nothing.
    """
    symbols = calibratable(nominal, free, hold)
    if not symbols:
        raise RequestError(
            f"fit: {nominal.name} has no parameter to calibrate (damping, added mass, ...); free one, for example "
            "--free X_u"
        )
    basis = choose_balance(motions, nominal, settings, trusting=True) if basis is None else basis.trusting_compass()
    weak = basis.cleared_forces() if basis.notes else basis.forces
    visible = [s for c in nuisance_candidates(nominal, symbols) for s in c.symbols]
    known = identified(weak, nominal, visible, settings.search)
    if basis.uses_rollouts and visible:
        shooting = rollouts_over(basis.motions, nominal)
        about = polish(basis.motions, nominal, visible, shooting).vehicle
        known = identified(basis.balance(about, shooting), about, visible, settings.search)
    if not known.symbols:
        told = "; ".join(f"{symbol}: {why}" for symbol, why in known.reasons.items())
        raise RequestError(f"fit: this log identifies none of the parameters of {nominal.name}: {told}")
    return CalibrationSetup(basis, weak, known)
