"""What judges a log: the force balance, or open-loop rollouts where that balance errs by more than white noise.

The choice is made here, once for a log, whoever asks: discovery, adding by name, calibration, distillation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from ..measurements.compass import compass_of
from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .balance.base import SEEING, Balance
from .balance.sensor_errors import Nuisances, nuisances
from .balance.shooting import Shooting, ShootingSettings
from .balance.weak_form import WeakForm
from .candidates.linearisation import Candidate, candidates, measurable
from .colour import why_rollouts
from .search.floating import Search
from .settings import DiscoverySettings


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """What effects and parameters are fitted to.

    Attributes
    ----------
    nominal : the vehicle to be corrected
    settings : of the discovery
    motions : as they are fitted: cleared of what sensors add, where rollouts judge
    blind : (3,) True for an axis of which the log shows too little to judge its forces
    notes : what was done to the motions, in words
    forces : the force balance of the log as it came
    instant : a search of all that the log can show, on that balance
    why : why rollouts judge, in a sentence; empty where the force balance does
    """

    nominal: Vehicle
    settings: DiscoverySettings
    motions: tuple[Motion, ...]
    blind: tuple[bool, bool, bool]
    notes: tuple[str, ...]
    forces: WeakForm
    instant: Search
    why: str

    @property
    def rolls(self) -> bool:
        """Whether rollouts judge."""
        return bool(self.why)

    @property
    def told(self) -> tuple[str, ...]:
        """What judges where it is not the force balance, and what was done to the motions, in words."""
        return (*filter(None, [self.why]), *self.notes)

    @property
    def pool(self) -> tuple[Candidate, ...]:
        """All candidates that the log's channels can show."""
        return self.instant.pool

    def balance(self, about: Vehicle | None = None, shooting: ShootingSettings | None = None) -> Balance:
        """The balance that judges.

        Parameters
        ----------
        about : model whose rollouts tell weights; the nominal one as a rule
        shooting : how rollouts are laid, in the place of the settings'

        Raises
        ------
        RequestError
            when the log is too short for a few blocks of rollouts.
        """
        if not self.rolls:
            return self.forces
        return Shooting(self.motions, about or self.nominal, shooting or self.settings.shooting, self.blind)

    def cleared_forces(self) -> WeakForm:
        """The force balance of the motions as they are fitted."""
        return WeakForm(self.motions, self.settings.weak)


def choose(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings,
    claims: Sequence[Array] | None = None,
    pool: Sequence[Candidate] | None = None,
    *,
    trusting: bool = False,
) -> Basis:
    """Decide what judges a log, and clear its motions for it.

    Parameters
    ----------
    motions : gap-free stretches, unfiltered
    claims : accelerations that a model claims, see `WeakForm`; no rollout judges them, for they have no sensor noise
    pool : candidates; None for all that the log's channels can show
    trusting : a compass of which the log does not show that it is right is taken to be, as its owner does who says what
        to calibrate

    Raises
    ------
    RequestError
        when the log is too short for the weak form.
    """
    forces = WeakForm(motions, settings.weak, claims)
    every = candidates(nominal, measurable(motions)) if pool is None else pool
    instant = Search(forces, nominal, every, settings.search)
    why = "" if forces.claimed else why_rollouts(forces, instant)
    clear = Nuisances(tuple(motions), SEEING, ())
    if why and not (trusting and not compass_of(motions).deviates):
        clear = nuisances(motions)
    return Basis(nominal, settings, clear.motions, clear.blind, clear.notes, forces, instant, why)
