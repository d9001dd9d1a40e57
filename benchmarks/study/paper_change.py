"""How many times another model's error a model errs over the seeds of a study, with its interval and verdict."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from undertow.measurements.statistics.blocks import student
from undertow.physics.motion import AXES, Array
from undertow.physics.presentation import MINUS

Records = Sequence[Mapping[str, Any]]


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


def values(records: Records, name: str, part: str, *keys: str) -> Array:
    """A figure of one model over all seeds, by the path of its keys, surge, sway and yaw: (seeds, 3)."""
    found = []
    for record in records:
        if record["name"] != name:
            continue
        inner: Any = record[part]
        for key in keys:
            inner = inner[key]
        found.append([float("nan") if inner[axis] is None else inner[axis] for axis in AXES])
    return np.array(found)


def relative(records: Records, name: str, other: str, part: str, *keys: str) -> Array:
    """Logarithm of a model's errors over another's, mean over the axes, for each seed that both have: 0 is equal."""
    seeds = [{r["seed"] for r in records if r["name"] == each} for each in (name, other)]
    both = [r for r in records if r["seed"] in seeds[0] & seeds[1]]
    mine, theirs = values(both, name, part, *keys), values(both, other, part, *keys)
    return np.log(mine / theirs).mean(axis=1) if mine.size else np.zeros(0)
