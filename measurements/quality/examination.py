"""All checks, and what they say of one log, or of several logs of one boat together."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

from ...physics.vehicle import Vehicle
from ..canonical import Lost
from ..log import Log
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
from .finding import SEVERITY, Check, Finding
from .record import Record

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


_TOLD = 3
"""Findings that the verdict tells."""


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """What the checks say of one log.

    Attributes
    ----------
    findings : of all checks, in their order
    seen : the log as each check saw it, with the safe fixes of the checks before
    repaired : the log with all safe fixes
    """

    findings: tuple[Finding, ...]
    seen: tuple[Record, ...]
    repaired: Record

    @property
    def clean(self) -> Log:
        """The log with all safe fixes, in which nothing is out of order any more."""
        log = self.repaired.log
        return replace(log, channels={name: replace(c, lost=Lost()) for name, c in log.channels.items()})

    @property
    def fixes(self) -> tuple[str, ...]:
        """What was done to `clean`, as sentences."""
        return tuple(finding.fix.sentence for finding in self.findings if finding.fix is not None)

    @property
    def still_wrong(self) -> tuple[str, ...]:
        """What is still wrong with `clean`, as sentences."""
        unfixed = [finding for finding in self.findings if finding.fix is None]
        return tuple(finding.sentence for finding in unfixed if finding.verdict in SEVERITY[:2])


def examine(
    log: Log, vehicle: Vehicle | None = None, *, progress: Callable[[int, int], None] | None = None
) -> Examination:
    """Make all checks on one log.

    Parameters
    ----------
    vehicle : whose thrusters the commands must agree with
    progress : told how many checks are made, and how many there are
    """
    record, findings, seen = Record.of(log, vehicle), [], []
    for done, check in enumerate(CHECKS):
        if progress is not None:
            progress(done, len(CHECKS))
        seen.append(record)
        found = check.examine([record])
        findings += found
        channels = dict(record.log.channels)
        fixes = [finding.fix for finding in found if finding.fix is not None]
        for fix in fixes:
            channels = fix.apply(channels)
        if any(channels[name] is not record.log.channels.get(name) for name in channels):
            record = record.repaired(channels)
    return Examination(tuple(findings), tuple(seen), record)


def pool(examinations: Sequence[Examination], names: Collection[str] = ()) -> tuple[Finding, ...]:
    """Make checks on several logs of one boat together: what one log is too short to tell, all may.

    Parameters
    ----------
    names : of the checks; none for all
    """
    return tuple(
        finding
        for place, check in enumerate(CHECKS)
        if not names or check.name in names
        for finding in check.examine([each.seen[place] for each in examinations])
    )


def is_sound(findings: Sequence[Finding]) -> bool:
    """True when no check found a defect; a warning makes numbers worse, but a log can be used with it."""
    return not any(finding.verdict == "defect" for finding in findings)


def verdict(findings: Sequence[Finding], missing: Sequence[str] = (), curable: bool = False) -> str:
    """Say in one or two sentences whether a log is usable, and what is worst about it.

    Parameters
    ----------
    findings : of the checks
    missing : what keeps the log from being used, empty where nothing does
    curable : whether the safe fixes do away with that
    """
    if missing:
        cure = " --fix OUT.csv writes a log that can be used." if curable else ""
        return f"Not usable as it is: {missing[0]}{cure}"
    worst = sorted((f for f in findings if f.verdict in SEVERITY[:2]), key=lambda f: SEVERITY.index(f.verdict))
    defects = sum(finding.verdict == "defect" for finding in worst)
    if not worst:
        untold = [finding for finding in findings if finding.verdict == "cannot tell"]
        unsure = "; ".join(finding.short for finding in untold if finding.short)
        count = sum(not finding.short for finding in untold)
        things = "one thing" if count == 1 else f"{count} things"
        more = f" It is too short or too calm to tell {things}." if count else ""
        if unsure:
            return f"Usable if this is right, which the log cannot tell: {unsure}. No defect was found.{more}"
        return f"Usable; no defect was found.{more}"
    text = "; ".join(finding.short or finding.sentence for finding in worst[:_TOLD])
    more = f"; and {len(worst) - _TOLD} more" if len(worst) > _TOLD else ""
    refused = " discover refuses it as it is." if any(finding.refused for finding in findings) else ""
    return f"{'Usable after repair' if defects else 'Usable, but mind'}: {text}{more}.{refused}"
