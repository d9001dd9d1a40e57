"""The verb `demo`: tell the whole story on a log recorded from a Gazebo BlueBoat."""

from functools import partial
from pathlib import Path

from ..measurements.log_options import AS_GUESSED
from .console import say
from .discover_verb import Telling, tell_discovery
from .options import FORCE, check_folder, logs_in_steps, option


def demo(out: Path = option("--out", "Run folder to write.", Path("undertow-demo")), force: bool = FORCE) -> None:
    """Tell the whole story on a log recorded from a Gazebo BlueBoat."""
    from importlib import resources

    folder = resources.files("undertow") / "data"
    with resources.as_file(folder / "gazebo_blueboat.csv.gz") as log, resources.as_file(folder / "demo.yaml") as car:
        check, read = partial(_check, out, force), partial(logs_in_steps, [log], str(car), AS_GUESSED, None)
        tell_discovery(out, check, read, Telling(True, force, "short"), seed=0)


def _check(out: Path, force: bool) -> None:
    check_folder(out, force=force)
    say("A log of 4 minutes from a simulated BlueBoat, and a Fossen model with linear drag only.")
