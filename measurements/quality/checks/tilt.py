"""Check of gravity in the accelerometer: a boat that trims with speed tilts its sensor."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ....physics.motion import GRAVITY
from ...statistics.blocks import numbered_on, robust_fit
from ..record import RATE, About, Check, Found, Record
from ..response import TIMES
from .clocks import on_grid

_BLOCK = 5.0
"""Length of a stretch that counts once [s]: rows of one manoeuvre err together."""
_SMALL = 0.15
"""Leak up to which the accelerometer shows accelerations [m/s^2]: a degree of trim."""
_MUCH = 0.5
"""Leak from which the accelerometer is of no use as one [m/s^2]."""


def _tilt(records: Sequence[Record]) -> Found:
    """Compare the accelerometer ahead with the change of speed, and look for a part that grows with speed squared."""
    having = [record for record in records if "ax" in record.log.channels]
    if not having:
        return []
    about = About("tilt", ("ax",), unit="m/s^2")
    stretches = [(record, stretch) for record in having for stretch in record.stretches]
    speeds = [np.abs(stretch.motion.velocity[:, 0]) for _, stretch in stretches]
    fast = float(np.quantile(np.concatenate(speeds), 0.99)) if speeds else 0.0
    if fast < 0.1:
        return about.untold("the boat moves too little to tell whether gravity leaks into the accelerometer")
    rest, columns, blocks = [], [], []
    for record, stretch in stretches:
        motion = stretch.motion
        surge, sway, rate = motion.velocity.T
        rest.append(on_grid(record, "ax", motion.time) - np.gradient(surge, 1.0 / RATE) + sway * rate)
        columns.append(np.column_stack([surge * np.abs(surge) / fast**2, np.ones_like(surge)]))
        blocks.append(((motion.time - motion.time[0]) // _BLOCK).astype(np.int64))
    fit = robust_fit(np.concatenate(columns), np.concatenate(rest), numbered_on(blocks))
    leak, ends = float(fit.values[0]), fit.interval(0)
    if ends is None:
        return about.untold("the log is too short to tell whether gravity leaks into the accelerometer")
    parts = {"at_speed": fast, "offset": float(fit.values[1])}
    measured = replace(about, value=leak, ci95=ends, parts=parts)
    if max(abs(ends[0]), abs(ends[1])) <= _SMALL:
        return measured.ok(f"the accelerometer shows accelerations only (a leak of {leak:+.2f} m/s² at {fast:.1f} m/s)")
    if abs(leak) <= _SMALL or not fit.certain(0, TIMES):
        text = f"too little to tell whether gravity leaks into the accelerometer ({ends[0]:.2f} to {ends[1]:.2f} m/s²)"
        return measured.untold(text)
    angle = float(np.degrees(np.arcsin(np.clip(abs(leak) / GRAVITY, 0.0, 1.0))))
    trim = "bow up" if leak > 0.0 else "bow down"
    return measured.finding(
        "warning" if abs(leak) > _MUCH else "note",
        f"ax holds {leak:+.2g} m/s² of gravity at {fast:.1f} m/s: it trims {trim} by {angle:.0f} degrees",
        consequence="ax is no acceleration at speed; undertow does not use it",
        remedy="take accelerations from speeds, or correct ax for the pitch angle",
        short="gravity leaks into the accelerometer",
    )


TILT = Check("tilt", _tilt)
