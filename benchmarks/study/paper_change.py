"""How many times another model's error a model errs over the seeds of a study, with its interval and verdict."""

import numpy as np

from undertow.measurements.statistics.quantiles import student
from undertow.physics.frames import Array
from undertow.physics.in_words import MINUS


class Change:
    """An error in that of another model: the geometric mean over the seeds, and its 95 % interval (Student's t).

    Attributes
    ----------
    seeds : how many
    mean, low, high : of the ratio, 1 where both err the same; NaN where too few seeds tell
    """

    def __init__(self, logarithms: Array) -> None:
        self.seeds, nothing = len(logarithms), float("nan")
        middle = float(logarithms.mean()) if self.seeds else nothing
        half = nothing
        if self.seeds > 1:
            half = student(self.seeds - 1, 0.975) * float(logarithms.std(ddof=1)) / np.sqrt(self.seeds)
        self.mean, self.low, self.high = (float(np.exp(x)) for x in (middle, middle - half, middle + half))

    @property
    def verdict(self) -> str:
        """Whether the error is less, more, or cannot be told apart over the seeds."""
        if not self.seeds:
            return "not run"
        if not np.isfinite(self.low):
            return "one seed"
        return "less error" if self.high < 1.0 else "more error" if self.low > 1.0 else "no difference"

    def __str__(self) -> str:
        if not self.seeds:
            return "n/a"
        mean, low, high = (f"{100 * (x - 1.0):+.0f}" for x in (self.mean, self.low, self.high))
        ends = f" ({low} to {high})" if np.isfinite(self.low) else ""
        return f"{mean} %{ends}".replace("-", MINUS)
