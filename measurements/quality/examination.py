"""All checks on one log, or on several logs of one boat together."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..log import Log
from .finding import SEVERITY, Finding
from .record import Record
from .registry import CHECKS


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """What the checks say of one log.

    Attributes
    ----------
    findings : of all checks, in their order
    seen : the log as each check saw it, with the safe fixes of the checks before
    clean : the log with all safe fixes
    """

    findings: tuple[Finding, ...]
    seen: tuple[Record, ...]
    clean: Log

    @property
    def fixes(self) -> tuple[str, ...]:
        """What was done to `clean`, as sentences."""
        return tuple(finding.fix.sentence for finding in self.findings if finding.fix is not None)


def examine(log: Log) -> Examination:
    """Make all checks on one log."""
    record, findings, seen = Record.of(log), [], []
    for check in CHECKS:
        seen.append(record)
        found = check.examine([record])
        findings += found
        channels = dict(record.log.channels)
        fixes = [finding.fix for finding in found if finding.fix is not None]
        for fix in fixes:
            channels = fix.apply(channels)
        if any(channels[name] is not record.log.channels.get(name) for name in channels):
            record = record.repaired(channels)
    return Examination(tuple(findings), tuple(seen), record.log)


def pool(examinations: Sequence[Examination]) -> tuple[Finding, ...]:
    """Make all checks on several logs of one boat together: what one log is too short to tell, all may."""
    return tuple(
        finding
        for place, check in enumerate(CHECKS)
        for finding in check.examine([each.seen[place] for each in examinations])
    )


def verdict(findings: Sequence[Finding], missing: Sequence[str] = ()) -> str:
    """Say in one or two sentences whether a log is usable, and what is worst about it.

    Parameters
    ----------
    findings : of the checks
    missing : what keeps the log from being used, empty where nothing does
    """
    if missing:
        return f"Not usable: {missing[0]}"
    worst = sorted((f for f in findings if f.verdict in SEVERITY[:2]), key=lambda f: SEVERITY.index(f.verdict))
    defects = sum(f.verdict == "defect" for f in worst)
    if not worst:
        untold = sum(f.verdict == "cannot tell" for f in findings)
        more = f" {untold} things it cannot tell." if untold else ""
        return f"Usable; no defect was found.{more}"
    told = "; ".join(finding.sentence for finding in worst[:_TOLD])
    more = f"; and {len(worst) - _TOLD} more" if len(worst) > _TOLD else ""
    return f"{'Usable only after repair' if defects else 'Usable, but'}: {told}{more}."


_TOLD = 3
