"""The table of all checks, in the order in which they are made; a new check is one file and one entry here."""

from .checks.clocks import Clocks
from .checks.command_range import CommandRange
from .checks.commands import Commands
from .checks.compass_deviation import Deviation
from .checks.drive import Drive
from .checks.excitation import Excitation
from .checks.held import HeldFixes
from .checks.jumping import Jumps
from .checks.late import LateFixes
from .checks.limited import Limited
from .checks.mixed_commands import MixedCommands
from .checks.neutral import Neutral
from .checks.rates import Gaps, Rates
from .checks.resampled import Resampled
from .checks.sensors import Sensors
from .checks.sides import Sides
from .checks.spikes import Spikes
from .checks.stamps import Stamps
from .checks.stuck import Stuck
from .checks.swapped_channels import Exchanged
from .checks.tilt import Tilt
from .checks.time_unit import TimeUnit
from .checks.units import Units
from .checks.vessel import Vessel
from .finding import Check

CHECKS: tuple[Check, ...] = (
    Vessel(),
    Stamps(),
    TimeUnit(),
    Resampled(),
    Rates(),
    Gaps(),
    Stuck(),
    Jumps(),
    Spikes(),
    Exchanged(),
    Units(),
    HeldFixes(),
    LateFixes(),
    Commands(),
    CommandRange(),
    MixedCommands(),
    Sides(),
    Clocks(),
    Neutral(),
    Drive(),
    Limited(),
    Deviation(),
    Sensors(),
    Tilt(),
    Excitation(),
)
"""Each sees the log as the safe fixes of those before it leave it: units before speeds, fixes before clocks, and
what speaks of PWM as it is in the file before the neutral is moved."""
