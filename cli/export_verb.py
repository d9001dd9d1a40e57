"""The verb `export`: a model in the format of a simulator, a controller, an autopilot, a language or a paper."""

from pathlib import Path

from .console import prose, say, tell_replaced
from .options import FORCE, REQUIRED, argument, check_files, option


def formats() -> str:
    """What `--to` takes; files are counted and none is loaded, as this stands below every help."""
    from ..exports.formats.base import names_with_aliases

    return f"Formats: {names_with_aliases()}. docs/howto/export.md says what each is."


def export(
    model: str = argument("MODEL", "Vehicle file, or run folder: its corrected model."),
    to: str = option("--to", "Format, see below.", REQUIRED, metavar="FORMAT"),
    out: Path | None = option("--out -o", "File to write, named after MODEL if left out; some formats write two."),
    time_step: float = option("--time-step", "Of the step function, in seconds.", 0.05),
    gz: str = option("--gz", "sdf: garden, for Gazebo Garden and later, or fortress.", "garden"),
    added_mass: str = option("--added-mass", "sdf: plugin, or inertial (SDF 1.10, Gazebo Garden and later).", "plugin"),
    force: bool = FORCE,
) -> None:
    """Write a model in the format of another tool, with its envelope, audit, intervals and sources inside."""
    from ..exports.formats.base import Choices
    from ..workflows.export import export as write
    from ..workflows.export import named_after

    target = out or named_after(model, to)
    earlier = check_files((("--out", "export", target),), (model,), force=force)
    done = write(model, to, target, Choices(time_step, gz, added_mass), force=force)
    tell_replaced(earlier)
    say(f"{to}: {', '.join(map(str, done.files))}")
    if done.facts.found:
        prose(f"Found: {done.facts.found}")
    prose(f"Audit: {done.facts.audit[0]} {done.facts.envelope_sentence}")
    for each in done.facts.left_out:
        prose(f"Not expressed: {each}")
