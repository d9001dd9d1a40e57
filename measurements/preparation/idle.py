"""Idle rows: a boat that nobody drives for a while only drifts, and says nothing of how it answers."""

import numpy as np

from ...physics.motion import Motion
from ...physics.vehicle import Vehicle

IDLE = 8.0
"""Time without any command after which rows are idle [s]: before, a boat still slows down."""
_IDLE_COMMAND = 0.03
"""Share of full command that is none: trim and rounding of a stick at neutral."""


def active(motion: Motion, vehicle: Vehicle, idle: float = IDLE) -> np.ndarray:
    """True on rows with a command within the last `idle` seconds, (n,)."""
    commands = motion.commands if motion.run_up is None else np.concatenate([motion.run_up, motion.commands])
    sizes = [np.abs(t.curve.normalised(commands[:, k], t.command)) for k, t in enumerate(vehicle.thrusters)]
    on = np.max(sizes, axis=0) > _IDLE_COMMAND
    row = np.arange(on.size)
    last = np.maximum.accumulate(np.where(on, row, -np.inf))
    return (row - last <= idle / motion.time_step)[on.size - motion.time.size :]
