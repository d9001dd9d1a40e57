"""Scores on held-out data: one-step acceleration errors and open-loop rollout errors, by axis."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..measurements.dataset import DataSet
from ..measurements.derive import accelerations
from ..physics.frames import AXES, Array
from ..physics.simulation import SPEED_LIMIT
from .models import Model
from .residual import same_filter

HORIZONS = (2.0, 10.0, 30.0)
"""Rollout lengths [s]."""
SPACING = 0.5
"""Distance between rollout starts [s]."""


@dataclass(frozen=True, slots=True)
class AccelerationScore:
    """One-step errors on a data set: rmse, mae [m/s^2, m/s^2, rad/s^2] and r2 [1], each (3,)."""

    rmse: Array
    mae: Array
    r2: Array

    def to_dict(self) -> dict[str, dict[str, float]]:
        """As `comparison.json` writes it, by axis."""
        return {name: by_axis(getattr(self, name)) for name in ("rmse", "mae", "r2")}


@dataclass(frozen=True, slots=True)
class RolloutScore:
    """Open-loop errors over one horizon: velocity rmse (3,) [m/s, m/s, rad/s], position rmse [m], counts.

    The root mean square runs over all rows of all rollouts; a diverged one counts with its clipped speeds.
    """

    velocity: Array
    position: float
    diverged: int
    starts: int

    def to_dict(self) -> dict[str, float]:
        """As `comparison.json` writes it."""
        return {**by_axis(self.velocity), "position": self.position, "diverged": self.diverged, "starts": self.starts}


def by_axis(values: Array) -> dict[str, float]:
    """Three numbers as a mapping by axis name."""
    return {axis: float(value) for axis, value in zip(AXES, values, strict=True)}


def acceleration_score(model: Model, data: DataSet) -> AccelerationScore:
    """One-step score of a model: measured central differences against the model, both filtered alike.

    r2 is 1 - (sum of squared errors) / (sum of squares about the mean), on each axis; NaN with nothing to explain.
    """
    measured = np.concatenate([accelerations(motion) for motion in data.motions])
    modelled = np.concatenate([same_filter(model.acceleration(motion), motion, data) for motion in data.motions])
    error = measured - modelled
    spread = ((measured - measured.mean(axis=0)) ** 2).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        r2 = np.where(spread > 0, 1.0 - (error**2).sum(axis=0) / spread, np.nan)
    return AccelerationScore(np.sqrt((error**2).mean(axis=0)), np.abs(error).mean(axis=0), r2)


def rollout_scores(
    model: Model, data: DataSet, horizons: Sequence[float] = HORIZONS, spacing: float = SPACING
) -> Mapping[str, RolloutScore]:
    """Open-loop scores of a model by horizon [s]; a horizon longer than every motion is left out.

    Every start has room for its own horizon; one integration of the longest horizon serves the shorter ones.
    """
    squares: dict[str, list[Array]] = {}
    lost: dict[str, int] = {}
    for motion in data.motions:
        step = motion.time_step
        truth = np.column_stack([motion.position, motion.heading, motion.velocity])
        lengths = {f"{h:g}": round(h / step) for h in horizons if round(h / step) < motion.time.size}
        if not lengths:
            continue
        every = max(1, round(spacing / step))
        counted: set[int] = set()
        for steps in sorted(set(lengths.values()), reverse=True):
            starts = np.array([s for s in range(0, motion.time.size - steps, every) if s not in counted])
            counted.update(starts.tolist())
            if starts.size == 0:
                continue
            result = model.rollout(motion, starts, steps)
            window = starts[:, None] + np.arange(steps + 1)
            error = result.states - truth[window]
            per_row = np.concatenate([error[..., 3:] ** 2, (error[..., :2] ** 2).sum(axis=-1, keepdims=True)], axis=-1)
            for name, length in lengths.items():
                if length <= steps:
                    squares.setdefault(name, []).append(per_row[:, 1 : length + 1].mean(axis=1))
                    speeds = np.abs(result.states[:, 1 : length + 1, 3:]).max(axis=(1, 2))
                    lost[name] = lost.get(name, 0) + int((speeds >= SPEED_LIMIT).sum())
    scores = {}
    for name in (f"{h:g}" for h in horizons):
        if name in squares:
            stacked = np.concatenate(squares[name])
            root = np.sqrt(stacked.mean(axis=0))
            scores[name] = RolloutScore(root[:3], float(root[3]), lost[name], stacked.shape[0])
    return scores
