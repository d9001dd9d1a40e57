"""The table of all checks, in the order in which they are made; a new check is one file and one entry here."""

from .checks.clocks import Clocks
from .checks.commands import Commands
from .checks.deviation import Deviation
from .checks.excitation import Excitation
from .checks.held import HeldFixes
from .checks.late import LateFixes
from .checks.neutral import Neutral
from .checks.rates import Gaps, Rates
from .checks.sides import Sides
from .checks.stamps import Stamps
from .checks.stuck import Stuck
from .checks.tilt import Tilt
from .checks.units import Units
from .drive import Drive
from .exchanged import Exchanged
from .finding import Check
from .resampled import Resampled
from .spikes import Spikes

CHECKS: tuple[Check, ...] = (
    Stamps(),
    Resampled(),
    Rates(),
    Gaps(),
    Stuck(),
    Spikes(),
    Exchanged(),
    Units(),
    HeldFixes(),
    LateFixes(),
    Commands(),
    Sides(),
    Clocks(),
    Neutral(),
    Drive(),
    Deviation(),
    Tilt(),
    Excitation(),
)
"""Each sees the log as the safe fixes of those before it leave it: units before speeds, fixes before clocks, and
what speaks of PWM as it is in the file before the neutral is moved."""
