"""The verb `compare`: compare models with measurements on the same rows: which to trust, by how much."""

from pathlib import Path
from typing import Annotated

import typer

from ..measurements.log_options import AS_GUESSED
from .console import print_json, progress, say, show, tell_replaced, warn
from .options import ForceOption, JsonOption, Logs, ReadingOptions, VehicleOption, earlier_files, read_logs


def compare(
    logs: Logs,
    vehicle: VehicleOption,
    model: Annotated[
        list[Path] | None,
        typer.Option(
            "--model", help="Vehicle file, run folder, network, ONNX file, or package.module:function (imported)."
        ),
    ] = None,
    judge: Annotated[
        str | None,
        typer.Option(
            "--split",
            help="Rows to judge on: test, validation, train or all; all of a log that a model was not fitted to, else "
            "test.",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="comparison.json to write.")] = None,
    series: Annotated[
        Path | None, typer.Option("--series", help="MCAP file to write, for Foxglove or PlotJuggler.")
    ] = None,
    page: Annotated[
        Path | None, typer.Option("--page", help="Folder to write: report.html, and what it is made of.")
    ] = None,
    force: ForceOption = False,
    reading: ReadingOptions = AS_GUESSED,
    as_json: JsonOption = False,
) -> None:
    """Compare models with measurements on the same rows: which to trust, by how much, and where they fail."""
    from ..physics.files import write_json
    from ..workflows.compare import compare as compare_models
    from ..workflows.run_folder.run_files import check_page

    targets = (("--out", "compare", out), ("--series", "compare --series", series))
    reads = (logs, vehicle, reading.channel_map, model)
    earlier = earlier_files(targets, reads, force=force)
    if page is not None:
        check_page(page, reads, force=force)
    inputs = read_logs(logs, vehicle, reading, judge)
    found = compare_models(inputs, model or [], series, page=page, force=force, progress=progress)
    if out is not None:
        write_json(out, found.to_dict())
    tell_replaced(earlier)
    if as_json:
        print_json(found.to_dict())
    else:
        from ..reports.terminal.comparison_screen import (
            best_text,
            comparison_table,
            failures_table,
            notes_list,
            structure_list,
        )
        from ..reports.wording import models_sentence

        warn(found.warnings)
        table = comparison_table(found.models, found.split, found.differences)
        show(best_text(found), table, failures_table(found.failures, models_sentence(found.models, found.structure)))
        show(structure_list(found.structure), notes_list(found))
        if out is not None:
            say(f"Comparison: {out}")
        if page is not None:
            say(f"Page: {page / 'report.html'}")
        if series is not None:
            say(f"Series for Foxglove and PlotJuggler: {series}")
