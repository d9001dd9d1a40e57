"""Figures of merit of a passage: how near it kept to its track, what that took, and what went wrong."""

import numpy as np

from ..physics.file_records import Flag, Number, Record, Whole
from .closed_loop import Passage

WIDE = 1.0
"""Half the width of the lane in which a boat is to stay about its point, in seconds at the pace's speed: about a length
of the hull."""
_FULL = 0.99
"""Share of full command from which a thruster is at its limit: what is left is rounding."""


class Merit(Record):
    """How well a boat was steered.

    Attributes
    ----------
    rmse : root mean square of the distance from the moving point [m]
    across : the same across the track alone [m]
    worst : largest distance [m]
    effort : root mean square of the commands as shares of full, over all thrusters
    off_lane : share of the time farther from the point than `WIDE`
    at_limit : share of the time with a thruster at its limit
    step : median of the processor time that the controller took for a period [ms]
    slow_step : time that one in twenty exceeded [ms]
    unsolved : periods whose problem was not solved
    lost : the boat was lost
    """

    rmse: Number
    across: Number
    worst: Number
    effort: Number
    off_lane: Number
    at_limit: Number
    step: Number
    slow_step: Number
    unsolved: Whole
    lost: Flag


def merit(passage: Passage) -> Merit:
    """The figures of a passage."""
    points = passage.track.at(passage.time)
    away = passage.motion[:, :2] - points[:, :2]
    across = -np.sin(points[:, 2]) * away[:, 0] + np.cos(points[:, 2]) * away[:, 1]
    distance = np.hypot(*away.T)
    share = np.abs(passage.share)
    return Merit(
        rmse=float(np.sqrt(np.mean(distance**2))),
        across=float(np.sqrt(np.mean(across**2))),
        worst=float(distance.max()),
        effort=float(np.sqrt(np.mean(share**2))),
        off_lane=float(np.mean(distance > WIDE * passage.track.pace.speed)),
        at_limit=float(np.mean(share.max(axis=1) >= _FULL)),
        step=1e3 * float(np.median(passage.seconds)),
        slow_step=1e3 * float(np.quantile(passage.seconds, 0.95)),
        unsolved=passage.unsolved,
        lost=passage.lost,
    )
