"""The verb `fleet`: logs of many boats as one data set, made and added to."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..measurements.log_options import AS_GUESSED
from .console import complain, print_json, progress, say
from .options import ForceOption, JsonOption, UnrepairedReading, VehicleOption, one_by_one

if TYPE_CHECKING:
    from ..fleet.fleet_folder import FleetIndex

FleetOut = Annotated[Path, typer.Option("--out", "-o", help="Folder of the fleet, new or there already.")]


def fleet(
    logs: Annotated[
        list[str],
        typer.Argument(metavar="LOG...", help="Manifests (CSV, YAML), logs, folders, patterns, s3://bucket/path/."),
    ],
    vehicle: VehicleOption,
    out: FleetOut,
    follow: Annotated[
        list[str] | None,
        typer.Option("--follow", metavar="SYMBOL", help="Parameters; default: damping, scales of thrust, mass."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Processes of this machine; default: all its processors.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Dask scheduler that does the work instead.")
    ] = None,
    force: ForceOption = False,
    reading: UnrepairedReading = AS_GUESSED,
    as_json: JsonOption = False,
) -> None:
    """Make logs of many boats one data set, or add logs to it; what was read once is not read again.

    Exit code 1 when a log could not be read: it is named, and the data set is made of the others.
    """
    from ..fleet.build_fleet import build_fleet
    from ..fleet.workers import Engine
    from ..physics.presentation import listing

    built = build_fleet(
        logs,
        vehicle,
        out,
        reading,
        follow=one_by_one(follow),
        engine=Engine(workers, scheduler),
        progress=progress,
        force=force,
    )
    if as_json:
        print_json(
            {
                **built.index.to_dict(),
                "read": built.read,
                "kept": built.kept,
                "skipped_now": [one.to_dict() for one in built.skipped],
            }
        )
    else:
        index = built.index
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
