"""The verb `check`: judge any model by the laws of a hull in water; exit code 1 when it breaks one."""

from pathlib import Path

import typer

from ..measurements.log_options import Reading
from .console import print_json, progress, prose, say_written, show, tell_replaced
from .options import FORCE, JSON, PLAIN_READING, RUN_LOGS, SEED, argument, check_files, option


def check(
    model: str = argument(
        "MODEL",
        "Vehicle file, run folder, network, ONNX file, or package.module:function (imported): "
        "f(velocity (n, 3), heading (n,), commands (n, thrusters)) -> accelerations (n, 3).",
    ),
    logs: list[Path] | None = argument(
        "[LOG]...", "Logs whose speeds are the envelope; a run folder has its own.", None
    ),
    vehicle: str | None = option("--vehicle -v", "Vehicle of a model that carries none (ONNX, function)."),
    out: Path | None = option("--out -o", "audit.json to write."),
    log: list[Path] | None = RUN_LOGS,
    force: bool = FORCE,
    seed: int = SEED,
    reading: Reading = PLAIN_READING,
    as_json: bool = JSON,
) -> None:
    """Judge any model by the laws of a hull in water; exit code 1 when it breaks one."""
    from ..physics.files import write_json
    from ..workflows.check_and_explain import check as judge
    from ..workflows.run_folder.moved_files import Moved

    earlier = check_files((("--out", "check", out),), (model, logs, log, vehicle, reading.channel_map), force=force)
    moved = Moved(tuple(log or ()), None if logs else reading.channel_map)
    found = judge(model, logs or [], vehicle, reading, moved=moved, seed=seed, progress=progress)
    if out is not None:
        write_json(out, found.to_dict())
    tell_replaced(earlier)
    if as_json:
        print_json(found.to_dict())
    else:
        from ..reports.terminal.laws_and_effects_screen import audit_screen, headline
        from ..reports.terminal.layout import BAD, GOOD

        prose(headline(found), BAD if found.verdict == "fail" else GOOD)
        show(*audit_screen(found))
        say_written({"Audit": out})
    if found.verdict == "fail":
        raise typer.Exit(1)
