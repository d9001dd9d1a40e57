"""Margins of a network's acceleration, by axis, from rows that it did not learn.

A margin is a sum of sizes along the motion, since a gentle motion is predicted better. Beyond what training has seen
the vehicle's own margin takes its place, as the correction fades.
"""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ...physics.errors import RequestError
from ...physics.motion import Array, Motion
from ...physics.reading import Number
from ...physics.vehicle import Vehicle
from .network_inputs import network_inputs

LEVEL = 0.95
"""Share of the rows that a margin is to hold."""
_AROUND = 1.0
"""Time over which sizes are averaged [s]: a jump of a force reaches about so far through the filter."""
_LEAST = 0.1
"""Least constant part of a margin, in the mean error: no motion is predicted without error."""
_BLOCKS = 8
"""Stretches of the unseen rows whose scatter widens a margin by a standard error: half a minute tells only so much."""

Sizes = tuple[tuple[Number, ...], ...]


class Interval(BaseModel):
    """Margins of a network's acceleration, as `model.yaml` has them.

    Attributes
    ----------
    level : share of the rows that they are to hold
    learnt, alone : (3, sizes) margin of each axis per unit of each of the `sizes`, where the network knows its way, and
        where the vehicle is alone
    wider : (3,) by how much more than these the margin is beyond the training
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    level: Number = Field(gt=0.0, lt=1.0)
    learnt: Sizes
    alone: Sizes
    wider: tuple[Number, Number, Number]

    def check(self, vehicle: Vehicle, where: str) -> None:
        """Refuse margins of other sizes than those of a vehicle; `where` names the file.

        Raises
        ------
        RequestError
            where their number is another.
        """
        wanted = 7 + 2 * len(vehicle.thrusters)
        found = [len(rows) for table in (self.learnt, self.alone) for rows in (table, *table)]
        if found != 2 * [3, wanted, wanted, wanted]:
            raise RequestError(
                f"{where}: interval: expected 3 rows of {wanted} margins each, got {found}; the file is damaged, so "
                "train the network again"
            )

    def margin(self, found: Array, weight: Array, beyond: Array) -> Array:
        """Margin at rows, (n, 3) [m/s^2, m/s^2, rad/s^2].

        Parameters
        ----------
        found : (n, sizes) as `sizes` has them
        weight : (n, 3) gain of the correction
        beyond : (n,) distance beyond it [standard deviations]
        """
        own, base = (found @ np.array(table).T for table in (self.learnt, self.alone))
        mixed = weight * own + (1.0 - weight) * base
        wider = np.where(beyond[:, None] > 0.0, np.array(self.wider), 1.0)
        return mixed * wider * (1.0 + beyond[:, None])


def sizes(vehicle: Vehicle, motion: Motion, said: Array) -> Array:
    """Sizes with which errors may grow along a motion, (n, 7 + 2 thrusters).

    1, the velocities relative to the water, thrusts, their changes from row to row, and the acceleration that a model
    said (n, 3): root mean squares about each row, in SI units.

    Parameters
    ----------
    vehicle : whose water and thrusters count
    motion : along which errors are sized
    said : acceleration of the model (n, 3) [m/s^2, m/s^2, rad/s^2]
    """
    from scipy.ndimage import uniform_filter1d  # here, because it takes a tenth of a second

    seen = network_inputs(vehicle, motion, heading=False)
    change = np.diff(seen[:, 3:], axis=0, prepend=seen[:1, 3:])
    columns = np.column_stack([np.ones(len(seen)), seen, change, said])
    averaged = uniform_filter1d(columns**2, _rows(motion), axis=0, mode="nearest")
    return np.sqrt(np.maximum(averaged, 0.0))


def least_known(motion: Motion, weight: Array, beyond: Array) -> tuple[Array, Array]:
    """The least gain (n, 3) and the largest distance beyond (n,) about each row: the filter carries errors inwards.

    Parameters
    ----------
    motion : along which the filter reaches
    weight : gain of the correction (n, 3)
    beyond : distance beyond training (n,)
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    rows = _rows(motion)
    return minimum_filter1d(weight, rows, axis=0, mode="nearest"), maximum_filter1d(beyond, rows, mode="nearest")


def _rows(motion: Motion) -> int:
    return 2 * round(0.5 * _AROUND / motion.time_step) + 1


def calibrated(found: Array, error: Array, asked: Array, held: Array) -> Sizes:
    """Margins per unit of each size: their proportions from some rows, how large they are from rows that are unseen.

    Of n unseen rows n + 1 count (split conformal prediction), and a standard error from block to block is added.

    Parameters
    ----------
    found, error : (n, sizes) and (n, 3) of the first
    asked, held : the same of the unseen ones, in the order of time
    """
    from scipy.optimize import nnls

    unit = np.maximum(found.max(axis=0), 1e-12)
    margins = []
    for wrong, left in zip(np.abs(error).T, np.abs(held).T, strict=True):
        mean = max(float(wrong.mean()), 1e-12)
        per = nnls(found / unit, wrong / mean)[0]
        per[0] = max(per[0], _LEAST * unit[0])
        scale = mean * per / unit
        ratio = left / (asked @ scale)
        margins.append(tuple((_factor(ratio) * scale).tolist()))
    return tuple(margins)


def _factor(ratio: Array) -> float:
    """By how much scales grow to margins: a quantile of the errors in them, and a standard error of its logarithm."""
    rank = min(1.0, LEVEL * (1.0 + 1.0 / ratio.size))
    blocks = [np.quantile(part, rank) for part in np.array_split(ratio, min(_BLOCKS, ratio.size))]
    told = np.log(np.maximum(blocks, 1e-12))
    doubt = told.std(ddof=1) / np.sqrt(told.size) if told.size > 1 else 0.0
    return float(np.quantile(ratio, rank) * np.exp(doubt))


def widening(error: Array, margin: Array) -> Array:
    """Factor by which margins (n, 3) must be wider to hold errors (n, 3), at least 1, (3,)."""
    return np.maximum(1.0, np.quantile(np.abs(error) / margin, LEVEL, axis=0))
