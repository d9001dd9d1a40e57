"""The verb `control`: what a model is worth to the controller that steers the true boat with it."""

from pathlib import Path
from typing import Annotated

import typer

from .console import print_json, progress, say, show, tell_replaced
from .options import ForceOption, JsonOption, SeedOption


def control(
    models: Annotated[
        list[str],
        typer.Argument(metavar="MODEL...", help="Vehicle files, run folders, networks: what the controller knows."),
    ],
    true: Annotated[
        str | None, typer.Option("--true", help="Vehicle file of the true boat; default: that of the first model.")
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect", help="Effect that the true boat has beside, as simulate takes it: name=value[,value]."
        ),
    ] = None,
    track: Annotated[
        list[str] | None,
        typer.Option("--track", help="square, lawn-mower, eight, station or transients; may be repeated."),
    ] = None,
    controller: Annotated[
        str, typer.Option("--controller", help="los (line of sight and feed-forward) or nmpc (predictive control).")
    ] = "los",
    calm: Annotated[bool, typer.Option("--calm", help="No gusts, no current, exact sensors.")] = False,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Figure to write: .svg, all tracks.")] = None,
    force: ForceOption = False,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Steer the true boat along tracks with each model, and with the truth itself."""
    from ..physics.worlds.hidden_effects import parse_effects
    from ..reports.terminal.comparison_screen import control_tables
    from ..steering.closed_loop import Surroundings
    from ..workflows.control import Trial, check_figure
    from ..workflows.control import control as steer

    earlier = [] if out is None else check_figure(out, (models, true), force=force)
    around = Surroundings().calm if calm else Surroundings()
    trial = Trial(tuple(track or ("square",)), controller, around, seed)
    done = steer(models, true, parse_effects(effect or []), trial, progress=progress)
    if out is not None:
        done.draw(out, force=force)
    tell_replaced(earlier)
    if as_json:
        print_json(done.record.to_dict())
        return
    say("")
    hidden = ", ".join(done.record.hidden) or "nothing"
    say(f"True boat: {done.record.vehicle}; beside its file it has: {hidden}")
    show(control_tables(done.record))
    if out is not None:
        say(f"Figure: {out}")
