"""The run folder: written whole or not at all, and read back for `add`."""

import os
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...discovery.candidates.effect_forces import found_forces
from ...exports.mcap_series import Prediction, require_mcap, write_series
from ...measurements.inspection import inspect_log
from ...measurements.preparation.standardisation import Standardisation
from ...physics.errors import RequestError, expect
from ...physics.files import write_json, write_text
from ...physics.folders import finish, replace_folder
from ...physics.printable import shown
from ...physics.reading import read_json
from ...physics.vehicle import Vehicle, load_vehicle
from ...reports.page.page import write_page
from ...residuals.models.neural import is_network_folder
from ..discover_and_add import Run, Say
from .provenance import command, log_digests, seen_from, versions
from .run_files import DATA, PAGE, PDF, RUN_FILES, RUN_SCHEMA, own_run, seal
from .targets import check_target_folder

INSPECTIONS_SCHEMA = "undertow.inspections/1"


def check_target(
    out: str | os.PathLike[str], reads: Iterable[Any] = (), *, report: bool = True, force: bool = False
) -> Path:
    """The run folder's path, if it can be written and nothing of the user's be lost.

    Parameters
    ----------
    reads : logs, vehicle, map: what the run is made from
    report : whether the page is written, too
    force : replace also what undertow did not write

    Raises
    ------
    RequestError
        see `targets.check_target_folder`.
    """
    expect("write_run: out", out, (str, os.PathLike), "give the path of a folder")
    target = Path(out)
    new = {name for name in RUN_FILES if name != PDF and (report or name != PAGE)}
    check_target_folder("--out", target, new, own_run, reads, force=force)
    return target


def write_run(
    run: Run,
    out: str | os.PathLike[str],
    *,
    report: bool = True,
    progress: Say | None = None,
    force: bool = False,
) -> Path:
    """Write the run folder: built under a temporary name, then renamed, so it appears whole; see `replace_folder`.

    An earlier run in the same folder is replaced; other files in it stay. When anything fails, or the user interrupts,
    the temporary folder goes and the earlier run is as it was.

    Parameters
    ----------
    report : False to leave the HTML page out
    progress : called with a line when `series.mcap` is left out, for want of the extra `logs`; a warning without it
    force : replace also files that undertow did not write, or that were changed since

    Raises
    ------
    RequestError
        when the target cannot be written; see `check_target`.
    """
    expect("write_run: run", run, Run, "undertow.discover(INPUTS) and undertow.add(EFFECTS, INPUTS) make one")
    read = run.inputs
    target = check_target(out, (read.paths, read.channel_map), report=report, force=force)
    say = progress or _warn

    def build(work: Path) -> list[str]:
        _write_files(run, work, target)
        _write_viewer_series(run, work / "series.mcap", say)
        seal(work, _record(run, target), DATA)
        if report:
            write_page(work)
        return os.listdir(work)

    try:
        replace_folder(target, build, own_run, force=force)
    except OSError as error:
        raise RequestError(f"cannot write the run to {target}: {error.strerror or error}") from None
    return target


def _write_files(run: Run, folder: Path, target: Path) -> None:
    write_json(folder / "findings.json", run.findings.to_dict())
    write_json(folder / "comparison.json", run.comparison.to_dict())
    write_json(folder / "audit.json", run.audit.to_dict())
    run.discovery.nominal.save(folder / "nominal.yaml")
    run.discovery.corrected.save(folder / "model.yaml")
    write_text(folder / "series.csv", run.series.to_csv(index=False, lineterminator="\n"))
    Standardisation.fit(run.inputs.parts.split.train.motions).write(folder / "standardisation.json")
    inspections = [inspect_log(log, run.inputs.vehicle).to_dict() for log in run.inputs.logs]
    write_json(folder / "inspection.json", {"schema": INSPECTIONS_SCHEMA, "logs": inspections})


def _record(run: Run, target: Path) -> dict[str, Any]:
    """What the run was made from, as `run.json` has it."""
    paths, read = list(run.inputs.paths), run.inputs
    mapped = None if read.channel_map is None else seen_from(target, str(read.channel_map))
    how = {"frame": read.frame, "channel_map": read.channel_map, "namespace": read.namespace, "as_is": read.as_is}
    there, seen = {**how, "channel_map": mapped}, [seen_from(target, path) for path in paths]
    return {
        "schema": RUN_SCHEMA,
        "logs": paths,
        **how,
        "seed": run.settings.seed,
        "refit": run.settings.refit,
        "judged_on": run.inputs.parts.judge,
        "command": command(run.verb, seen, seed=run.settings.seed, refit=run.settings.refit, **there),
        "versions": versions(),
        "log_sha256": log_digests(paths),
    }


def _write_viewer_series(run: Run, path: Path, say: Say) -> None:
    """The series for viewers, or a line on why there is none."""
    try:
        require_mcap()
    except RequestError as error:
        say(f"{path.name} is left out: {error}")
        return
    found, parts = run.discovery, run.inputs.parts
    forces = found_forces(found.nominal, found.corrected, parts, [label for label, _ in found.steps])
    told = (
        Prediction("before", found.nominal, run.series, "before"),
        Prediction("after", found.corrected, run.series, "after", forces),
    )
    write_series(path, told, run.inputs.channels, parts, run.inputs.starts)


def _warn(line: str) -> None:
    warnings.warn(line, stacklevel=6)


@dataclass(frozen=True, slots=True)
class RunRecord:
    """What a run was made from: paths of the logs, how they were read (`as_is`: though broken), and the vehicle."""

    logs: list[str]
    frame: str | None
    channel_map: Path | None
    namespace: str | None
    vehicle: Vehicle
    as_is: bool = False


def read_run_inputs(run: str | os.PathLike[str]) -> RunRecord:
    """What a run folder was made from.

    Raises
    ------
    RequestError
        when the folder is not a run folder, or its logs are not where they were.
    VehicleError
        when its nominal vehicle cannot be read.
    """
    folder = Path(run)
    finish(folder)
    if is_network_folder(folder):
        raise RequestError(
            f"{folder} is the folder of a trained network, not of a run: effects are added to a vehicle; give a folder "
            "that 'undertow discover' wrote, or --vehicle V and the LOG after the effects. 'undertow explain' says "
            "what of the network is a named effect"
        )
    try:
        record = read_json(folder / "run.json")
        logs, frame, channel_map = record["logs"], record["frame"], record["channel_map"]
        namespace = record.get("namespace")  # a run of an earlier version has none
    except (OSError, ValueError, KeyError, TypeError):
        raise RequestError(
            f"{folder} is not a run folder (no readable run.json in it); write one with "
            "'undertow discover LOG --vehicle V --out RUN'"
        ) from None
    how = [text for text in (frame, channel_map, namespace) if text is not None]
    texts = [*logs, *how] if isinstance(logs, list) else [logs]
    if not isinstance(logs, list) or not logs or not all(isinstance(text, str) for text in texts):
        raise RequestError(
            f"{folder / 'run.json'}: expected paths under 'logs', a text or null under 'frame', 'channel_map' and "
            f"'namespace', got {shown(logs)}, {shown(frame)}, {shown(channel_map)}, {shown(namespace)}; run "
            "'undertow discover' to write the folder anew"
        )
    for path in logs:
        if not Path(path).exists():
            raise RequestError(
                f"{folder} was made from {path}, which is not there (seen from {Path.cwd()}); run this where "
                "'undertow discover' was run, or put the log back"
            )
    mapped = None if channel_map is None else Path(channel_map)
    as_is = record.get("as_is") is True
    return RunRecord(logs, frame, mapped, namespace, load_vehicle(folder / "nominal.yaml"), as_is)
