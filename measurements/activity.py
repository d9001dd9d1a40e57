"""Excitation of a log by its motion: what the boat did, and what cannot be learned for want of it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..physics.file_records import Number, Record
from ..physics.motion import Array, Motion

_ASTERN = -0.05
"""Surge speed below which a boat goes astern [m/s]: beyond what a rough sensor adds (0.04, `worlds.world.NOISE`)."""
_TURNING = 0.05
"""Yaw rate from which a boat turns [rad/s]: three times what a rough sensor adds."""
_SHIP = 0.3
"""Share of its fastest turn from which a ship that turns slowly, but far, is said to turn."""
_FAR = 0.5
"""Turn from which it is far [rad]: 30 degrees are no meander about a course."""


class Excitation(Record):
    """What the boat did.

    Attributes
    ----------
    seconds : duration of the usable motion [s]
    u, v, r : smallest and largest speed [m/s] and yaw rate [rad/s]
    astern : share of the time with u < -0.05 m/s
    turning_to_starboard, turning_to_port : share of the time with a yaw rate beyond 0.05 rad/s to that side, or
        beyond 30 % of the fastest one of a ship that turns slowly, but through 30 degrees
    sentences : what this log cannot tell, for a person
    """

    seconds: Number
    u: tuple[Number, Number]
    v: tuple[Number, Number]
    r: tuple[Number, Number]
    astern: Number
    turning_to_starboard: Number
    turning_to_port: Number
    sentences: tuple[str, ...]


def excitation_of(motions: Sequence[Motion], weights: Sequence[float] | None = None) -> Excitation:
    """Say how fast the boat went which way, and what motions of that kind cannot tell.

    Parameters
    ----------
    motions : of the log, or of an evenly spread part of a long one
    weights : of each, the seconds of the log that each of its seconds stands for; default: one
    """
    stands_for = [1.0] * len(motions) if weights is None else weights
    velocity = np.concatenate([motion.velocity for motion in motions])
    weight = np.repeat(stands_for, [motion.time.size for motion in motions])
    u, v, r = (_range(column) for column in velocity.T)
    astern = _share(velocity[:, 0] < _ASTERN, weight)
    turning = _TURNING
    if max(float(np.ptp(motion.heading)) for motion in motions) > _FAR:
        turning = min(_TURNING, _SHIP * float(np.quantile(np.abs(velocity[:, 2]), 0.99)))
    starboard, port = (_share(one, weight) for one in (velocity[:, 2] > turning, velocity[:, 2] < -turning))
    sentences = []
    if astern < 0.02:
        sentences.append("The boat hardly went astern: effects in u|u| and u u, or |u|r and u r, cannot be told apart.")
    if starboard < 0.02 and port < 0.02:
        sentences.append("The boat hardly turned: nothing can be learned about yaw.")
    elif min(starboard, port) < 0.02:
        side = "starboard" if starboard > port else "port"
        sentences.append(f"The boat turned to {side} only: a trim is hard to tell from yaw damping.")
    seconds = float(sum(each * motion.duration for each, motion in zip(stands_for, motions, strict=True)))
    return Excitation(
        seconds=seconds,
        u=u,
        v=v,
        r=r,
        astern=astern,
        turning_to_starboard=starboard,
        turning_to_port=port,
        sentences=tuple(sentences),
    )


def _range(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _share(rows: NDArray[np.bool_], weight: Array) -> float:
    return float(weight[rows].sum() / weight.sum())
