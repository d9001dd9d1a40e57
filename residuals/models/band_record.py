"""The band about a model's open-loop predictions, as `comparison.json` has it; see `residuals.series`."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from ...physics.file_records import Number, Record, Whole
from ...physics.motion import AXES, Array, Motion
from .interval import LEVEL

PREDICTED_SECONDS = (0.5, *(float(k) for k in range(1, 11)))
"""Horizons at which a band is calibrated [s]; between them it is interpolated, and before the first it is held."""
QUANTITIES = ("position", *AXES)
"""What has a band [m, m/s, m/s, rad/s]; that of the position is the radius of a disc."""


class PredictionBand(Record):
    """The band of a model's predictions: half-width = factor * sqrt(spread^2 + floor^2), by quantity and horizon.

    Beyond what a network has seen it grows: times 1 + growth * distance.

    Attributes
    ----------
    level : share of unseen predictions that it is made to hold: 0.95, or less where independent ones are under 19
    predictions, independent : from how many it was made, and as how many independent ones these count
    seconds : the horizons
    shift : heading [rad], surge and sway speed [m/s] and yaw rate [rad/s] by which a start is moved for the spread
    floor : median spread by horizon [m, m/s, m/s, rad/s]
    factor : by horizon
    half_width : its median by horizon [m, m/s, m/s, rad/s]
    growth : by quantity, for each standard deviation beyond the training of a network
    lowest, highest : surge and sway speed [m/s] and yaw rate [rad/s] within which it is told; None in earlier files
    """

    level: Number = LEVEL
    predictions: Whole
    independent: Number
    seconds: tuple[Number, ...] = PREDICTED_SECONDS
    shift: tuple[Number, Number, Number, Number]
    floor: Mapping[str, tuple[Number, ...]]
    factor: Mapping[str, tuple[Number, ...]]
    half_width: Mapping[str, tuple[Number, ...]]
    growth: tuple[Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0)
    lowest: tuple[Number, Number, Number] | None = None
    highest: tuple[Number, Number, Number] | None = None

    @model_validator(mode="after")
    def _whole(self) -> Self:
        for one in (self.floor, self.factor, self.half_width):
            if any(len(one.get(name, ())) != len(self.seconds) for name in QUANTITIES):
                raise ValueError(f"a number for each of {len(self.seconds)} horizons of {', '.join(QUANTITIES)}")
        return self

    def half_widths(self, spread: Array, after: Array, beyond: Array) -> Array:
        """Half-widths of rows.

        Parameters
        ----------
        spread : (..., rows, 4) how far each row moves with its start
        after : (rows,) time from the start [s]
        beyond : (..., rows) mean distance of the prediction so far from what its model has seen [standard deviations]
        """
        floor, factor = (
            np.column_stack([np.interp(after, self.seconds, one[name]) for name in QUANTITIES])
            for one in (self.floor, self.factor)
        )
        return factor * np.hypot(spread, floor) * (1.0 + np.multiply.outer(beyond, self.growth))

    def knows(self, speeds: Array) -> NDArray[np.bool_]:
        """Mask of the speeds (..., 3) [m/s, m/s, rad/s] at which the band is known."""
        if self.lowest is None or self.highest is None:
            return np.ones(speeds.shape[:-1], dtype=bool)
        return np.all((speeds >= self.lowest) & (speeds <= self.highest), axis=-1)

    def moved(self, motion: Motion) -> list[Motion]:
        """A motion with each state of its starts moved in turn."""
        return [with_moved_state(motion, k, by) for k, by in enumerate(self.shift)]


def with_moved_state(motion: Motion, state: int, by: float) -> Motion:
    """A motion with heading, surge speed, sway speed or yaw rate moved.

    Parameters
    ----------
    motion : measured
    state : 0 to 3 for psi, u, v, r
    by : in the unit of the state [rad, m/s, m/s, rad/s]
    """
    if state == 0:
        return replace(motion, heading=motion.heading + by)
    velocity = motion.velocity.copy()
    velocity[:, state - 1] += by
    return replace(motion, velocity=velocity)
