"""The relative change of an error over the seeds of a study, with its interval and verdict."""

import numpy as np

from undertow.measurements.statistics.quantiles import student
from undertow.physics.frames import Array
from undertow.physics.in_words import MINUS


class Change:
    """The relative change of an error over the seeds, with its 95 % interval (Student's t); minus is less error."""

    def __init__(self, gain: Array) -> None:
        self.values = -np.asarray(gain, dtype=float)
        self.mean = float(self.values.mean()) if self.values.size else float("nan")
        spread = self.values.std(ddof=1) / np.sqrt(self.values.size) if self.values.size > 1 else float("nan")
        half = student(self.values.size - 1, 0.975) * float(spread) if self.values.size > 1 else float("nan")
        self.low, self.high = self.mean - half, self.mean + half

    @property
    def verdict(self) -> str:
        """Whether the error is less, more, or cannot be told apart over the seeds."""
        if not self.values.size:
            return "not run"
        if not np.isfinite(self.low):
            return "one seed"
        return "less error" if self.high < 0.0 else "more error" if self.low > 0.0 else "no difference"

    def __str__(self) -> str:
        if not self.values.size:
            return "n/a"
        ends = f" ({100 * self.low:+.0f} to {100 * self.high:+.0f})" if np.isfinite(self.low) else ""
        return f"{100 * self.mean:+.0f} %{ends}".replace("-", MINUS)
