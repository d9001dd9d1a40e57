"""The verb `merge`: fleets joined in a new one."""

from pathlib import Path
from typing import Annotated

import typer

from .console import say
from .fleet_verb import FleetOut, size_of
from .options import ForceOption


def merge(
    fleets: Annotated[list[Path], typer.Argument(metavar="FLEET...", help="Folders that 'undertow fleet' made.")],
    out: FleetOut,
    force: ForceOption = False,
) -> None:
    """Join fleets in one folder; a log that is in several is there once."""
    from ..fleet.fleet_folder import merge_fleets

    merged = merge_fleets(fleets, out, force=force)
    say(f"{out}: {size_of(merged)}")
