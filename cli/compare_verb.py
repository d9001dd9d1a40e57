"""The verb `compare`: compare models with measurements on the same rows: which to trust, by how much."""

from pathlib import Path

from ..measurements.log_options import Reading
from .console import print_json, progress, say_written, show, tell_replaced, warn
from .options import FORCE, JSON, LOGS, READING, VEHICLE, check_files, option, read_logs


def compare(
    logs: list[Path] = LOGS,
    vehicle: str = VEHICLE,
    model: list[Path] | None = option(
        "--model", "Vehicle file, run folder, network, ONNX file, or package.module:function (imported)."
    ),
    judge: str | None = option(
        "--split",
        "Rows to judge on: test, validation, train or all; all of a log that a model was not fitted to, else test.",
    ),
    out: Path | None = option("--out -o", "comparison.json to write."),
    series: Path | None = option("--series", "MCAP file to write, for Foxglove or PlotJuggler."),
    page: Path | None = option("--page", "Folder to write: report.html, and what it is made of."),
    force: bool = FORCE,
    reading: Reading = READING,
    as_json: bool = JSON,
) -> None:
    """Compare models with measurements on the same rows: which to trust, by how much, and where they fail."""
    from ..physics.files import write_json
    from ..workflows.compare import compare as compare_models
    from ..workflows.run_folder.run_files import check_page

    targets = (("--out", "compare", out), ("--series", "compare --series", series))
    reads = (logs, vehicle, reading.channel_map, model)
    earlier = check_files(targets, reads, force=force)
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
        from ..reports.terminal import comparison_screen as screen
        from ..reports.wording import models_sentence

        warn(found.warnings)
        failures = screen.failures_table(found.failures, models_sentence(found.models, found.structure))
        table = screen.comparison_table(found.models, found.split, found.differences)
        show(screen.best_text(found), table, failures)
        show(screen.structure_list(found.structure), screen.notes_list(found))
        report = None if page is None else page / "report.html"
        say_written({"Comparison": out, "Page": report, "Series for Foxglove and PlotJuggler": series})
