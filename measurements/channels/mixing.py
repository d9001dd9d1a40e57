"""Throttle and steering mixed into the commands of two sides, as an autopilot mixes them."""

import numpy as np

from ...physics.motion import Array
from ...physics.thrusters import side_named
from ..canonical import command_kind

_RANGES = {"pwm": (1500.0, 500.0), "normalized": (0.0, 1.0)}
"""Neutral and reach of commands whose limits are known, as `physics.thrusters` has them for curves."""


def mixed(name: str, throttle: tuple[Array, Array], steering: tuple[Array, Array]) -> Array:
    """Mix throttle and steering into the command of one side, at the stamps of the throttle.

    With t and s in -1..1, port = (t + s) / k and starboard = (t - s) / k, k = max(1, |t| + |s|): where both do not fit,
    both give way alike. So does ArduPilot for thrusters that push astern as hard as ahead and `MOT_STR_THR_MIX` 0.5,
    its default (AP_MotorsUGV.cpp, output_skid_steering). Newtons and rad/s have no limit that is known: k = 1.

    Parameters
    ----------
    name : of the command, which tells the side
    throttle, steering : stamps [s] and values, in the unit of the command; a steering holds until its next value

    Examples
    --------
    >>> now = np.zeros(1)
    >>> [float(mixed(f"normalized_{side}", (now, now + 0.9), (now, now + 0.6))[0]) for side in ("port", "stbd")]
    [1.0, 0.20000000000000004]
    """
    kind, thruster = command_kind(name) or ("", "")
    neutral, reach = _RANGES.get(kind, (0.0, 1.0))
    known = np.isfinite(steering[1])
    time, value = steering[0][known], steering[1][known]
    if not time.size:
        return np.full(throttle[0].size, np.nan)
    row = np.searchsorted(time, throttle[0], side="right") - 1
    share = (throttle[1] - neutral) / reach
    turn = np.where(row >= 0, (value[np.maximum(row, 0)] - neutral) / reach, np.nan)
    size = np.maximum(1.0, np.abs(share) + np.abs(turn)) if kind in _RANGES else 1.0
    sign = 1.0 if side_named(thruster) == "port" else -1.0
    return neutral + reach * (share + sign * turn) / size
