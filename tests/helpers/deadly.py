"""Tasks that take their worker with them, in a file that a worker can import."""

import os
import signal
from pathlib import Path


def squared(task: tuple[str, int]) -> int:
    """The square of a number: three kills its worker each time, five the first time only."""
    folder, number = task
    if number == 3 or (number == 5 and not Path(folder, "died").exists()):
        if number == 5:
            Path(folder, "died").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number
