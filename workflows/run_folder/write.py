"""Writing of a run folder or of a comparison: a finished job, whole or not at all."""

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...comparison.audit import Audit
from ...comparison.facts import Comparison
from ...discovery.basis import DiscoverySettings
from ...discovery.candidates.candidate import holds_guesses
from ...discovery.candidates.linearisation import step_forces
from ...discovery.discover import Discovery
from ...discovery.findings import Findings
from ...exports.mcap_series import Prediction, mcap_installed, write_series
from ...exports.viewer_layouts import views, write_layouts
from ...measurements.formats.registry import log_digests
from ...measurements.inspection import Inspections
from ...measurements.preparation.resampling import Standardisation
from ...measurements.prepared_logs import Inputs
from ...measurements.statistics.processors import run_in_fork
from ...physics.errors import expect
from ...physics.files import write_json, write_text, writing
from ...physics.presentation import Card
from ...physics.stage import WRITING, Say, Stage, trim_memory
from ...physics.vehicle import Vehicle
from ...reports.terminal.progress import SHOWN, Pace, showing
from ...residuals.series import SeriesTable
from . import run_files
from .moved_files import command, seen_from, versions
from .read import read_comparison, read_run

if TYPE_CHECKING:
    import pandas as pd

    from ...reports.page.figures.plots import Plots


@dataclass(frozen=True, slots=True, repr=False)
class Run(Card):
    """A finished main job, before it is written.

    `audit` is of the corrected model, `verb` what asked for the run, `calibrated` the nominal model with its own
    numbers fitted, where it could be fitted.
    """

    inputs: Inputs
    discovery: Discovery
    findings: Findings
    comparison: Comparison
    table: SeriesTable
    settings: DiscoverySettings
    audit: Audit
    verb: tuple[str, ...] = ("discover",)
    calibrated: Vehicle | None = None

    @property
    def series(self) -> "pd.DataFrame":
        """Measured and predicted motion, as `series.csv` holds it: SI units, one row per time step (10 Hz)."""
        return self.table.frame()

    @property
    def plot(self) -> "Plots":
        """Plots of the run, as matplotlib axes."""
        from ...reports.page.figures.plots import Plots

        ends = self.discovery.nominal, self.discovery.corrected
        return Plots(self.findings, self.series, *ends, self.comparison.best.horizon)

    def drawings(self) -> Mapping[str, str]:
        """See `Card`."""
        from ...reports.page.figures.plots import of_run

        return of_run(self.findings, self.series, self.discovery.nominal)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        both = dict.fromkeys([*self.findings.card(), *self.comparison.card()])  # the same warnings once
        return [("logs", self.inputs.log_names), *both]


_NAMING = ("findings.json", "comparison.json", "audit.json", "inspection.json", "model.yaml", "nominal.yaml")
"""Files that tell of logs by their names."""


@showing
def write_run(
    run: Run,
    out: str | os.PathLike[str],
    *,
    report: bool = True,
    progress: Say | None = SHOWN,
    force: bool = False,
    called: Callable[[str], str] = str,
) -> Path:
    """Write the run folder: built under a temporary name, then renamed, so it appears whole; see `replace_folder`.

    An earlier run in the same folder is replaced; other files in it stay. When anything fails, or the user interrupts,
    the temporary folder goes and the earlier run is as it was.

    Parameters
    ----------
    report : False to leave the HTML page out
    progress : called with lines about the work; shown where nothing is said; None for silence
    force : replace also files that undertow did not write, or that were changed since
    called : gives a text with the names by which its reader knows the logs, where they are kept under others; it puts
        nothing in it that has a meaning in JSON or YAML

    Raises
    ------
    RequestError
        when the target cannot be written; see `check_target`.
    """
    expect("write_run: run", run, Run, "undertow.discover(INPUTS) and undertow.add(EFFECTS, INPUTS) make one")
    read = run.inputs
    target = run_files.check_target(out, (read.paths, read.reading.channel_map), report=report, force=force)
    if progress is not None:
        progress(Stage("writing the run folder", WRITING))

    def build(work: Path) -> list[str]:
        with run_in_fork(partial(_write_viewer_series, run, work / "series.mcap", progress, called)) as written:
            _write_files(run, work, called)
            trim_memory()
            written()
        run_files.seal(work, json.loads(called(json.dumps(_record(run, target), ensure_ascii=False))), run_files.DATA)
        if report:
            trim_memory()
            write_page(work)
        return os.listdir(work)

    return run_files.write_folder("the run", target, build, run_files.own_run, force=force)


def _write_files(run: Run, folder: Path, called: Callable[[str], str]) -> None:
    inspections = Inspections(logs=run.inputs.inspections)
    records = {"findings": run.findings, "comparison": run.comparison, "audit": run.audit, "inspection": inspections}
    for name, record in records.items():
        write_json(folder / f"{name}.json", record.to_dict())
    run.discovery.nominal.save(folder / "nominal.yaml")
    run.discovery.corrected.save(folder / "model.yaml")
    with writing(folder / "series.csv") as stream:
        run.table.write(stream)
    Standardisation.fit(run.inputs.parts.known).write(folder / "standardisation.json")
    for name in _NAMING:
        text = (folder / name).read_text("utf-8")
        if called(text) != text:
            write_text(folder / name, called(text))


def write_comparison(
    found: Comparison, table: SeriesTable, inputs: Inputs, out: str | os.PathLike[str], *, force: bool = False
) -> Path:
    """Write the folder of a comparison, with its page; see `write_run`.

    Parameters
    ----------
    found : of which models
    table : the series of the two models of which it tells where they fail
    inputs : what it was made from
    out : the folder
    force : replace also files that undertow did not write, or that were changed since

    Raises
    ------
    RequestError
        when the folder cannot be written; see `check_page`.
    """
    target = run_files.check_page(out, (inputs.paths, inputs.reading.channel_map), force=force)

    def build(work: Path) -> list[str]:
        write_json(work / "comparison.json", found.to_dict())
        with writing(work / "series.csv") as stream:
            table.write(stream)
        run_files.seal(work, {**_made_from(inputs, target), "verb": run_files.COMPARE}, run_files.DATA)
        write_page(work)
        return os.listdir(work)

    return run_files.write_folder("the comparison", target, build, run_files.own_run, force=force)


def _record(run: Run, target: Path) -> dict[str, Any]:
    """What the run was made from, as `run.json` has it."""
    made, refit, seed = _made_from(run.inputs, target), bool(run.settings.refit), run.settings.seed
    seen = made["from_run"]
    reading = replace(run.inputs.reading, channel_map=seen["channel_map"])
    told = None if refit == holds_guesses(run.discovery.nominal) else refit
    again = command(run.verb, seen["logs"], reading, seed=seed, refit=told, judge=run.inputs.parts.judge)
    return {**made, "seed": seed, "refit": refit, "command": again}


def _made_from(inputs: Inputs, target: Path) -> dict[str, Any]:
    """The logs of a folder, how they were read and which rows judged, as `run.json` has it."""
    paths, reading = list(inputs.paths), inputs.reading
    mapped = None if reading.channel_map is None else os.fspath(reading.channel_map)
    # A log in memory has no file whose content could be known again.
    known = [digest if Path(path).exists() else None for path, digest in zip(paths, inputs.digests, strict=True)]
    return {
        "schema": run_files.RUN_SCHEMA,
        "logs": paths,
        **asdict(reading),
        "judged_on": inputs.parts.judge,
        "versions": versions(),
        "log_sha256": [{"path": path, "sha256": digest} for path, digest in zip(paths, known, strict=True)],
        "from_run": {
            "logs": [seen_from(target, path) for path in paths],
            "channel_map": None if mapped is None else seen_from(target, mapped),
        },
        "channel_map_sha256": None if mapped is None else log_digests([mapped])[0]["sha256"],
    }


def _write_viewer_series(run: Run, path: Path, progress: Say | None, called: Callable[[str], str]) -> None:
    """Write the series for viewers, and layouts that show it, where the extra `logs` is installed."""
    if not mcap_installed():
        return
    found, parts = run.discovery, run.inputs.parts
    forces = step_forces(found.nominal, found.corrected, parts, [label for label, _ in found.steps])
    before = Prediction("before", found.nominal, run.table, "before")
    after = Prediction("after", found.corrected, run.table, "after", forces)
    pace = Pace(progress, f"rows of {path.name}").told
    write_series(path, (before, after), run.inputs.channels, parts, run.inputs.starts, pace, called)
    logs = sorted(set(run.table["log"].tolist()))
    write_layouts(path.parent, path.name, views(logs, run.inputs.channels, forces))


def write_page(run: Path) -> Path:
    """Write `report.html` into a run folder, from the other files in it.

    Parameters
    ----------
    run : Path
        A folder with `findings.json`, `comparison.json`, `nominal.yaml`, `model.yaml`, `series.csv` and, where there is
        one, `inspection.json`; or that of a comparison.

    Returns
    -------
    Path
        The page: no script, no network, the same bytes for the same files.

    Raises
    ------
    RequestError
        When a file is missing, cannot be read, or is not of the expected schema; no page is written then.
    """
    return write_text(Path(run) / run_files.PAGE, page_of(Path(run)))


def page_of(folder: Path) -> str:
    """The HTML text of the page of a run folder, or of the folder of a comparison.

    Raises
    ------
    RequestError
        see `write_page`.
    """
    from ...reports.page.page import comparison_page, page

    return comparison_page(read_comparison(folder)) if run_files.is_comparison(folder) else page(read_run(folder))
