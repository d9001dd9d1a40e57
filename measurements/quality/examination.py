"""All checks, and what they say of one log, or of several logs of one boat together."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

from ...physics.vehicle import Vehicle
from ..canonical import Lost
from ..log import Log
from .checks.clocks import CLOCKS
from .checks.command_range import COMMAND_RANGE
from .checks.commands import COMMANDS
from .checks.compass_deviation import DEVIATION
from .checks.drive import DRIVE
from .checks.excitation import EXCITATION
from .checks.held import HELD_FIXES
from .checks.jumping import JUMPS
from .checks.late import LATE_FIXES
from .checks.limited import LIMITED
from .checks.mixed_commands import MIXED_COMMANDS
from .checks.neutral import NEUTRAL
from .checks.rates import GAPS, RATES
from .checks.resampled import RESAMPLED
from .checks.sensors import SENSORS
from .checks.sides import SIDES
from .checks.spikes import SPIKES
from .checks.stamps import STAMPS
from .checks.stuck import STUCK
from .checks.swapped_channels import EXCHANGED
from .checks.tilt import TILT
from .checks.time_unit import TIME_UNIT
from .checks.units import UNITS
from .checks.vessel import VESSEL
from .finding import SEVERITY, Check, Finding
from .record import Record

CHECKS: tuple[Check, ...] = (
    VESSEL,
    STAMPS,
    TIME_UNIT,
    RESAMPLED,
    RATES,
    GAPS,
    STUCK,
    JUMPS,
    SPIKES,
    EXCHANGED,
    UNITS,
    HELD_FIXES,
    LATE_FIXES,
    COMMANDS,
    COMMAND_RANGE,
    MIXED_COMMANDS,
    SIDES,
    CLOCKS,
    NEUTRAL,
    DRIVE,
    LIMITED,
    DEVIATION,
    SENSORS,
    TILT,
    EXCITATION,
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
