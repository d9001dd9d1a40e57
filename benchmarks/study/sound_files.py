"""Sound logs as files: what a boat recorded, written in one of six formats in turn, and read again.

Tables take every log. Messages of ROS and of autopilots are written up to 10 Hz, where the log has what they hold; an
autopilot drives by pulses, so that the thrusters of the vehicle file are given curves over pulses.
"""

import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "helpers"))

import dataflash_files
import ulog_files
from bags import WORDS, Message, nanoseconds, write_mcap

from undertow.measurements.canonical import command_kind
from undertow.measurements.channels.recognition import side_in
from undertow.measurements.log import Log, read_log
from undertow.physics.motion import Array
from undertow.physics.thrusters import TableCurve
from undertow.physics.vehicle import Vehicle, vehicle_from_dict

_STATE = ("x", "y", "psi", "u", "v", "r")
_SLOW = 10.5
"""Rate up to which logs are written in messages [Hz]: Python packs some 20,000 a second."""
_PULSES = (1500.0, 400.0)
"""Neutral of a speed controller and from there to either end [us], which the helpers' parameters state."""
Written = tuple[Path, Vehicle]
"""A file, and the vehicle file that fits it."""


def through_a_file(log: Log, vehicle: Vehicle, turn: int) -> tuple[Log, Vehicle, str]:
    """Write a log in the format whose turn it is, or the next that can hold it, and read it.

    Returns
    -------
    (log, vehicle, name of the format)

    Raises
    ------
    LogError
        where it is refused.
    """
    names = list(FORMATS)
    with tempfile.TemporaryDirectory() as folder:
        for name in [*names[turn % len(names) :], *names]:
            written = FORMATS[name](log, vehicle, Path(folder))
            if written is not None:
                return read_log(written[0]), written[1], name
    raise AssertionError("a long table holds every log")


def _table(log: Log) -> pd.DataFrame:
    """A row per stamp, blank where a channel has none, as loggers of several devices write."""
    columns = [pd.Series(c.value, index=c.time, name=name) for name, c in log.channels.items()]
    return pd.concat(columns, axis=1).sort_index().rename_axis("t").reset_index()


def _wide(log: Log, vehicle: Vehicle, folder: Path) -> Written:
    path = folder / "log.csv"
    _table(log).to_csv(path, index=False)
    return path, vehicle


def _long(log: Log, vehicle: Vehicle, folder: Path) -> Written:
    path = folder / "log.csv.gz"
    parts = [
        pd.DataFrame({"time": channel.time, "topic": "boat", "field": name, "value": channel.value})
        for name, channel in log.channels.items()
    ]
    packed = {"method": "gzip", "compresslevel": 1}
    pd.concat(parts).sort_values("time", kind="stable").to_csv(path, index=False, compression=packed)
    return path, vehicle


def _parquet(log: Log, vehicle: Vehicle, folder: Path) -> Written:
    path = folder / "log.parquet"
    _table(log).to_parquet(path)
    return path, vehicle


def _mcap(log: Log, vehicle: Vehicle, folder: Path) -> Written | None:
    """Odometry, or poses and an IMU where speeds are missing, and a topic for each thruster."""
    state = _state(log)
    thrusters = [command_kind(name) or ("", "") for name in log.channels if command_kind(name)]
    if state is None or not all(kind in WORDS and side_in(name) == name for kind, name in thrusters):
        return None
    time, columns = state
    found = []
    for row, at in enumerate(time):
        stamp, yaw = _ns(at), 0.5 * np.pi - float(columns["psi"][row])
        turned = {"orientation.z": float(np.sin(0.5 * yaw)), "orientation.w": float(np.cos(0.5 * yaw))}
        pose = {"position.x": float(columns["y"][row]), "position.y": float(columns["x"][row]), **turned}
        if set(_STATE) <= set(columns):
            values = {f"pose.pose.{name}": value for name, value in pose.items()} | {
                "child_frame_id": "base_link",
                "twist.twist.linear.x": float(columns["u"][row]),
                "twist.twist.linear.y": -float(columns["v"][row]),
                "twist.twist.angular.z": -float(columns["r"][row]),
            }
            found.append(Message("/odometry", "nav_msgs/msg/Odometry", values, stamp, frame="odom"))
            continue
        found.append(
            Message(
                "/pose", "geometry_msgs/msg/PoseStamped", {f"pose.{n}": v for n, v in pose.items()}, stamp, frame="odom"
            )
        )
        if "r" in columns:
            unknown = np.full(9, -1.0)
            rate = {
                "angular_velocity.z": -float(columns["r"][row]),
                "orientation_covariance": unknown,
                "linear_acceleration_covariance": unknown,
            }
            found.append(Message("/imu", "sensor_msgs/msg/Imu", rate, stamp, frame="imu"))
    for name, channel in log.channels.items():
        kind, thruster = command_kind(name) or ("", "")
        if kind:
            topic = f"/thrusters/{thruster}/{WORDS[kind]}"
            pairs = zip(channel.time, channel.value, strict=True)
            found += [Message(topic, "std_msgs/msg/Float64", {"data": float(v)}, _ns(at)) for at, v in pairs]
    return write_mcap(folder / "log.mcap", sorted(found, key=lambda message: message.received)), vehicle


def _dataflash(log: Log, vehicle: Vehicle, folder: Path) -> Written | None:
    made = _simulated(log, vehicle)
    if made is None:
        return None
    world, boat = made
    path = folder / "log.bin"
    path.write_bytes(bytes(dataflash_files.dataflash_of(world, _Flash(world)).content))
    return path, boat


def _ulog(log: Log, vehicle: Vehicle, folder: Path) -> Written | None:
    made = _simulated(log, vehicle)
    if made is None:
        return None
    world, boat = made
    ends = {f"PWM_MAIN_{end}{k}": v for k in (1, 2) for end, v in (("MIN", 1100), ("MAX", 1900))}
    path = folder / "log.ulg"
    path.write_bytes(bytes(ulog_files.ulog_of(world, _ULog(world, ulog_files.PARAMETERS | ends)).content))
    return path, boat


Writer = Callable[[Log, Vehicle, Path], Written | None]
FORMATS: dict[str, Writer] = {
    "wide CSV": _wide,
    "MCAP": _mcap,
    "long CSV": _long,
    "DataFlash": _dataflash,
    "Parquet": _parquet,
    "ULog": _ulog,
}
"""Writers, in turn; one gives None for a log that it cannot hold."""


class _Flash(dataflash_files.Writer):
    """Writes the accelerations of the motion in the place of the helper's constants."""

    def __init__(self, world: Any) -> None:
        super().__init__()
        self._world = world

    def add(self, name: str, stamp: int, *values: Any) -> None:
        """See the helper: IMU is number, three rates, three accelerations, and more."""
        if name == "IMU":
            ahead, starboard = _accelerations(self._world, (stamp - dataflash_files.START) * 1e-6)
            values = (*values[:4], ahead, starboard, *values[6:])
        super().add(name, stamp, *values)


class _ULog(ulog_files.Writer):
    """The same of a ULog."""

    def __init__(self, world: Any, parameters: Mapping[str, float]) -> None:
        super().__init__(parameters)
        self._world = world

    def add(self, topic: str, *values: float) -> None:
        """See the helper: sensor_combined is a stamp, three rates and three accelerations."""
        if topic == "sensor_combined":
            ahead, starboard = _accelerations(self._world, (values[0] - ulog_files.START) * 1e-6)
            values = (*values[:4], ahead, starboard, values[6])
        super().add(topic, *values)


def _accelerations(world: Any, time: float) -> tuple[float, float]:
    """What an accelerometer at the origin measures in a level boat [m/s^2]."""
    row = min(int(np.searchsorted(world.odometry_time, time - 1e-6)), world.odometry_time.size - 1)
    return float(world.specific_force[row, 0]), float(world.specific_force[row, 1])


def _simulated(log: Log, vehicle: Vehicle) -> tuple[Any, Vehicle] | None:
    """A log as the helpers take worlds, driven by pulses; None where an autopilot would not have it all."""
    state, boat = _state(log), _by_pulses(vehicle)
    if state is None or boat is None or not set(_STATE) <= set(state[1]):
        return None
    time, columns = state
    odometry = np.column_stack([columns[name] for name in _STATE])
    surge, sway, rate = odometry[:, 3:].T
    slopes = [np.gradient(speed, time) for speed in (surge, sway)]
    commands = [log.channels[t.channel] for t in vehicle.thrusters]
    if not all(np.array_equal(c.time, commands[0].time) for c in commands):
        return None
    reach = [max(np.abs(_ends(vehicle, k))) for k in range(2)]
    pulses = [_PULSES[0] + _PULSES[1] * c.value / r for c, r in zip(commands, reach, strict=True)]
    world = SimpleNamespace(
        odometry_time=time,
        odometry=odometry,
        specific_force=np.column_stack([slopes[0] - sway * rate, slopes[1] + surge * rate]),
        command_time=commands[0].time,
        commands=np.rint(np.column_stack(pulses)),
        truth=SimpleNamespace(thrusters=[t.name for t in vehicle.thrusters]),
    )
    return world, boat


def _by_pulses(vehicle: Vehicle) -> Vehicle | None:
    """The vehicle with curves over pulses; None where it is not driven by forces of two sides."""
    thrusters = vehicle.thrusters
    if [t.name for t in thrusters] != ["port", "stbd"]:
        return None
    if not all(t.command == "newton" and isinstance(t.curve, TableCurve) for t in thrusters):
        return None
    content = vehicle.to_dict()
    for k, thruster in enumerate(content["thrusters"]):
        reach = max(np.abs(_ends(vehicle, k)))
        command = [_PULSES[0] + _PULSES[1] * c / reach for c in thruster["curve"]["command"]]
        thruster |= {"command": "pwm", "curve": {**thruster["curve"], "command": command}}
    return vehicle_from_dict(content, "driven by pulses")


def _ends(vehicle: Vehicle, place: int) -> tuple[float, float]:
    command = vehicle.thrusters[place].curve.command  # type: ignore[union-attr]
    return command[0], command[-1]


def _state(log: Log) -> tuple[Array, dict[str, Array]] | None:
    """Channels of motion at the stamps that they share; None without positions and heading, or at a high rate."""
    found = {name: channel for name, channel in log.channels.items() if name in _STATE}
    if not {"x", "y", "psi"} <= set(found) or 1.0 / found["psi"].period > _SLOW:
        return None
    time = found["psi"].time
    if not all(np.array_equal(channel.time, time) for channel in found.values()):
        return None
    return time, {name: channel.value for name, channel in found.items()}


def _ns(time: float) -> int:
    """A stamp [ns] that a bag may have: none is before its beginning."""
    return nanoseconds(max(float(time), 0.0))
