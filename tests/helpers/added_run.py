"""A run folder without a search: a short simulated log, and the effect that it hides added by name."""

from pathlib import Path

from verbs import done

import undertow

HIDDEN = "surge_quadratic_damping"


def write_added(folder: Path, report: bool) -> undertow.Run:
    """Write `log.csv` and `run` into a folder; the run as the Python functions give it."""
    done("simulate", "-v", "blueboat", "--effect", f"{HIDDEN}=-12", "--duration", "90", "--out", folder / "log.csv")
    run = undertow.add([HIDDEN], undertow.read_inputs(folder / "log.csv", "blueboat"))
    undertow.write_run(run, folder / "run", report=report)
    return run
