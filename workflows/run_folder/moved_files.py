"""Provenance of a run: versions, the command that makes it again, digests of its logs, and where these lie now."""

import os
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated

from pydantic import Field

from ...comparison.facts import MadeFrom
from ...measurements.formats.registry import find_logs, log_digests
from ...measurements.log_options import AS_GUESSED, Reading
from ...measurements.prepared_logs import FOLDS, PathLike
from ...physics.errors import RequestError, shown
from ...physics.file_records import Flag, Record
from ...physics.presentation import listing

PACKAGES = ("undertow", "numpy", "scipy", "pandas", "pysindy", "cvxpy", "clarabel", "matplotlib")


def versions() -> dict[str, str]:
    """The versions of Python, undertow and the packages that its numbers come from, as far as they are there."""
    result = {"python": ".".join(map(str, sys.version_info[:3]))}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            result[name] = version(name)
    return result


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


_TOLD = 12
"""Digits of a SHA-256 in a message: two files agree in them by chance in one of 2^48 cases."""


@dataclass(frozen=True, slots=True)
class Moved:
    """Places of a run's logs and channel map now, as the user says; which is which, their content says.

    Attributes
    ----------
    logs : files, folders or patterns
    channel_map : a file
    of_several : several runs are asked for, so that a log need not be of each
    """

    logs: tuple[PathLike, ...] = ()
    channel_map: PathLike | None = None
    of_several: bool = False


UNMOVED = Moved()
"""Wherever they are found: where they were, where they were as seen from the run folder, beside it, or in it."""


@dataclass(frozen=True, slots=True)
class MadeFile:
    """A file that a run was made from.

    Attributes
    ----------
    path : as it was given, where the run was made
    from_run : as it reads from the run folder; None in a run of an earlier version
    sha256 : its digest; None where nobody knows it, as of a log in memory
    """

    path: str
    from_run: str | None = None
    sha256: str | None = None


class SeenFromRun(Record):
    """Paths of the logs and of the map as they read from the run folder."""

    logs: tuple[str, ...] = ()
    channel_map: str | None = None


class RunOrigin(MadeFrom):
    """The logs of a run and how they were read, as `run.json` has them.

    Attributes
    ----------
    logs, channel_map : paths, as they were given where the run was made
    frame, namespace, as_is, fix : how the logs were read, see `Reading`
    from_run : the same paths as they read from the run folder; None in a run of an earlier version
    channel_map_sha256 : digest of the map
    """

    logs: Annotated[tuple[str, ...], Field(min_length=1)]
    frame: str | None = None
    channel_map: str | None = None
    namespace: str | None = None
    as_is: Flag = False
    fix: Flag = False
    from_run: SeenFromRun | None = None
    channel_map_sha256: str | None = None

    @property
    def made_logs(self) -> list[MadeFile]:
        """The logs, one a path."""
        known = {one.path: one.sha256 for one in self.log_sha256}
        seen = () if self.from_run is None else self.from_run.logs
        there = seen if len(seen) == len(self.logs) else [None] * len(self.logs)
        return [MadeFile(path, here, known.get(path)) for path, here in zip(self.logs, there, strict=True)]

    @property
    def made_map(self) -> MadeFile | None:
        """The channel map; None of a run without one."""
        if self.channel_map is None:
            return None
        seen = None if self.from_run is None else self.from_run.channel_map
        return MadeFile(self.channel_map, seen, self.channel_map_sha256)


def places(folder: Path, made: MadeFile) -> Iterator[str]:
    """Places where a file may be, the likeliest first: as given, as seen from the run folder, beside it, in it."""
    yield made.path
    if made.from_run is not None:
        yield _joined(folder, made.from_run)
    if made.sha256 is not None:  # a mere name is no proof
        name = os.path.basename(made.path)
        yield from (_joined(folder, os.path.join(up, name)) for up in (os.pardir, os.curdir))


def logs_now(folder: Path, made: Sequence[MadeFile], moved: Moved = UNMOVED) -> list[str]:
    """The logs of a run where they are now, in the order of the run.

    Parameters
    ----------
    folder : the run folder
    moved : what the user says of them

    Raises
    ------
    RequestError, LogError
        when one is nowhere, or what is in its place is another file, or a file that is given is none of them.
    """
    given, several = [os.fspath(path) for path in moved.logs], moved.of_several
    named = find_logs(given)[0] if given else ()
    digest = cache(_digest)  # of many logs in a folder each is asked for many times
    result = [_found(folder, one, named, digest, others=len(made) > 1 or several) for one in made]
    stray = [path for path in given if os.path.isfile(path) and path not in result]
    if stray and not several:
        raise RequestError(
            f"{stray[0]} is none of the logs that {folder} is of ({listing([shown(one.path) for one in made])}), "
            "by its SHA-256; leave it out, or make a run of it with 'undertow discover'"
        )
    return result


def map_now(folder: Path, made: MadeFile | None, given: PathLike | None = None) -> str | None:
    """The channel map of a run where it is now; see `logs_now`. One that is nowhere is left for its reader to say.

    Parameters
    ----------
    folder : the run folder
    made : the map as `run.json` has it
    given : where the user says it is
    """
    if made is None:
        if given is not None:
            raise RequestError(
                f"{folder} was made without a channel map, and {given} would make another log of it; leave out --map, "
                "or give --vehicle V and the LOG in place of the run"
            )
        return None
    if given is None and not any(os.path.exists(place) for place in places(folder, made)):
        return made.path
    return _found(folder, made, () if given is None else (os.fspath(given),), _digest, option="--map")


def _found(
    folder: Path,
    made: MadeFile,
    given: Sequence[str],
    digest: Callable[[str], str | None],
    *,
    option: str = "--log",
    others: bool = False,
) -> str:
    """The first place in which the very file is; that which the user names, or, of `others` in the run, might name."""

    def is_it(place: str) -> bool:
        if made.sha256 is not None:
            return digest(place) == made.sha256
        return place not in given or len(given) == 1 or os.path.basename(place) == os.path.basename(made.path)

    named = [*given, *(places(folder, made) if others or not given else ())]
    there = [place for place in named if os.path.exists(place)]  # a Path of a name too long raises
    found = next(filter(is_it, there), None)
    if found is not None:
        return found
    if there and made.sha256 is not None:
        came = digest(there[0])
        text = "cannot be read" if came is None else f"has SHA-256 {came[:_TOLD]}..."
        raise RequestError(
            f"{folder} was made from {shown(made.path)} with SHA-256 {made.sha256[:_TOLD]}..., and {there[0]} {text}: "
            f"another file, or one that was changed since. Say where the one that is meant is, with {option}, or make "
            "a run of this one with 'undertow discover'"
        )
    missing = next((path for path in given if not os.path.exists(path)), None)
    if missing is not None:
        raise RequestError(f"{missing} is not there; give the place where {made.path} of {folder} is now")
    of_table = "" if made.sha256 else "; a log that was in memory is given again, to read_inputs(LOG, VEHICLE)"
    raise RequestError(
        f"{folder} was made from {shown(made.path)}, which is not there (seen from {Path.cwd()}, and from the run "
        f"folder); put it beside the run folder, or say where it is now with {option}{of_table}"
    )


def _digest(path: str) -> str | None:
    return log_digests([path])[0]["sha256"]


def _joined(folder: Path, path: str) -> str:
    """A path seen from a folder, without the steps back unless the folder is a link and they lead elsewhere."""
    whole = os.path.join(folder, path)
    short = os.path.normpath(whole)
    try:
        elsewhere = os.path.exists(whole) and not os.path.samefile(short, whole)
    except OSError:
        elsewhere = True
    return whole if elsewhere else short
