"""What the interval of a model holds of the rows that judge it, within what it has seen and beyond."""

import numpy as np

from ..measurements.preparation.dataset import DataSet
from ..physics.motion import Array
from ..residuals.models.base import Model
from ..residuals.models.interval import LEVEL
from ..residuals.scores import Errors, by_axis
from .facts import Held, IntervalRecord


def coverage(model: Model, errors: Errors, data: DataSet) -> IntervalRecord | None:
    """Shares of the rows of a data set at which the measured acceleration lies in a model's interval; None without one.

    Parameters
    ----------
    errors : of the model on these data
    """
    margins = [model.margin(motion) for motion in data.motions]
    told = [margin for margin in margins if margin is not None]
    if not told or len(told) < len(margins):
        return None
    margin, error = np.concatenate(told), np.abs(np.concatenate(errors.acceleration))
    inside = np.concatenate([model.beyond(motion) for motion in data.motions]) == 0.0
    return IntervalRecord(
        level=LEVEL, inside=_held(error[inside], margin[inside]), outside=_held(error[~inside], margin[~inside])
    )


def _held(error: Array, margin: Array) -> Held:
    if not len(error):
        return Held()
    return Held(rows=len(error), share=by_axis((error <= margin).mean(axis=0)), margin=by_axis(margin.mean(axis=0)))
