"""Logs that are known to be broken: refused with the cure, or taken as they are with a warning above every result."""

from collections.abc import Sequence
from pathlib import Path

from ..measurements.canonical import command_kind
from ..measurements.inspection import Inspection
from ..measurements.quality.finding import Finding
from ..physics.errors import LogError
from ..physics.vehicle import Vehicle

_PLACES = ("direction", "sides")
"""The checks that tell where thrusters are and which way they push."""
UNPROVEN = (
    "Nothing in the log shows on which side its thrusters are and which way they push: the vehicle file and the "
    "channel map are believed, and if they are wrong, so is what follows. 'undertow inspect' says why."
)

_HOW = "inspect --fix does so in a new file, discover --fix in memory"


def sound(
    inspections: Sequence[Inspection], together: Sequence[Finding], vehicle: Vehicle, as_is: bool
) -> tuple[str, ...]:
    """Refuse logs whose defects make every finding meaningless, or give these defects as warnings.

    What the logs do not show of the thrusters' sides and directions is a warning, too: all findings rest on it. A
    thruster whose sign or side the vehicle file has, too, is as the file says: the inspections are made for it.

    Parameters
    ----------
    inspections : of all logs, for this vehicle
    together : what the checks say of all logs together; none for one log
    as_is : True to take the logs as they are, and to be warned

    Raises
    ------
    LogError
        which says what was found, how to put it right, and how to go on regardless.
    """
    fatal = defects(inspections, together, vehicle)
    if fatal and not as_is:
        raise LogError(
            f"{'; '.join(fatal)}. Nothing found in such logs is about the boat. 'undertow inspect LOG --map-out "
            "map.yaml' writes the channel map to change; give it back with --map map.yaml. To go on regardless, say "
            "--as-is: every result then carries this as a warning"
        )
    warnings = [f"Taken as it is, so no result can be trusted: {text}." for text in fatal]
    return (*warnings, *_unproven(inspections, together), *_repairable(inspections))


def _unproven(inspections: Sequence[Inspection], together: Sequence[Finding]) -> list[str]:
    """What is likely wrong with the thrusters' places; or a warning where none shows in the logs."""
    known = together or [finding for inspection in inspections for finding in inspection.quality]
    likely = likely_misplaced(known)
    if likely:
        return likely
    told = [finding for finding in known if finding.check in _PLACES]
    if not told or any(finding.verdict != "cannot tell" or finding.parts for finding in told):
        return []
    return [UNPROVEN]


def likely_misplaced(findings: Sequence[Finding]) -> list[str]:
    """What is likely wrong with the thrusters' places and directions, with its odds and the lines to try, once."""
    likely = [finding for finding in findings if finding.check in _PLACES and finding.verdict == "warning"]
    found = []
    for cure in dict.fromkeys(finding.cure for finding in likely):
        first, *others = [finding for finding in likely if finding.cure == cure]
        also = [f"{one.short[0].upper()}{one.short[1:]}, too." for one in others]
        found.append(" ".join([first.told, *also, f"{cure}."]))
    return found


def defects(inspections: Sequence[Inspection], together: Sequence[Finding], vehicle: Vehicle) -> list[str]:
    """Defects of all logs together, then those that single logs have beside them, as sentences without an end."""
    known = [f for f in together if _matters(f, vehicle)]
    name = "all logs together"
    told = [_sentence(name, f) for f in known]
    same = {(f.check, f.channels) for f in known}
    for inspection in inspections:
        own = [f for f in inspection.quality if _matters(f, vehicle) and (f.check, f.channels) not in same]
        told += [_sentence(Path(inspection.path).name, f) for f in own]
    return told


def _sentence(name: str, finding: Finding) -> str:
    follows = [text for text in (finding.sentence, finding.consequence, finding.remedy) if text]
    return f"{name}: {'; '.join(follows)}{f' ({_HOW})' if finding.fix else ''}"


def _repairable(inspections: Sequence[Inspection]) -> list[str]:
    """What is wrong with each log, not so much that it is refused, and has a safe repair."""
    found = []
    for inspection in inspections:
        some = [f for f in inspection.quality if f.fix and f.verdict in ("defect", "warning") and not f.refused]
        told = "; ".join(f"{f.short or f.sentence}: {f.fix.sentence}" for f in some if f.fix)
        found += [f"{Path(inspection.path).name} has what a repair puts right: {told} ({_HOW})."] * bool(some)
    return found


def _matters(finding: Finding, vehicle: Vehicle) -> bool:
    """Whether a finding is a defect of what this vehicle is driven by or measured with."""
    commands = {name for name in finding.channels if command_kind(name)}
    driven = {thruster.channel for thruster in vehicle.thrusters}
    return finding.refused and (not commands or bool(driven & commands))
