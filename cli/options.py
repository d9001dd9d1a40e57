"""Options that the verbs share, how they read logs, and the examples below the options."""

import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ..measurements.log_options import Reading
from .console import failing_clearly, progress

if TYPE_CHECKING:
    from ..measurements.prepared_logs import Inputs, PathLike


_FEW = 3
"""Logs that are named in a command that is told as the next one: more would not fit on a line."""

REQUIRED: Any = ...
"""The default of an option that has none."""


def option(names: str, text: str, default: Any = None, **how: Any) -> Any:
    """Declare an option of a verb, as the default of a parameter.

    Parameters
    ----------
    names : as they are typed, with a blank between two, such as "--out -o"
    text : its help
    how : see `typer.Option`
    """
    return typer.Option(default, *names.split(), help=text, **how)


def argument(metavar: str, text: str, default: Any = REQUIRED) -> Any:
    """Declare an argument of a verb, as the default of a parameter; see `option`."""
    return typer.Argument(default, metavar=metavar, help=text)


LOGS = argument("LOG...", "Logs, or folders of them: CSV, Parquet, bags, .bin, .tlog, .ulg, .mat.")
VEHICLE = option("--vehicle -v", "Vehicle file, run folder, or name of a shipped one.", REQUIRED)
FRAME = option("--frame", "enu or ned, for channels that are not NED/FRD.")
CHANNEL_MAP = option("--map", "YAML file that maps channels.")
AS_IS = option("--as-is", "Take logs that are known to be broken as they are, and be warned.", False)
_READING: dict[str, tuple[Any, Any]] = {
    "frame": (str | None, FRAME),
    "channel_map": (Path | None, CHANNEL_MAP),
    "namespace": (str | None, option("--namespace", "Start of the topics of the vehicle meant, in a log of several.")),
    "as_is": (bool, AS_IS),
    "fix": (bool, option("--fix", "Make the safe repairs of inspect --fix in memory, and say which.", False)),
}
"""Type and option of each field of a `Reading`."""
PLAIN_READING: Any = ("frame", "channel_map", "namespace")
UNREPAIRED_READING: Any = (*PLAIN_READING, "as_is")
READING: Any = (*UNREPAIRED_READING, "fix")
"""A reading with the options of these fields: `telling` puts them in the place of the parameter `reading`."""
RUN_LOGS = option("--log", "Where a log of the run is now, if it was moved; it is checked.", metavar="LOG")
VEHICLE_OUT = option("--out -o", "Vehicle file to write.")
JSON = option("--json", "Print JSON for machines instead of tables.", False)
FORCE = option("--force", "Write over what this verb did not write; never over what it reads.", False)
MINUTES = option(
    "--minutes",
    "Try other sizes and settings of the network, and of best other networks, too, for about so long.",
    metavar="N",
)
SEED = option("--seed", "Seed of everything random; equal seeds give equal files.", 0, min=0)
QUIET = option(
    "--quiet -q", "Tell nothing of work that goes on; results, warnings and errors are told all the same.", False
)


def telling(verb: Callable[..., None]) -> Callable[..., None]:
    """A verb that takes --quiet beside its own options, knows when it began, and fails with one clear message.

    Where it has a parameter `reading`, the options of that stand in its place.
    """
    own, parameters = signature(verb).parameters, list[Parameter]()
    fields: tuple[str, ...] = own["reading"].default if "reading" in own else ()
    for one in own.values():
        read = [one.replace(name=name, annotation=_READING[name][0], default=_READING[name][1]) for name in fields]
        parameters += read if one.name == "reading" else [one]
    parameters.append(Parameter("quiet", Parameter.KEYWORD_ONLY, default=QUIET, annotation=bool))

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


def read_logs(logs: Sequence["PathLike"], vehicle: Any, reading: Reading, judge: str | None = None) -> "Inputs":
    """Logs read and prepared for a vehicle, with progress."""
    from ..workflows.inputs import read_inputs

    return read_inputs(logs, vehicle, reading, judge=judge, progress=progress)


def logs_in_steps(logs: Sequence["PathLike"], vehicle: Any, reading: Reading, judge: str | None) -> Iterator[Any]:
    """Logs prepared for a vehicle, and then what is wrong with them, with progress; see `read_in_steps`."""
    from ..workflows.inputs import read_in_steps

    prepared, checks = read_in_steps(logs, vehicle, reading, judge=judge, progress=progress)
    yield prepared
    yield checks()


def check_folder(out: Path, reads: Iterable[Any] = (), *, report: bool = True, force: bool = False) -> None:
    """Refuse a run folder that cannot be written, before the work on it begins."""
    from ..workflows.run_folder.run_files import check_target

    check_target(out, reads, report=report, force=force)


def check_files(
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
