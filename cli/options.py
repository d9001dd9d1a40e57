"""Options that the verbs share, how they read logs, and the examples below the options."""

import tomllib
from collections.abc import Callable, Iterable, Iterator
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..measurements.log_options import AS_GUESSED, Reading
from .console import failing_clearly, progress

if TYPE_CHECKING:
    from ..measurements.prepared_logs import Inputs


_FEW = 3
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
AsIsOption = Annotated[
    bool, typer.Option("--as-is", help="Take logs that are known to be broken as they are, and be warned.")
]
_READING = {
    "frame": FrameOption,
    "channel_map": MapOption,
    "namespace": Annotated[
        str | None, typer.Option("--namespace", help="Start of the topics of the vehicle meant, in a log of several.")
    ],
    "as_is": AsIsOption,
    "fix": Annotated[
        bool, typer.Option("--fix", help="Make the safe repairs of inspect --fix in memory, and say which.")
    ],
}
"""Option of each field of a `Reading`."""
PlainReading = Annotated[Reading, "frame", "channel_map", "namespace"]
UnrepairedReading = Annotated[Reading, "frame", "channel_map", "namespace", "as_is"]
ReadingOptions = Annotated[Reading, "frame", "channel_map", "namespace", "as_is", "fix"]
"""A reading with the options of these fields: `telling` puts them in the place of the parameter `reading`."""
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


QuietOption = Annotated[
    bool,
    typer.Option(
        "--quiet", "-q", help="Tell nothing of work that goes on; results, warnings and errors are told all the same."
    ),
]


def telling(verb: Callable[..., None]) -> Callable[..., None]:
    """A verb that takes --quiet beside its own options, knows when it began, and fails with one clear message.

    Where it has a parameter `reading`, the options of that stand in its place.
    """
    parameters: list[Parameter] = []
    fields: tuple[str, ...] = ()
    for own in signature(verb).parameters.values():
        if own.name == "reading":
            fields = own.annotation.__metadata__
            parameters += [
                own.replace(name=name, default=getattr(own.default, name), annotation=_READING[name]) for name in fields
            ]
        else:
            parameters.append(own)
    parameters.append(Parameter("quiet", Parameter.KEYWORD_ONLY, default=False, annotation=QuietOption))

    @wraps(verb)
    def told(*words: Any, quiet: bool = False, **options: Any) -> None:
        progress.begin(quiet)
        with failing_clearly():
            if fields:
                options["reading"] = Reading(**{name: options.pop(name) for name in fields})
            verb(*words, **options)

    vars(told)["__signature__"] = signature(verb).replace(parameters=parameters)
    told.__annotations__ = {one.name: one.annotation for one in parameters}
    return told


def named(logs: list[Path]) -> str:
    """Logs in a command that is told as the next one."""
    return " ".join(map(str, logs)) if len(logs) <= _FEW else "LOG..."


def one_by_one(given: list[str] | None) -> list[str]:
    """Words that were given one by one or with commas."""
    return [word.strip() for text in given or [] for word in text.split(",")]


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
    from ..workflows.run_folder.run_files import check_target

    check_target(out, reads, report=report, force=force)


def earlier_files(
    targets: Iterable[tuple[str, str, Path | None]], reads: Iterable[Any], *, force: bool = False
) -> list[Path]:
    """Check the files to be written, each with its option and what writes it; give those that are there already."""
    from ..workflows.run_folder.run_files import Kind, check_targets

    return check_targets([(option, Kind(by), path) for option, by, path in targets], reads, force=force)


EXAMPLES: dict[str, list[str]] = tomllib.loads(Path(__file__).with_name("examples.toml").read_text("utf-8"))
"""By verb; a test parses each of them."""


def below(verb: str, *more: str) -> str:
    """What stands below the options of a verb: its examples, a line each, then more paragraphs."""
    return "\n\n".join(["Examples:", *(f"  {line}" for line in EXAMPLES[verb]), *more])
