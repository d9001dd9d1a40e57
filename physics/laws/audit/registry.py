"""All laws, in the order in which they are told."""

from .base import Law
from .bounded import BoundedSpeed
from .coriolis import CoriolisWork
from .damping import PositiveDamping
from .dissipation import Dissipation, Outside
from .energy_balance import EnergyBalance
from .mass import PositiveMass
from .rest import Rest
from .symmetry import MirrorSymmetry
from .thrust import PowerUnderThrust

LAWS: tuple[Law, ...] = (
    PositiveMass(),
    Dissipation(),
    PositiveDamping(),
    PowerUnderThrust(),
    EnergyBalance(),
    Rest(),
    BoundedSpeed(),
    CoriolisWork(),
    MirrorSymmetry(),
    Outside(),
)
