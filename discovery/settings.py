"""All settings of a discovery in one place."""

from dataclasses import dataclass, field

from .balance.base import WeakSettings
from .balance.shooting import ShootingSettings
from .search.scoring import SearchSettings


@dataclass(frozen=True, slots=True)
class DiscoverySettings:
    """All settings of a discovery; they are printed in the report.

    Attributes
    ----------
    weak : test functions
    search : price and materiality
    seed : of the bootstrap
    refit : True to calibrate the parameters of the nominal model while effects are judged; None to do so where the
        vehicle file holds guesses, as one that `init` wrote does
    shooting : rollouts, for logs whose error is coloured
    """

    weak: WeakSettings = field(default_factory=WeakSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    seed: int = 0
    refit: bool | None = None
    shooting: ShootingSettings = field(default_factory=ShootingSettings)
