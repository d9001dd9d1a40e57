"""The sound logs that kinds of faults spoil: one world in six formats, and whether a log holds its table."""

import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tests" / "helpers"))

from bags import WORDS, Message, nanoseconds, write_mcap
from dataflash_files import dataflash_of
from ulog_files import PARAMETERS, Writer, ulog_of

from undertow.measurements.canonical import command_kind
from undertow.measurements.log import Log, read_log
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.world import simulate_world

from .kind import Sound

_SECONDS = 150.0
_STATE = ("x", "y", "psi", "u", "v", "r")
_NEAR = 0.03
"""Share of a channel's range by which a right reading may differ from the table: the digits of a format."""


class NotInFormatError(Exception):
    """A table that a format cannot hold, such as an EKF's state without speeds."""


def _pulses() -> Vehicle:
    """A BlueBoat driven by pulses, 35 N at the ends of 1100 to 1900 us."""
    content = load_vehicle("blueboat").to_dict()
    curve = {"kind": "table", "command": [1100.0, 1500.0, 1900.0], "force": [-35.0, 0.0, 35.0]}
    content["thrusters"] = [thruster | {"command": "pwm", "curve": curve} for thruster in content["thrusters"]]
    return vehicle_from_dict(content, "a BlueBoat driven by PWM")


@cache
def _table(pulses: bool, seed: int) -> pd.DataFrame:
    """A row per stamp of the odometry, commands held, after 10 s at rest."""
    vehicle = _pulses() if pulses else load_vehicle("blueboat")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        simulate_world(vehicle, {}, programme="rich", duration=_SECONDS, noise="field", seed=seed).write(path)
        channels = read_log(path).channels
    time = channels["u"].time
    columns = {"t": time}
    for name, channel in channels.items():
        columns[name] = channel.value[np.clip(np.searchsorted(channel.time, time, "right") - 1, 0, None)]
    return pd.DataFrame(columns)


def sounds(seed: int) -> tuple[Sound, ...]:
    """The sound logs of a seed, a format each."""
    boat, driven = load_vehicle("blueboat"), _pulses()
    return (
        Sound("wide CSV", boat, _table(False, seed), True, _wide),
        Sound("long CSV", boat, _table(False, seed), True, _long),
        Sound("Parquet", boat, _table(False, seed), True, _parquet),
        Sound("MCAP", boat, _table(False, seed), False, _mcap),
        Sound("DataFlash", driven, _table(True, seed), False, _dataflash),
        Sound("ULog", driven, _table(True, seed), False, _ulog),
    )


def _wide(table: pd.DataFrame, folder: Path) -> Path:
    path = folder / "log.csv"
    table.to_csv(path, index=False)
    return path


def _long(table: pd.DataFrame, folder: Path) -> Path:
    path = folder / "log.csv"
    rows = table.melt("t", var_name="field").sort_values("t", kind="stable").rename(columns={"t": "time"})
    rows.insert(1, "topic", "boat")
    rows.to_csv(path, index=False)
    return path


def _parquet(table: pd.DataFrame, folder: Path) -> Path:
    path = folder / "log.parquet"
    table.to_parquet(path)
    return path


def _mcap(table: pd.DataFrame, folder: Path) -> Path:
    """Odometry, or poses where speeds are missing, and a topic for each thruster."""
    moving = {"u", "v", "r"} <= set(table)
    messages = []
    for row in table.to_dict("records"):
        stamp, yaw = nanoseconds(row["t"]), 0.5 * np.pi - row["psi"]
        turned = {"orientation.z": float(np.sin(0.5 * yaw)), "orientation.w": float(np.cos(0.5 * yaw))}
        pose = {"position.x": row["y"], "position.y": row["x"], **turned}
        if moving:
            values = {f"pose.pose.{name}": value for name, value in pose.items()} | {
                "child_frame_id": "base_link",
                "twist.twist.linear.x": row["u"],
                "twist.twist.linear.y": -row["v"],
                "twist.twist.angular.z": -row["r"],
            }
            messages.append(Message("/odometry", "nav_msgs/msg/Odometry", values, stamp, frame="odom"))
        else:
            values = {f"pose.{name}": value for name, value in pose.items()}
            messages.append(Message("/pose", "geometry_msgs/msg/PoseStamped", values, stamp, frame="odom"))
        if not moving and "r" in table:
            rate = {"angular_velocity.z": -row["r"], "orientation_covariance": np.full(9, -1.0)}
            messages.append(Message("/imu", "sensor_msgs/msg/Imu", rate, stamp, frame="imu"))
        for name in table:
            kind, thruster = command_kind(str(name)) or ("", "")
            if kind:
                topic = f"/thrusters/{thruster}/{WORDS[kind]}"
                messages.append(Message(topic, "std_msgs/msg/Float64", {"data": float(row[name])}, stamp))
    return write_mcap(folder / "log.mcap", messages)


@dataclass(frozen=True)
class _Names:
    thrusters: tuple[str, ...]


@dataclass(frozen=True)
class _Simulated:
    """What the writers of autopilots' logs ask of a simulated world."""

    odometry_time: Array
    odometry: Array
    command_time: Array
    commands: Array
    truth: _Names


def _simulated(table: pd.DataFrame) -> Any:
    """A table as a world; autopilots estimate all of the state.

    Raises
    ------
    NotInFormatError
        where a part of it is missing.
    """
    if not set(_STATE) <= set(table):
        raise NotInFormatError
    names = [str(name) for name in table if command_kind(str(name))]
    if len(names) != 2 or not all(name.startswith("pwm_") for name in names):
        raise NotInFormatError
    time = table["t"].to_numpy(float)
    thrusters = tuple(name.removeprefix("pwm_") for name in names)
    return _Simulated(time, table[list(_STATE)].to_numpy(float), time, table[names].to_numpy(float), _Names(thrusters))


def _dataflash(table: pd.DataFrame, folder: Path) -> Path:
    path = folder / "log.bin"
    path.write_bytes(bytes(dataflash_of(_simulated(table)).content))
    return path


def _ulog(table: pd.DataFrame, folder: Path) -> Path:
    path = folder / "log.ulg"
    ends = {f"PWM_MAIN_{end}{output}": value for output in (1, 2) for end, value in (("MIN", 1100), ("MAX", 1900))}
    path.write_bytes(bytes(ulog_of(_simulated(table), Writer(PARAMETERS | ends)).content))
    return path


def read_right(log: Log, sound: Sound) -> bool:
    """Whether a log holds what the table says: its channels, at its stamps, but for where positions and time begin.

    It must have a heading, a position or speeds, and all commands, over half of the table's time at the least.
    """
    table, channels = sound.table, log.channels
    needed = {"psi", *sound.commands}
    if not needed <= set(channels) or not ({"x", "y"} <= set(channels) or {"u", "v"} <= set(channels)):
        return False
    at = table["t"].to_numpy(float)
    shift = float(channels["psi"].time[0]) - float(at[0])
    for name, channel in channels.items():
        if name not in table:
            continue
        time = channel.time - shift
        if np.ptp(time) < 0.5 * np.ptp(at) or time[-1] > at[-1] + 1.0:
            return False
        true = np.unwrap(table[name]) if name == "psi" else table[name].to_numpy(float)
        if name in sound.commands:
            rows = np.clip(np.searchsorted(at, time + 1e-3, "right") - 1, 0, None)
            error = channel.value - true[rows]
        else:
            error = channel.value - np.interp(time, at, true)
        reach = float(np.ptp(true))
        if name == "psi":  # of a boat that turns round and round, errors stay within half a turn
            error, reach = np.angle(np.exp(1j * error)), min(reach, np.pi)
        elif name in ("x", "y"):
            error = error - np.median(error)
        if float(np.sqrt(np.mean(error**2))) > _NEAR * max(reach, 1e-9):
            return False
    return True
