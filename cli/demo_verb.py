"""The verb `demo`: tell the whole story on a log recorded from a Gazebo BlueBoat."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .console import failing_clearly, say
from .discover_verb import tell_discovery
from .options import ForceOption, check_folder, read_logs


def demo(
    out: Annotated[Path, typer.Option("--out", help="Run folder to write.")] = Path("undertow-demo"),
    force: ForceOption = False,
) -> None:
    """Tell the whole story on a log recorded from a Gazebo BlueBoat."""
    from importlib import resources

    with failing_clearly():
        folder = resources.files("undertow") / "data"
        with (
            resources.as_file(folder / "gazebo_blueboat.csv.gz") as log,
            resources.as_file(folder / "demo.yaml") as car,
        ):
            check, read = partial(_check, out, force), partial(read_logs, [log], str(car))
            tell_discovery(out, check, read, report=True, seed=0, force=force, told="short")


def _check(out: Path, force: bool) -> None:
    check_folder(out, force=force)
    say("A log of 4 minutes from a simulated BlueBoat, and a Fossen model with linear drag only.")
