"""The verb `inspect`: say whether logs are sound and what to do about it, and what undertow would do with them."""

from pathlib import Path

import typer

from ..measurements.log_options import Reading
from .console import print_json, progress, say, say_lines, show, tell_replaced
from .options import FORCE, JSON, PLAIN_READING, argument, check_files, option


def inspect(
    logs: list[Path] = argument("LOG...", "Logs of one boat, or folders of them; several tell more."),
    vehicle: str | None = option("--vehicle -v", "Vehicle whose needs are checked."),
    reading: Reading = PLAIN_READING,
    map_out: Path | None = option("--map-out", "YAML file to write the channel map in use to, for --map."),
    fix: Path | None = option("--fix", "Write the log with the safe repairs made.", metavar="OUT.csv"),
    force: bool = FORCE,
    as_json: bool = JSON,
) -> None:
    """Say whether logs are sound and what to do about it, and what undertow would do with them.

    Exit code 1 for a log with a defect, or of too little motion; with --fix, where the repaired log has one; 2 for one
    that cannot be read.
    """
    from ..measurements.channels.channel_map import map_text
    from ..measurements.inspection import Inspections
    from ..physics.errors import LogError
    from ..physics.files import on_top, write_text
    from ..physics.vehicle import load_vehicle
    from ..workflows.inspect_and_init import look_over

    targets = (("--map-out", "inspect --map-out", map_out), ("--fix", "inspect --fix", fix))
    earlier = check_files(targets, (logs, vehicle, reading.channel_map), force=force)
    model = None if vehicle is None else load_vehicle(vehicle)
    try:
        found, read = look_over(logs, model, reading, fix=fix, progress=progress)
    except LogError as error:
        if map_out is not None and error.mends:
            write_text(map_out, on_top("inspect --map-out", error.mends))
            raise LogError(f"{error.typed} {map_out} begins with that line.") from error
        raise
    mends = {} if isinstance(found, Inspections) else found.mends
    entries = {**mends, **read.entries, **mends}
    if map_out is not None:
        write_text(map_out, on_top("inspect --map-out", map_text(entries, read.unused)))
    tell_replaced(earlier)
    several = isinstance(found, Inspections)
    if as_json:
        print_json(found.to_dict())
    else:
        from ..reports.terminal.inspection_screen import fixed_text, inspection_screen, inspections_screen

        if several:
            show(inspections_screen(found))
        else:
            show(inspection_screen(found, model), fixed_text(found))
        mended = f", mended in {', '.join(mends)}" if mends else ""
        say(f"The channel map in use{f' for {read.name}' * several}{mended}; edit it, and give it back with --map:")
        say_lines(f"\n{map_text(entries)}")
    usable = found.fixed.usable if not several and found.fixed is not None else found.usable
    if not usable:
        raise typer.Exit(1)
