"""What a run was made with: versions of the packages, the command that makes it again, and digests of the logs."""

import hashlib
import os
import shlex
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("undertow", "numpy", "scipy", "pandas", "pysindy", "scikit-learn", "cvxpy", "clarabel", "matplotlib")
_CHUNK = 1 << 20


def versions() -> dict[str, str]:
    """The versions of Python, undertow and the packages that its numbers come from, as far as they are there."""
    found = {"python": ".".join(map(str, sys.version_info[:3]))}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def log_digests(paths: Sequence[str]) -> list[dict[str, Any]]:
    """SHA-256 of each log as it is on disk now; of a folder, over the names and contents of the files in it.

    A log that is no longer there has null.
    """
    return [{"path": path, "sha256": _digest(Path(path))} for path in paths]


def command(
    verb: Sequence[str],
    logs: Sequence[str],
    *,
    seed: int,
    refit: bool,
    frame: str | None = None,
    channel_map: str | None = None,
    namespace: str | None = None,
    as_is: bool = False,
) -> str:
    """The command line that makes the run again, as it must be given in the run folder, into `again` there.

    Parameters
    ----------
    logs, channel_map : as seen from the run folder

    Examples
    --------
    >>> command(["discover"], ["one log.csv"], seed=3, refit=False, frame="enu")
    "undertow discover 'one log.csv' --vehicle nominal.yaml --seed 3 --frame enu --out again"
    """
    words = ["undertow", *verb, *logs, "--vehicle", "nominal.yaml"]
    words += ["--seed", str(seed)] * (verb[0] == "discover") + ["--refit"] * refit
    words += ["--frame", frame] if frame else []
    words += ["--map", channel_map] if channel_map else []
    words += ["--namespace", namespace] if namespace else []
    words += ["--as-is"] * as_is
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


def _digest(path: Path) -> str | None:
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    digest = hashlib.sha256()
    try:
        for file in files:
            if path.is_dir():
                digest.update(f"{file.relative_to(path).as_posix()}\0{file.stat().st_size}\0".encode())
            with file.open("rb") as stream:
                while chunk := stream.read(_CHUNK):
                    digest.update(chunk)
    except OSError:
        return None
    return digest.hexdigest()
