"""The verb `control`: what a model is worth to the controller that steers the true boat with it."""

from pathlib import Path

from .console import print_json, progress, say, say_written, show, tell_replaced
from .options import FORCE, JSON, SEED, argument, option


def control(
    models: list[str] = argument("MODEL...", "Vehicle files, run folders, networks: what the controller knows."),
    true: str | None = option("--true", "Vehicle file of the true boat; default: that of the first model."),
    effect: list[str] | None = option(
        "--effect", "Effect that the true boat has beside, as simulate takes it: name=value[,value]."
    ),
    track: list[str] | None = option("--track", "square, lawn-mower, eight, station or transients; may be repeated."),
    controller: str = option(
        "--controller", "los (line of sight and feed-forward) or nmpc (predictive control).", "los"
    ),
    calm: bool = option("--calm", "No gusts, no current, exact sensors.", False),
    out: Path | None = option("--out -o", "Figure to write: .svg, all tracks."),
    force: bool = FORCE,
    seed: int = SEED,
    as_json: bool = JSON,
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
    say_written({"Figure": out})
