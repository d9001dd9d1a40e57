"""Progress of a training: a bar on a terminal, a plain line every few epochs elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...residuals.training.history import Epoch

EVERY = 10
"""Epochs between plain lines: thirty for a training of the usual 300."""


@contextmanager
def training_progress(
    epochs: int, say: Callable[[str], None], quiet: bool = False
) -> "Iterator[Callable[[Epoch], None]]":
    """A function that shows an epoch: in a bar on stderr where that is a terminal, else through `say`.

    Through `say`, too, where `quiet` says that nobody wants a bar.
    """
    if quiet or not sys.stderr.isatty():

        def told(epoch: "Epoch") -> None:
            if epoch.number == 1 or epoch.number % EVERY == 0:
                say(f"epoch {epoch.number} of at most {epochs}: {epoch_words(epoch)}")

        yield told
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("epoch"),
        MofNCompleteColumn(),
        BarColumn(20),
        TimeElapsedColumn(),
        TextColumn("{task.fields[words]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("training", total=epochs, words="")

        def drawn(epoch: "Epoch") -> None:
            bar.update(task, completed=epoch.number, words=epoch_words(epoch))

        yield drawn


def epoch_words(epoch: "Epoch") -> str:
    """Loss, validation error and violating share of an epoch."""
    loss = "none" if epoch.loss is None else f"{epoch.loss:.3g}"
    return f"loss {loss}, validation error {epoch.rmse:.3f}, breaks the laws at {100 * epoch.violating:.1f} %"
