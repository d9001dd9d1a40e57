"""Progress of reading a large log: a bar in bytes on a terminal, a plain line now and then elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .pace import Pace

_MEGABYTE = 1e6
"""[B], in which lines tell of bytes."""


@contextmanager
def reading_progress(say: Callable[[str], None], quiet: bool = False) -> Iterator[Callable[[int, int], None]]:
    """A function that shows bytes done and bytes in all: in a bar on stderr where that is a terminal, else by `say`.

    By `say`, too, where `quiet` says that nobody wants a bar.
    """
    if quiet or not sys.stderr.isatty():
        pace = Pace(say, "reading", " MB")
        yield lambda done, total: pace.told(done / _MEGABYTE, total / _MEGABYTE)
        return
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn, TransferSpeedColumn

    columns = (
        TextColumn("reading"),
        BarColumn(20),
        DownloadColumn(),
        TransferSpeedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading", total=None, visible=False)

        def drawn(done: int, total: int) -> None:
            # A new log starts the bar anew; a small one is read before a bar could be seen.
            bar.update(task, completed=done, total=total, visible=done < total)

        yield drawn
