"""The verb `cluster`: a Dask cluster on this machine, to try what a real one does."""

import time

from .console import say
from .options import option

_HOUR = 3600.0
"""Seconds of a sleep, from which a signal wakes."""


def cluster(
    workers: int | None = option("--workers", "Processes; default: as many as the machine has processors.", min=1),
) -> None:
    """Start a Dask cluster on this machine alone, and say where; it ends with Ctrl-C."""
    from ..fleet.workers import local_cluster

    with local_cluster(workers) as address:
        say(f"{address}")
        say(f"  undertow fleet LOG... --vehicle V --out FOLDER --scheduler {address}")
        while True:
            time.sleep(_HOUR)
