"""What a run was made with: versions of the packages, the command that makes it again, and digests of the logs."""

import os
import shlex
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ...measurements.log_options import AS_GUESSED, Reading
from ...measurements.prepared_logs import FOLDS

PACKAGES = ("undertow", "numpy", "scipy", "pandas", "pysindy", "cvxpy", "clarabel", "matplotlib")


def versions() -> dict[str, str]:
    """The versions of Python, undertow and the packages that its numbers come from, as far as they are there."""
    found = {"python": ".".join(map(str, sys.version_info[:3]))}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def command(
    verb: Sequence[str],
    logs: Sequence[str],
    reading: Reading = AS_GUESSED,
    *,
    seed: int,
    refit: bool | None = None,
    judge: str = FOLDS,
) -> str:
    """The command line that makes the run again, as it must be given in the run folder, into `again` there.

    Parameters
    ----------
    logs, reading : with paths as seen from the run folder
    refit : whether the model's own numbers were fitted, where the vehicle file does not say so by itself
    judge : what judged it

    Examples
    --------
    >>> command(["discover"], ["one log.csv"], Reading("enu"), seed=3)
    "undertow discover 'one log.csv' --vehicle nominal.yaml --seed 3 --frame enu --out again"
    """
    words = ["undertow", *verb, *logs, "--vehicle", "nominal.yaml"]
    words += ["--seed", str(seed)] * (verb[0] == "discover") + ["--refit"] * (refit is True)
    words += ["--no-refit"] * (refit is False)
    words += ["--split", judge] if verb[0] == "discover" and judge != FOLDS else []
    words += ["--frame", reading.frame] if reading.frame else []
    words += ["--map", str(reading.channel_map)] if reading.channel_map else []
    words += ["--namespace", reading.namespace] if reading.namespace else []
    words += ["--as-is"] * reading.as_is + ["--fix"] * reading.fix
    words += ["--out", "again" if verb[0] == "discover" else "again.yaml"]
    return shlex.join(words)


def seen_from(folder: Path, path: str) -> str:
    """A relative path of the working folder as it reads from another folder; an absolute one as it is.

    Examples
    --------
    >>> seen_from(Path("runs/mon"), "logs/mon.csv")
    '../../logs/mon.csv'
    """
    return path if Path(path).is_absolute() else Path(os.path.relpath(path, folder)).as_posix()
