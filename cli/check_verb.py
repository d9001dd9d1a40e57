"""The verb `check`: judge any model by the laws of a hull in water; exit code 1 when it breaks one."""

from pathlib import Path
from typing import Annotated

import typer

from ..measurements.log_options import AS_GUESSED
from .console import print_json, progress, prose, say, show, tell_replaced
from .options import ForceOption, JsonOption, PlainReading, RunLogs, SeedOption, earlier_files


def check(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="Vehicle file, run folder, network, ONNX file, or package.module:function (imported): "
            "f(velocity (n, 3), heading (n,), commands (n, thrusters)) -> accelerations (n, 3).",
        ),
    ],
    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[LOG]...", help="Logs whose speeds are the envelope; a run folder has its own."),
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option("--vehicle", "-v", help="Vehicle of a model that carries none (ONNX, function).")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="audit.json to write.")] = None,
    log: RunLogs = None,
    force: ForceOption = False,
    seed: SeedOption = 0,
    reading: PlainReading = AS_GUESSED,
    as_json: JsonOption = False,
) -> None:
    """Judge any model by the laws of a hull in water; exit code 1 when it breaks one."""
    from ..physics.files import write_json
    from ..workflows.check_and_explain import check as judge
    from ..workflows.run_folder.moved_files import Moved

    earlier = earlier_files((("--out", "check", out),), (model, logs, log, vehicle, reading.channel_map), force=force)
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
        if out is not None:
            say(f"Audit: {out}")
    if found.verdict == "fail":
        raise typer.Exit(1)
