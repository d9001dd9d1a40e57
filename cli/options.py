"""What the verbs share: the options that they declare, and how they read logs."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..measurements.log_options import AS_GUESSED, Reading
from .console import progress

if TYPE_CHECKING:
    from ..measurements.prepared_logs import Inputs

FEW_LOGS = 3
"""Logs that are named in a command that is told as the next one: more would not fit on a line."""

Logs = Annotated[
    list[Path],
    typer.Argument(metavar="LOG...", help="Logs, or folders of them: CSV, Parquet, bags, .bin, .tlog, .ulg, .mat."),
]
VehicleOption = Annotated[
    str, typer.Option("--vehicle", "-v", help="Vehicle file, run folder, or name of a shipped one.")
]
FrameOption = Annotated[str | None, typer.Option("--frame", help="enu or ned, for channels that are not NED/FRD.")]
MapOption = Annotated[Path | None, typer.Option("--map", help="YAML file that maps channels.")]
NamespaceOption = Annotated[
    str | None, typer.Option("--namespace", help="Start of the topics of the vehicle meant, in a log of several.")
]
AsIsOption = Annotated[
    bool, typer.Option("--as-is", help="Take logs that are known to be broken as they are, and be warned.")
]
FixOption = Annotated[
    bool, typer.Option("--fix", help="Make the safe repairs of inspect --fix in memory, and say which.")
]
RunLogs = Annotated[
    list[Path] | None,
    typer.Option("--log", metavar="LOG", help="Where a log of the run is now, if it was moved; it is checked."),
]
VehicleOut = Annotated[Path | None, typer.Option("--out", "-o", help="Vehicle file to write.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for machines instead of tables.")]
ForceOption = Annotated[
    bool, typer.Option("--force", help="Write over what this verb did not write; never over what it reads.")
]
SeedOption = Annotated[
    int, typer.Option("--seed", min=0, help="Seed of everything random; equal seeds give equal files.")
]


def read_logs(
    logs: list[Path] | list[str],
    vehicle: Any,
    reading: Reading = AS_GUESSED,
    judge: str | None = None,
) -> "Inputs":
    """Logs read and prepared for a vehicle, with progress."""
    from ..workflows.inputs import read_inputs

    return read_inputs(logs, vehicle, reading, judge=judge, progress=progress)


def logs_in_steps(logs: list[Path] | list[str], vehicle: Any, reading: Reading, judge: str | None) -> Iterator[Any]:
    """Logs prepared for a vehicle, and then what is wrong with them, with progress; see `read_in_steps`."""
    from ..workflows.inputs import read_in_steps

    prepared, checks = read_in_steps(logs, vehicle, reading, judge=judge, progress=progress)
    yield prepared
    yield checks()


def check_folder(out: Path, reads: Iterable[Any] = (), *, report: bool = True, force: bool = False) -> None:
    """Refuse a run folder that cannot be written, before the work on it begins."""
    from ..workflows.run_folder.targets import check_target

    check_target(out, reads, report=report, force=force)


def earlier_files(
    targets: Iterable[tuple[str, str, Path | None]], reads: Iterable[Any], *, force: bool = False
) -> list[Path]:
    """Check the files to be written, each with its option and what writes it; give those that are there already."""
    from ..workflows.run_folder.targets import Kind, check_targets

    return check_targets([(option, Kind(by), path) for option, by, path in targets], reads, force=force)
