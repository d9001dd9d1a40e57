"""Progress of reading a large log: a bar in bytes on a terminal, a plain line now and then elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LARGE = 50_000_000
"""Bytes from which a log's reading is worth a line, where there is no terminal: it takes some seconds."""
EVERY = 5.0
"""Seconds between plain lines: often enough to see that it goes on, seldom enough for the log of a batch job."""


@contextmanager
def reading_progress(say: Callable[[str], None], quiet: bool = False) -> Iterator[Callable[[int, int], None]]:
    """A function that shows bytes done and bytes in all: in a bar on stderr where that is a terminal, else by `say`.

    By `say`, too, where `quiet` says that nobody wants a bar.
    """
    if quiet or not sys.stderr.isatty():
        yield _lines(say)
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


def _lines(say: Callable[[str], None]) -> Callable[[int, int], None]:
    last = time.monotonic()

    def told(done: int, total: int) -> None:
        nonlocal last
        if total >= LARGE and done < total and time.monotonic() - last > EVERY:
            last = time.monotonic()
            say(f"read {done / 1e6:.0f} of {total / 1e6:.0f} MB")

    return told
