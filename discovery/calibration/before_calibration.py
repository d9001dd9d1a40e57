"""What comes before a calibration: motions cleared of what spoils them, and the parameters that they identify."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...physics.errors import RequestError
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..balance.shooting import ShootingSettings
from ..balance.weak_form import WeakForm
from ..basis import Basis, choose
from ..candidates.candidate import part_by_sight
from ..candidates.nuisance import calibratable, nuisance_candidates
from ..identifiability.identifiable_parameters import Identified, identified
from ..search.output_error import polish
from ..settings import DiscoverySettings
from .beside_effects import why_unseen

ROLLOUTS = ShootingSettings(step=0.05)
"""Rollouts of the output-error step; no log is thinned, lest thinning biases the masses."""


@dataclass(frozen=True, slots=True)
class Groundwork:
    """What a calibration starts from.

    Attributes
    ----------
    basis : the motions as they are fitted, and what judges them
    weak : the force balance of those motions
    known : the parameters that the motions identify, at least one
    """

    basis: Basis
    weak: WeakForm
    known: Identified


def groundwork(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings,
    free: Sequence[str] = (),
    hold: Sequence[str] = (),
    basis: Basis | None = None,
) -> Groundwork:
    """Clear motions, and find out which parameters of a nominal model they identify; see `calibrate.calibrate`.

    A `basis` that was chosen for these motions and this model already is not chosen again.

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
    basis = choose(motions, nominal, settings, trusting=True) if basis is None else basis.trusting()
    weak = basis.cleared_forces() if basis.notes else basis.forces
    seen, unseen = part_by_sight(nuisance_candidates(nominal, symbols), basis.blind)
    visible = [s for c in seen for s in c.symbols]
    known = identified(weak, nominal, visible, settings.search)
    if basis.rolls and visible:
        about = polish(basis.motions, nominal, visible, ROLLOUTS, blind=basis.blind).vehicle
        known = identified(basis.balance(about, ROLLOUTS), about, visible, settings.search)
    known = replace(known, reasons={s: why_unseen(s) for c in unseen for s in c.symbols} | known.reasons)
    if not known.symbols:
        raise RequestError(f"fit: this log identifies none of the parameters of {nominal.name}: {_listed(known)}")
    return Groundwork(basis, weak, known)


def _listed(known: Identified) -> str:
    return "; ".join(f"{symbol}: {why}" for symbol, why in known.reasons.items())
