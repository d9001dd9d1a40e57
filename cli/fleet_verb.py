"""The verb `fleet`: logs of many boats as one data set, made and added to."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..measurements.log_options import Reading
from .console import complain, print_json, progress, say
from .options import FORCE, JSON, REQUIRED, UNREPAIRED_READING, VEHICLE, argument, one_by_one, option

if TYPE_CHECKING:
    from ..fleet.fleet_folder import FleetIndex

FLEET_OUT = option("--out -o", "Folder of the fleet, new or there already.", REQUIRED)


def fleet(
    logs: list[str] = argument("LOG...", "Manifests (CSV, YAML), logs, folders, patterns, s3://bucket/path/."),
    vehicle: str = VEHICLE,
    out: Path = FLEET_OUT,
    follow: list[str] | None = option(
        "--follow", "Parameters; default: damping, scales of thrust, mass.", metavar="SYMBOL"
    ),
    workers: int | None = option("--workers", "Processes of this machine; default: all its processors.", min=1),
    scheduler: str | None = option("--scheduler", "Dask scheduler that does the work instead.", metavar="ADDRESS"),
    force: bool = FORCE,
    reading: Reading = UNREPAIRED_READING,
    as_json: bool = JSON,
) -> None:
    """Make logs of many boats one data set, or add logs to it; what was read once is not read again.

    Exit code 1 when a log could not be read: it is named, and the data set is made of the others.
    """
    from ..fleet.build_fleet import build_fleet
    from ..fleet.workers import Engine
    from ..physics.presentation import listing

    symbols, engine = one_by_one(follow), Engine(workers, scheduler)
    built = build_fleet(logs, vehicle, out, reading, follow=symbols, engine=engine, progress=progress, force=force)
    index = built.index
    if as_json:
        now = {"read": built.read, "kept": built.kept, "skipped_now": [one.to_dict() for one in built.skipped]}
        print_json({**index.to_dict(), **now})
    else:
        say(f"{out}: {size_of(index)}")
        say(f"In this call: {built.read} read, {built.kept} there already, {len(built.skipped)} skipped.")
        if mixed := index.of_several_vehicles:
            say(f"Logs of {listing(mixed)} were read with vehicles that differ: give all of them again for one.")
    for one in built.skipped:
        complain(f"  skipped {one.log}: {one.problem}")
    if built.skipped:
        raise typer.Exit(1)


def size_of(index: "FleetIndex") -> str:
    """How much a fleet holds."""
    from ..physics.presentation import counted, lasting

    logs, boats = counted(len(index.logs), "log"), counted(len(index.boats), "boat")
    return f"{logs} of {boats}, {lasting(index.hours)} under way."
