"""What comes before a calibration: motions cleared of what spoils them, and the parameters that they identify."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..measurements.compass import compass_of
from ..physics.errors import RequestError
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .calibratable import calibratable, nuisance_candidates
from .colour import why_rollouts
from .discover import DiscoverySettings
from .identified import Identified, identified
from .nuisance import Nuisances, nuisances, part_by_sight
from .options import candidates, measurable
from .polish import polish
from .refit import BLIND
from .search import Search
from .shooting import Shooting, ShootingSettings
from .weak import WeakForm

ROLLOUTS = ShootingSettings(step=0.05)
"""Rollouts of the output-error step; no log is thinned, lest thinning biases the masses."""
SEEING = (False, False, False)


@dataclass(frozen=True, slots=True)
class Groundwork:
    """What a calibration starts from.

    Attributes
    ----------
    motions : as they are fitted
    weak : their weak form
    coloured : whether rollouts and not the force balance must decide, see `colour.why_rollouts`
    clear : what was done to the motions, and the axes that cannot be scored
    known : the parameters that the motions identify, at least one
    """

    motions: tuple[Motion, ...]
    weak: WeakForm
    coloured: bool
    clear: Nuisances
    known: Identified


def groundwork(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings,
    free: Sequence[str] = (),
    hold: Sequence[str] = (),
) -> Groundwork:
    """Clear motions, and find out which parameters of a nominal model they identify; see `calibrate.calibrate`.

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
    weak = WeakForm(motions, settings.weak)
    search = Search(weak, nominal, candidates(nominal, measurable(motions)), settings.search)
    coloured = bool(why_rollouts(search))
    clear = _cleared(motions) if coloured else Nuisances(tuple(motions), SEEING, ())
    if clear.notes:
        weak = WeakForm(clear.motions, settings.weak)
    seen, unseen = part_by_sight(nuisance_candidates(nominal, symbols), clear.blind)
    visible = [s for c in seen for s in c.symbols]
    known = identified(weak, nominal, visible, settings.search)
    if coloured and visible:
        about = polish(clear.motions, nominal, visible, ROLLOUTS, blind=clear.blind).vehicle
        form = Shooting(clear.motions, about, ROLLOUTS, clear.blind)
        known = identified(form, about, visible, settings.search)
    known = replace(known, reasons={s: BLIND for c in unseen for s in c.symbols} | known.reasons)
    if not known.symbols:
        raise RequestError(f"fit: this log identifies none of the parameters of {nominal.name}: {_listed(known)}")
    return Groundwork(clear.motions, weak, coloured, clear, known)


def _listed(known: Identified) -> str:
    return "; ".join(f"{symbol}: {why}" for symbol, why in known.reasons.items())


def _cleared(motions: Sequence[Motion]) -> Nuisances:
    """The motions without a compass deviation that shows; sway stays out then.

    Where the runs do not show that the compass is right, it is taken to be: its owner says what to calibrate.
    """
    compass = compass_of(motions)
    return nuisances(motions) if compass.deviates else Nuisances(tuple(motions), SEEING, ())
