"""The verb `export`: a model in the format of a simulator, a controller, an autopilot, a language or a paper."""

from pathlib import Path
from typing import Annotated

import typer

from .console import prose, say, tell_replaced
from .options import ForceOption, earlier_files


def formats() -> str:
    """What `--to` takes; files are counted and none is loaded, as this stands below every help."""
    from ..exports.formats.base import names_with_aliases

    return f"Formats: {names_with_aliases()}. docs/howto/export.md says what each is."


def export(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="Vehicle file, or run folder: its corrected model.")],
    to: Annotated[str, typer.Option("--to", metavar="FORMAT", help="Format, see below.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="File to write, named after MODEL if left out; some formats write two."),
    ] = None,
    time_step: Annotated[float, typer.Option("--time-step", help="Of the step function, in seconds.")] = 0.05,
    gz: Annotated[str, typer.Option("--gz", help="sdf: garden, for Gazebo Garden and later, or fortress.")] = "garden",
    added_mass: Annotated[
        str, typer.Option("--added-mass", help="sdf: plugin, or inertial (SDF 1.10, Gazebo Garden and later).")
    ] = "plugin",
    force: ForceOption = False,
) -> None:
    """Write a model in the format of another tool, with its envelope, audit, intervals and sources inside."""
    from ..exports.formats.base import Choices
    from ..workflows.export import export as write
    from ..workflows.export import named_after

    target = out or named_after(model, to)
    earlier = earlier_files((("--out", "export", target),), (model,), force=force)
    done = write(model, to, target, Choices(time_step, gz, added_mass), force=force)
    tell_replaced(earlier)
    say(f"{to}: {', '.join(map(str, done.files))}")
    if done.facts.found:
        prose(f"Found: {done.facts.found}")
    prose(f"Audit: {done.facts.audit[0]} {done.facts.envelope_sentence}")
    for each in done.facts.left_out:
        prose(f"Not expressed: {each}")
