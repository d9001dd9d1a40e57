"""The verb `report`: write the HTML page of run folders, one page of several, and PDF."""

from pathlib import Path
from typing import Annotated

import typer

from .console import progress, say
from .options import ForceOption, RunLogs


def report(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...", help="Run folders, several give a page for all, too; or what compare --page wrote."
        ),
    ],
    model: Annotated[
        list[str] | None, typer.Option("--model", help="Model to compare with the run's own; as in compare.")
    ] = None,
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Print every page to a PDF, through a browser that is there.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Page of several runs (./report.html), or a copy of the one.")
    ] = None,
    log: RunLogs = None,
    channels: Annotated[
        Path | None, typer.Option("--map", help="Where the channel map of the run is now, if it was moved.")
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write the HTML page of run folders, one page of several, and PDF."""
    from ..workflows.report import report as report_runs
    from ..workflows.run_folder.moved_files import Moved

    moved = Moved(tuple(log or ()), channels)
    models = model or []
    done = report_runs(runs, models=models, pdf=pdf, out=out, moved=moved, force=force, progress=progress)
    for path in done:
        say(f"{path}")
