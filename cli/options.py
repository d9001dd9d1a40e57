"""Options that the verbs share, how they read logs, and the examples below the options."""

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


EXAMPLES = {
    "demo": ("undertow demo",),
    "init": (
        "undertow init boat.bin --mass 22 --length 1.2",
        "undertow init logs/ --like otter --out boat.yaml --channels map.yaml",
    ),
    "inspect": (
        "undertow inspect boat.bin --vehicle blueboat",
        "undertow inspect boat.csv --fix repaired.csv --map-out channels.yaml",
    ),
    "compare": (
        "undertow compare boat.csv --vehicle boat.yaml --model run --model lstm",
        "undertow compare boat.csv --vehicle boat.yaml --split all --out comparison.json --json",
        "undertow compare second.csv --vehicle boat.yaml --model run --page second",
    ),
    "check": ("undertow check run", "undertow check lstm boat.csv --vehicle boat.yaml --out audit.json"),
    "ci": (
        "undertow ci logs/ --vehicle boat.yaml --limits limits.yaml",
        "undertow ci boat.csv --vehicle boat.yaml --write-limits limits.yaml --margin 0.3",
    ),
    "discover": (
        "undertow discover boat.csv --vehicle boat.yaml --out run",
        "undertow discover logs/*.bin --vehicle boat.yaml --refit --out run",
    ),
    "fit": (
        "undertow fit boat.csv --vehicle boat.yaml --out fitted.yaml",
        "undertow fit boat.csv --vehicle boat.yaml --free X_uu --hold N_rdot --out fitted.yaml",
    ),
    "add": (
        "undertow add surge_quadratic_damping munk_moment --run run --out corrected.yaml",
        "undertow add 'yaw:u|r|' boat.csv --vehicle boat.yaml",
    ),
    "adapt": (
        "undertow adapt boat.csv --vehicle boat.yaml --follow",
        "undertow adapt - --vehicle boat.yaml --effect surge_quadratic_damping --every 5 --json",
        "undertow adapt boat.csv --vehicle boat.yaml --like monday.csv --out now.yaml --values values.csv",
    ),
    "fleet": (
        "undertow fleet logs/ --vehicle boat.yaml --out fleet",
        "undertow fleet boats.csv s3://bucket/2026/ --vehicle boat.yaml --workers 4 --out fleet",
    ),
    "diary": ("undertow diary fleet --out diary.html", "undertow diary fleet --false-alarms 0.2 --json"),
    "merge": ("undertow merge north south --out fleet",),
    "cluster": ("undertow cluster --workers 2",),
    "plan": (
        "undertow plan run --space 40 --thrust 60 --at 54.3233,10.1394 --out mission",
        "undertow plan run munk_moment sway_added_mass --speed 1.5 --out mission",
    ),
    "train": (
        "undertow train boat.csv --vehicle boat.yaml --residual lstm --out lstm --explain",
        "undertow train boat.csv --vehicle boat.yaml --residual mlp --epochs 50 --out mlp --resume",
        "undertow train sister.csv --vehicle sister.yaml --start lstm --set learning_rate=0.001 --out sister-lstm",
    ),
    "explain": ("undertow explain lstm boat.csv --vehicle boat.yaml",),
    "effects": ("undertow effects", "undertow effects munk_moment --vehicle otter"),
    "simulate": (
        "undertow simulate --vehicle otter --effect steady_current=0.2,-0.1 --out otter.csv.gz",
        "undertow simulate --vehicle blueboat --programme zigzag --noise rough --duration 120 --out log.parquet",
    ),
    "app": ("undertow app", "undertow app boat.bin --vehicle boat.yaml --port 8500"),
    "export": (
        "undertow export run --to c --time-step 0.02 --out boat.h",
        "undertow export blueboat --to sdf --gz fortress --out blueboat.sdf",
    ),
    "control": (
        "undertow control blueboat --effect surge_quadratic_damping=-25 --out square.svg",
        "undertow control boat.yaml run lstm --true true.yaml --track eight --track station --controller nmpc",
    ),
    "report": ("undertow report run --model lstm --pdf", "undertow report monday tuesday --out fleet.html"),
}
"""By verb; a test parses each of them."""


def below(verb: str, *more: str) -> str:
    """What stands below the options of a verb: its examples, a line each, then more paragraphs."""
    return "\n\n".join(["Examples:", *(f"  {line}" for line in EXAMPLES[verb]), *more])
