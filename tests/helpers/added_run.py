"""A run folder without a search: a short simulated log, and the effect that it hides added by name."""

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from verbs import done

import undertow

HIDDEN = "surge_quadratic_damping"


def write_added(folder: Path, report: bool) -> undertow.Run:
    """Write `log.csv` and `run` into a folder; the run as the Python functions give it."""
    log, known = folder / "log.csv", _added()
    shutil.copy(known.inputs.paths[0], log)
    run = replace(known, inputs=replace(known.inputs, paths=(str(log),)))
    undertow.write_run(run, folder / "run", report=report)
    return run


@cache
def _added() -> undertow.Run:
    """The run of a log that stays as long as the process does."""
    folder = Path(_FOLDER.name)
    done("simulate", "-v", "blueboat", "--effect", f"{HIDDEN}=-12", "--duration", "90", "--out", folder / "log.csv")
    return undertow.add([HIDDEN], undertow.read_inputs(folder / "log.csv", "blueboat"))


_FOLDER = TemporaryDirectory()
