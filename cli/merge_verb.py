"""The verb `merge`: fleets joined in a new one."""

from pathlib import Path

from .console import say
from .fleet_verb import FLEET_OUT, size_of
from .options import FORCE, argument


def merge(
    fleets: list[Path] = argument("FLEET...", "Folders that 'undertow fleet' made."),
    out: Path = FLEET_OUT,
    force: bool = FORCE,
) -> None:
    """Join fleets in one folder; a log that is in several is there once."""
    from ..fleet.fleet_folder import merge_fleets

    merged = merge_fleets(fleets, out, force=force)
    say(f"{out}: {size_of(merged)}")
