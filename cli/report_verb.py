"""The verb `report`: write the HTML page of run folders, one page of several, and PDF."""

from pathlib import Path

from .console import progress, say
from .options import FORCE, RUN_LOGS, argument, option


def report(
    runs: list[Path] = argument(
        "RUN...", "Run folders, several give a page for all, too; or what compare --page wrote."
    ),
    model: list[str] | None = option("--model", "Model to compare with the run's own; as in compare."),
    pdf: bool = option("--pdf", "Print every page to a PDF, through a browser that is there.", False),
    out: Path | None = option("--out -o", "Page of several runs (./report.html), or a copy of the one."),
    log: list[Path] | None = RUN_LOGS,
    channels: Path | None = option("--map", "Where the channel map of the run is now, if it was moved."),
    force: bool = FORCE,
) -> None:
    """Write the HTML page of run folders, one page of several, and PDF."""
    from ..workflows.report import report as report_runs
    from ..workflows.run_folder.moved_files import Moved

    moved = Moved(tuple(log or ()), channels)
    models = model or []
    done = report_runs(runs, models=models, pdf=pdf, out=out, moved=moved, force=force, progress=progress)
    for path in done:
        say(f"{path}")
