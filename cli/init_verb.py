"""The verb `init`: a vehicle file and a channel map made of logs."""

import sys
from pathlib import Path

import typer

from ..measurements.log_options import Reading
from .console import progress, prose, say, show, tell_replaced
from .options import FORCE, LOGS, UNREPAIRED_READING, check_files, named, option

_VEHICLE, _CHANNELS = Path("vehicle.yaml"), Path("channels.yaml")
"""Files that are written unless an option names others."""
_ASKED = {
    "length": "Length of the hull [m]",
    "mass": "Mass with payload [kg]",
    "spacing": "Distance between port and starboard thruster [m]",
    "thrust": "Thrust of one thruster at full command ahead [N]",
}
"""What is asked on a terminal, where no option has it."""


def init(
    logs: list[Path] = LOGS,
    out: Path = option("--out -o", "Vehicle file to write.", _VEHICLE),
    channels_out: Path = option("--channels", "Channel map to write.", _CHANNELS, metavar="OUT.yaml"),
    length: float | None = option("--length", "Length of the hull in metres."),
    mass: float | None = option("--mass", "Mass with payload in kilograms."),
    spacing: float | None = option("--spacing", "Distance between port and starboard thruster in metres."),
    thrust: float | None = option("--thrust", "Thrust of one thruster at full command ahead in newtons."),
    like: str | None = option("--like", "Take the hull of this vehicle: a file, or the name of a shipped one."),
    reading: Reading = UNREPAIRED_READING,
    force: bool = FORCE,
) -> None:
    """Make a vehicle file and a channel map of a log, every number with its source."""
    from ..reports.terminal.inspection_screen import init_screen
    from ..reports.terminal.layout import UNSURE
    from ..workflows.inspect_and_init import Hull
    from ..workflows.inspect_and_init import init as draft_of

    targets = (("--out", "init", out), ("--channels", "init --channels", channels_out))
    earlier = check_files(targets, (logs, like, reading.channel_map), force=force)
    given = {"length": length, "mass": mass, "spacing": spacing, "thrust": thrust}
    if like is None and _on_a_terminal():
        given = {name: _ask(name) if value is None else value for name, value in given.items()}
    draft = draft_of(logs, Hull(**given), like, reading, progress=progress)
    draft.write(out, channels_out)
    tell_replaced(earlier)
    show(*init_screen(draft.vehicle, draft.thrusters, draft.to_look_at))
    if draft.unsettled:
        prose(f"Settle first: {draft.unsettled}", UNSURE)
    say(f"Vehicle: {out}; channel map: {channels_out}. Look at both, then:")
    say(f"  undertow discover {named(logs)} --vehicle {out} --map {channels_out} --out run")


def offered(logs: list[Path], reading: Reading, out: Path) -> tuple[str, Path]:
    """Vehicle file and channel map that a person on a terminal lets `init` write, where none was given.

    Raises
    ------
    RequestError
        where nobody can be asked, or the answer is no; it says what `init` would write.
    """
    from ..physics.errors import RequestError
    from ..physics.presentation import listing
    from ..physics.vehicle import shipped_vehicles
    from ..workflows.inspect_and_init import init as draft_of

    draft = draft_of(logs, reading=reading, progress=progress)
    seen = listing([f"{one.channel} ({one.side or 'side unknown'})" for one in draft.thrusters])
    text = f"discover: no --vehicle is given. The log shows {len(draft.thrusters)} thrusters: {seen}"
    if _on_a_terminal():
        say(f"{text}.")
        if typer.confirm(f"Write {_VEHICLE} and {_CHANNELS} on a typical hull, and go on with them?", err=True):
            targets = (("--out", "init", _VEHICLE), ("--channels", "init --channels", _CHANNELS))
            earlier = check_files(targets, (logs, reading.channel_map))
            draft.write(_VEHICLE, _CHANNELS)
            tell_replaced(earlier)
            return str(_VEHICLE), _CHANNELS
    raise RequestError(
        f"{text}. 'undertow init LOG --mass KG' writes a vehicle file and a channel map of them; then: undertow "
        f"discover LOG --vehicle {_VEHICLE} --map {_CHANNELS} --out {out}. Or name a shipped vehicle: "
        f"{', '.join(shipped_vehicles())}"
    )


def _on_a_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def _ask(name: str) -> float | None:
    """A number that a person types, None for an empty line."""
    while True:
        text = typer.prompt(f"{_ASKED[name]} (Enter: typical)", default="", show_default=False, err=True).strip()
        try:
            return float(text.replace(",", ".")) if text else None
        except ValueError:
            say(f"expected a number, got {text[:40]}")
