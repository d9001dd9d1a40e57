"""The verb `ci`: whether a vehicle is still the boat of its logs; exit code 1 when it breaks a limit."""

from pathlib import Path

import typer

from ..measurements.log_options import Reading
from .console import print_json, prose, say, show, tell_replaced, warn
from .options import FORCE, JSON, LOGS, READING, VEHICLE, check_files, named, option, read_logs


def ci(
    logs: list[Path] = LOGS,
    vehicle: str = VEHICLE,
    limits: Path | None = option("--limits -l", "Limits file: the errors that are allowed."),
    model: str | None = option("--model", "Judge this in the vehicle's place; as in compare."),
    write: Path | None = option("--write-limits", "Write limits from today's errors.", metavar="OUT.yaml"),
    margin: float | None = option("--margin", "Share of today's errors that --write-limits leaves free; 0.2."),
    force: bool = FORCE,
    reading: Reading = READING,
    as_json: bool = JSON,
) -> None:
    """Judge a vehicle as it is by limits of its errors on logs; exit code 1 when it breaks one."""
    from ..comparison.error_limits import WRITTEN_BY, load_limits
    from ..physics.errors import RequestError
    from ..physics.presentation import percent
    from ..workflows.compare import MARGIN, first_limits
    from ..workflows.compare import ci as judge

    if (limits is None) == (write is None):
        raise RequestError(
            "ci: expected either --limits FILE to judge by, or --write-limits FILE to write first limits"
        )
    if margin is not None and write is None:
        raise RequestError("ci: --margin belongs to --write-limits; leave it out, or edit the limits file")
    if as_json and write is not None:
        raise RequestError("ci: --write-limits judges nothing that --json could print; leave one of them out")
    reads = (logs, vehicle, limits, model, reading.channel_map)
    earlier = check_files((("--write-limits", WRITTEN_BY, write),), reads, force=force)
    wanted = None if limits is None else load_limits(limits)  # before the logs, which take long
    inputs = read_logs(logs, vehicle, reading, "all")
    if wanted is None:
        share = MARGIN if margin is None else margin
        judged = inputs.vehicle.name if model is None else model
        about = f"errors of {judged} on {inputs.log_names}, and {percent(share)} more"
        first_limits(inputs, share, model).save(write or "", about)
        tell_replaced(earlier)
        warn(inputs.warnings, inputs.repairs)
        say(f"Limits: {write}. Look at them, then:")
        say(f"  undertow ci {named(logs)} --vehicle {vehicle} --limits {write}")
        return
    found = judge(inputs, wanted, model)
    if as_json:
        print_json(found.to_dict())
    else:
        from ..reports.terminal.laws_and_effects_screen import limits_table, verdict_text
        from ..reports.terminal.layout import BAD, GOOD

        warn(found.warnings, inputs.repairs)
        prose(verdict_text(found), GOOD if found.verdict == "holds" else BAD)
        show(limits_table(found))
    if found.verdict == "broken":
        raise typer.Exit(1)
