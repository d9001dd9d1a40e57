"""Quarters of logs, each predicted by models that were fitted to the others: which step of a calibration is better."""

from collections.abc import Sequence

import numpy as np

from ...physics.frames import Array
from ...physics.motion import Motion
from ..balance.rollout_test import rise_of

QUARTERS = 4
"""Parts into which logs are cut."""
_GUARD = 1.0
"""Left out on each side of a quarter that is predicted [s]."""
_LEAST_STRETCH = 2.5
"""Shorter stretches are left out [s]."""


def quarter(motions: Sequence[Motion], number: int) -> tuple[tuple[Motion, ...], tuple[Motion, ...]]:
    """The stretches inside a quarter of the logs, and those outside it by a second or more."""
    ends = np.cumsum([0.0, *(m.duration for m in motions)])
    low, high = ends[-1] * number / QUARTERS, ends[-1] * (number + 1) / QUARTERS
    inside: list[Motion] = []
    outside: list[Motion] = []
    for motion, begun in zip(motions, ends[:-1], strict=True):
        spans = ((outside, -np.inf, low - _GUARD), (inside, low, high), (outside, high + _GUARD, np.inf))
        for kept, start, stop in spans:
            rows = np.clip((np.array([start, stop]) - begun) / motion.time_step, 0, motion.time.size)
            first, last = (int(row) for row in np.round(rows))
            if (last - first) * motion.time_step >= _LEAST_STRETCH:
                kept.append(motion.slice(first, last))
    return tuple(inside), tuple(outside)


def as_good(weak: Array, rolled: Array, overlap: int) -> bool:
    """True unless rollouts err more, by more than a standard error, under the second step than under the first.

    Sensor noise stands in both errors, so that a plain comparison is half chance where both are good; on known hulls
    the second step is nearly always nearer the truth (`benchmarks/calibration.py`).

    Parameters
    ----------
    weak, rolled : (starts, 3) squared errors
    overlap : rollouts that run at any time, which are not independent
    """
    rise = rise_of(weak, rolled, overlap)
    return rise.error is None or rise.difference <= rise.error
