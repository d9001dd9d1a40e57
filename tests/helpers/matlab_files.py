"""Small MATLAB files of a simulated world."""

from pathlib import Path
from typing import Any

from scipy.io import savemat

from undertow.physics.worlds.world import SimulatedLog

_TEXT = 116
"""Bytes of free text at the start, where scipy writes the date."""


def structs_of(log: SimulatedLog) -> dict[str, Any]:
    """A world as structs: the odometry with its time, the commands with theirs."""
    columns = dict(zip(("x", "y", "psi", "u", "v", "r"), log.odometry.T, strict=True))
    commands = {f"pwm_{name}": log.commands[:, k] for k, name in enumerate(log.truth.thrusters)}
    return {"boat": {"time": log.odometry_time, "nav": columns}, "commands": {"t": log.command_time, **commands}}


def write_mat(path: Path, variables: dict[str, Any], **how: Any) -> Path:
    """Write variables; equal ones give equal bytes."""
    savemat(path, variables, **how)
    if how.get("format", "5") == "5":
        with path.open("r+b") as file:
            file.write(b"MATLAB 5.0 MAT-file, of a test".ljust(_TEXT))
    return path
