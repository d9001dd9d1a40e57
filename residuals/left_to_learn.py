"""How much of what a vehicle does not explain is more than the noise of the sensors: what there is to learn."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..measurements.preparation.dataset import DataSet
from ..measurements.preparation.derive import smooth
from ..measurements.statistics.white_noise import drawn_noise, sensor_noise
from ..physics.frames import AXES, Array
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .residual import residual

_DRAWS = 5
"""Times that noise is drawn anew: its own scatter then adds a tenth to that of the error."""
_SURE = 3.0
"""Standard deviations of its scatter by which a squared error must exceed the noise: by chance one axis in 700 does."""


@dataclass(frozen=True, slots=True, eq=False)
class Left:
    """What a vehicle leaves unexplained on some motions, root mean squares (3,) [m/s^2, m/s^2, rad/s^2].

    Attributes
    ----------
    measured : the acceleration
    error : of the vehicle's
    noise : of that error, by the sensors alone
    scatter : relative deviation of a mean square over these motions: their rows are filtered, and tell less than as
        many of their own
    """

    measured: Array
    error: Array
    noise: Array
    scatter: float

    @property
    def beyond(self) -> Array:
        """Root mean square of the error beyond the noise."""
        return np.sqrt(np.maximum(self.error**2 - self.noise**2, 0.0))

    @property
    def learnable(self) -> np.ndarray:
        """Whether the error is more than noise on each axis, by more than chance."""
        return self.error**2 > self.noise**2 * (1.0 + _SURE * self.scatter)

    def to_dict(self) -> dict[str, dict[str, float | bool]]:
        """By axis."""
        return {
            axis: {
                "measured": float(self.measured[k]),
                "error": float(self.error[k]),
                "noise": float(self.noise[k]),
                "learnable": bool(self.learnable[k]),
            }
            for k, axis in enumerate(AXES)
        }


def left_to_learn(vehicle: Vehicle, parts: Sequence[DataSet], seed: int = 0) -> Left:
    """What a vehicle leaves unexplained of the motions of parts that were prepared alike.

    The noise of the error is how much it changes when as much noise as the sensors have is drawn anew onto the
    unfiltered motions: that goes through the filter, the differences and the vehicle as the sensors' own did.
    """
    data = parts[0]
    motions, raw = ([m for part in parts for m in getattr(part, kind)] for kind in ("motions", "raw"))
    own = [residual(vehicle, motion, data) for motion in motions]
    level, rng = sensor_noise(raw), np.random.default_rng([seed, 17])
    changes = [
        _error(vehicle, _noisy(motion, level, data, rng), data) - (was.measured - was.modelled)
        for _ in range(_DRAWS)
        for motion, was in zip(raw, own, strict=True)
    ]
    rate = 1.0 / motions[0].time_step
    seconds = sum(motion.duration for motion in motions)
    independent = seconds * min(rate, 2.0 * (data.recipe.cutoff or rate))
    return Left(
        measured=_root([each.measured for each in own]),
        error=_root([each.measured - each.modelled for each in own]),
        noise=_root(changes),
        scatter=float(np.sqrt(2.0 / max(independent, 1.0))),
    )


def _noisy(motion: Motion, level: Array, data: DataSet, rng: np.random.Generator) -> Motion:
    """A motion with noise on its velocities, filtered as the data are."""
    noisy = replace(motion, velocity=motion.velocity + drawn_noise(motion, level, rng))
    return noisy if data.recipe.cutoff is None else smooth(noisy, data.recipe.cutoff, data.recipe.order)


def _error(vehicle: Vehicle, motion: Motion, data: DataSet) -> Array:
    found = residual(vehicle, motion, data)
    return found.measured - found.modelled


def _root(parts: Sequence[Array]) -> Array:
    return np.sqrt((np.concatenate(parts) ** 2).mean(axis=0))
