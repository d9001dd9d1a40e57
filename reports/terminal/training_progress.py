"""Progress of a training: in the bar on a terminal, a plain line every few epochs elsewhere."""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from ...physics.stage import Say
from .progress import Progress

if TYPE_CHECKING:
    from ...residuals.training.history import Epoch

EVERY = 10
"""Epochs between plain lines: thirty for a training of the usual 300."""


def epochs_told(epochs: int, say: Say | None) -> "Callable[[Epoch], None]":
    """A function that tells of an epoch; the time left is that of all epochs, which a training seldom needs."""
    begun, first = time.monotonic(), [0]

    def told(epoch: "Epoch") -> None:
        first[0] = first[0] or epoch.number  # of a training that is resumed, not 1
        of = f" of at most {epochs}" if epoch.number <= epochs else ", at states against the laws"
        line = f"epoch {epoch.number}{of}: {epoch_words(epoch)}"
        done = epoch.number - first[0] + 1
        left = (time.monotonic() - begun) * (epochs - epoch.number) / done if done > 1 else math.nan
        if isinstance(say, Progress) and say.counted(line, epoch.number / epochs, left, whole=True):
            return
        if say is not None and (epoch.number == 1 or epoch.number % EVERY == 0):
            say(line)

    return told


def epoch_words(epoch: "Epoch") -> str:
    """Loss, validation error and violating share of an epoch."""
    loss = "none" if epoch.loss is None else f"{epoch.loss:.3g}"
    return f"loss {loss}, validation error {epoch.rmse:.3f}, breaks the laws at {100 * epoch.violating:.1f} %"
