"""The table of all checks, in the order in which they are made; a new check is one file and one entry here."""

from .clocks import Clocks
from .commands import Commands
from .deviation import Deviation
from .drive import Drive
from .exchanged import Exchanged
from .excitation import Excitation
from .finding import Check
from .held import HeldFixes
from .late import LateFixes
from .neutral import Neutral
from .rates import Gaps, Rates
from .resampled import Resampled
from .sides import Sides
from .spikes import Spikes
from .stamps import Stamps
from .stuck import Stuck
from .tilt import Tilt
from .units import Units

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
