"""Kinds of faults of part 1: messages of other things, frames, values, and commands that are no sides."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tests" / "helpers"))

from bags import EPOCH, WORDS, Message, write_ros2
from pymavlink.dialects.v20 import ardupilotmega
from telemetry_files import BOOT, Writer

from undertow.measurements.canonical import command_kind
from undertow.physics.motion import Array, body_to_earth

from .kind import Bullet, Kind, Sound, Spoil, Spoilt, changed

_METRES = 111_320.0
"""In a degree of latitude [m], near enough for logs of some hundred metres."""
_AT = (48.0, 11.0)
"""Latitude and longitude at which the logs begin [deg]."""


# Fields of other things


def _own(sound: Sound) -> Iterator[Message]:
    """What the boat itself records: an IMU, fixes and the commands of its thrusters."""
    table = sound.table
    stamps = EPOCH + np.rint(1e9 * table["t"].to_numpy()).astype(np.int64)
    rate = table["r"].to_numpy() if "r" in table else np.gradient(np.unwrap(table["psi"]), table["t"])
    for k, (stamp, x, y, psi) in enumerate(zip(stamps.tolist(), table["x"], table["y"], table["psi"], strict=True)):
        half = 0.25 * np.pi - 0.5 * psi
        turning = {"angular_velocity.z": -float(rate[k]), "linear_acceleration.z": 9.81}
        pose = {"orientation.z": float(np.sin(half)), "orientation.w": float(np.cos(half))}
        yield Message("/imu/data", "sensor_msgs/msg/Imu", pose | turning, stamp, frame="imu_link")
        place = {
            "latitude": _AT[0] + x / _METRES,
            "longitude": _AT[1] + y / (_METRES * float(np.cos(np.radians(_AT[0])))),
        }
        yield Message("/gps/fix", "sensor_msgs/msg/NavSatFix", place, stamp, frame="gps_link")
        for name in sound.commands:
            kind, thruster = command_kind(name) or ("", "")
            value = {"data": float(table[name].iloc[k])}
            yield Message(f"/{thruster}/{WORDS[kind]}_cmd", "std_msgs/msg/Float64", value, stamp)


def _beside(topic: str, kind: str, frame: str, values: dict[str, tuple[float, float]], child: str = "") -> Spoil:
    """The boat's own messages and those of another thing, whose numbers wander by (mean, spread)."""

    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        def messages() -> Iterator[Message]:
            for own in _own(sound):
                yield own
                if own.topic == "/imu/data":
                    named: dict[str, float | str] = {"child_frame_id": child} if child else {}
                    drawn = {name: float(rng.normal(*about)) for name, about in values.items()}
                    yield Message(topic, kind, named | drawn, own.received, frame=frame)

        return Spoilt(write_ros2(folder / "bag", messages()))

    return spoil


_POSE = {"pose.position.x": (0.3, 0.05), "pose.position.y": (-0.2, 0.05), "pose.orientation.w": (1.0, 0.01)}
_ODOMETRY = {f"pose.{name}": about for name, about in _POSE.items()} | {
    "twist.twist.linear.x": (0.0, 0.05),
    "twist.twist.linear.y": (0.0, 0.05),
    "twist.twist.angular.z": (0.0, 0.02),
}
_IMU = {"orientation.z": (0.0, 0.01), "orientation.w": (1.0, 0.01), "angular_velocity.z": (0.0, 0.02)}


def _light(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt:
    """A long table in which a lamp's colours have the names r, g and b, and the boat has no yaw rate of its own."""
    table = sound.table.drop(columns="r", errors="ignore")
    own = table.melt("t", var_name="field").assign(topic="/boat/state")
    lamp = pd.DataFrame({"t": table["t"], **{name: rng.integers(0, 2, len(table)) for name in "rgb"}})
    both = pd.concat([own, lamp.melt("t", var_name="field").assign(topic="/mast/light")])
    both = both.rename(columns={"t": "time"}).sort_values("time", kind="stable")
    path = folder / "long.csv"
    both[["time", "topic", "field", "value"]].to_csv(path, index=False)
    return Spoilt(path)


def _port_number(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
    """A table of MAVLink messages, in which `port` is the number of the output bank."""
    if not sound.free:
        return None
    table = sound.table.assign(**{"SERVO_OUTPUT_RAW.port": 0.0, "SERVO_OUTPUT_RAW.servo1_raw": 1500.0})
    return sound.written(folder, table)


def _as_craft(kind: int, name: str) -> Spoil:
    """A telemetry log of the same motion, sent by a vehicle of another type."""

    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt:
        writer, table = Writer(), sound.table
        writer.add(BOOT, ardupilotmega.MAVLink_heartbeat_message(kind, 3, 0, 0, 4, 3))
        writer.add(BOOT, ardupilotmega.MAVLink_statustext_message(6, f"{name} V4.5.1 (1a2b3c4d)".encode()))
        for number, function in ((1, 33), (2, 34), (3, 35), (4, 36)):
            writer.add(
                BOOT, ardupilotmega.MAVLink_param_value_message(f"SERVO{number}_FUNCTION".encode(), function, 9, 4, 0)
            )
        columns = {str(name): table[name].to_numpy(dtype=float) for name in table.columns}
        still = np.zeros(len(table))
        for at in range(len(table)):
            t, x, y, heading = (float(columns[name][at]) for name in ("t", "x", "y", "psi"))
            surge, sway, rate = (float(columns.get(name, still)[at]) for name in ("u", "v", "r"))
            stamp = round(1000 * t) + 20_000
            now = BOOT + 1000 * stamp
            psi = float(np.angle(np.exp(1j * heading)))
            writer.add(now, ardupilotmega.MAVLink_attitude_message(stamp, 0.0, 0.0, psi, 0.0, 0.0, rate))
            north, east = (float(part) for part in body_to_earth(np.array(heading), np.array(surge), np.array(sway)))
            writer.add(now, ardupilotmega.MAVLink_local_position_ned_message(stamp, x, y, 0.0, north, east, 0.0))
            pulses = [round(1500 + 10 * np.sin(0.3 * t + k)) for k in range(4)] + [0] * 12
            writer.add(now, ardupilotmega.MAVLink_servo_output_raw_message(1000 * stamp % 2**32, 0, *pulses))
        path = folder / "flight.tlog"
        path.write_bytes(bytes(writer.content))
        return Spoilt(path)

    return spoil


OWN = (
    (
        "pose of a marker in a camera's frame",
        _beside("/aruco/pose", "geometry_msgs/msg/PoseStamped", "camera", _POSE),
        "aruco|camera",
    ),
    ("pose of a buoy", _beside("/buoy/pose", "geometry_msgs/msg/PoseStamped", "map", _POSE), "buoy"),
    (
        "odometry of a camera",
        _beside("/zed/odom", "nav_msgs/msg/Odometry", "odom", _ODOMETRY, "zed_left_camera_frame"),
        "zed|camera",
    ),
    ("rates of a gimbal's IMU", _beside("/gimbal/imu", "sensor_msgs/msg/Imu", "gimbal_link", _IMU), "gimbal"),
    (
        "speed of an obstacle",
        _beside(
            "/obstacles/nearest/twist",
            "geometry_msgs/msg/TwistStamped",
            "map",
            {"twist.linear.x": (0.5, 0.1), "twist.linear.y": (0.0, 0.1), "twist.angular.z": (0.0, 0.1)},
        ),
        "obstacle",
    ),
    ("colours of a light", _light, "light|colour"),
    ("MAVLink's port number", _port_number, "SERVO_OUTPUT_RAW|port number"),
    ("a copter's log", _as_craft(2, "ArduCopter"), "copter"),
    ("a submarine's log", _as_craft(12, "ArduSub"), "submarine"),
)


# Frames, where no speeds were measured


def _turned(change: str, keep_rate: bool = False) -> Spoil:
    """Positions and heading alone, turned as `change` says; with the yaw rate as it was, or without it."""

    def turn(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        x, y, psi = (table[name].to_numpy() for name in ("x", "y", "psi"))
        found: dict[str, tuple[Array, Array, Array]] = {
            "mirrored": (x, y, 0.5 * np.pi - psi),
            "negative": (x, y, -psi),
            "exchanged": (y, x, psi),
            "x reversed": (-x, y, psi),
            "stern": (x, y, psi + np.pi),
            "quarter": (x, y, psi + 0.5 * np.pi),
            "40 degrees": (x, y, psi + np.radians(40.0)),
        }
        table["x"], table["y"], table["psi"] = found[change]
        return table.drop(columns=["u", "v"] + ["r"] * (not keep_rate), errors="ignore")

    return changed(turn)


def _of_another_run(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The heading of another time of the log."""
    psi = table["psi"].to_numpy()
    table["psi"] = np.roll(np.unwrap(psi), len(psi) // 3) * 1.0
    return table.drop(columns=["u", "v"], errors="ignore")


FRAMES = (
    ("heading mirrored, pi/2 - psi", _turned("mirrored"), "opposite sign|mirrored"),
    ("heading mirrored, beside the yaw rate", _turned("mirrored", keep_rate=True), "opposite sign|mirrored"),
    ("heading counter-clockwise", _turned("negative"), "opposite sign|mirrored"),
    ("x and y exchanged", _turned("exchanged"), "exchanged|swapped|mirrored|opposite sign"),
    ("x reversed", _turned("x reversed", keep_rate=True), "opposite sign|mirrored|reversed"),
    ("bow taken for stern", _turned("stern"), "stern|180 degrees"),
    ("heading a quarter turn off", _turned("quarter"), "90 degrees|quarter"),
    ("heading 40 degrees off", _turned("40 degrees"), "(3|4)[0-9] degrees"),
    ("heading of another time", changed(_of_another_run), "contradict"),
)


# Values


def _commands_times(*factors: float) -> Spoil:
    """Commands about their neutral, each side times its factor; PWM has no such fault, for its values are refused."""

    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        if any(name.startswith("pwm") for name in sound.commands):
            return None
        table = sound.table.copy()
        for name, factor in zip(sound.commands, factors * len(sound.commands), strict=False):
            table[name] *= factor
        return sound.written(folder, table)

    return spoil


def _percent(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
    """Commands as percent of full command, under the name of the channel."""
    if any(name.startswith("pwm") for name in sound.commands):
        return None
    table = sound.table.copy()
    for thruster in sound.vehicle.thrusters:
        if thruster.channel in table:
            share = thruster.curve.normalised(table[thruster.channel].to_numpy(), thruster.command)
            table[thruster.channel] = 100.0 * share
    return sound.written(folder, table)


def _jumping(*jumps: tuple[float, float, float]) -> Spoil:
    """Positions that jump by (north, east) [m] at a share of the log, and stay; no speeds."""

    def jump(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        for share, north, east in jumps:
            rows = table.index[round(share * len(table)) :]
            table.loc[rows, "x"] += north
            table.loc[rows, "y"] += east
        return table.drop(columns=["u", "v", "r"], errors="ignore")

    return changed(jump)


def _reset(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The origin is set anew where the boat is, at the farthest place from the old one."""
    first = int(np.argmax(np.hypot(table["x"], table["y"])[len(table) // 4 : 3 * len(table) // 4])) + len(table) // 4
    for name in ("x", "y"):
        table.loc[table.index[first:], name] -= table[name].iloc[first]
    return table


def _out_and_back(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """30 m off for 3 s."""
    begin = table["t"].iloc[len(table) // 2]
    rows = (table["t"] >= begin) & (table["t"] < begin + 3.0)
    table.loc[rows, "x"] += 30.0
    return table.drop(columns=["u", "v", "r"], errors="ignore")


def _through_the_wrap(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Headings of 4 Hz, within -pi and pi, drawn to all stamps by straight lines."""
    psi = np.angle(np.exp(1j * table["psi"].to_numpy()))
    seldom = np.arange(table["t"].iloc[0], table["t"].iloc[-1], 0.25)
    nearest = np.searchsorted(table["t"], seldom)
    table["psi"] = np.interp(table["t"], table["t"].iloc[nearest], psi[nearest])
    return table.drop(columns="r", errors="ignore")


def _coarse(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Positions in whole metres beside measured speeds."""
    table["x"], table["y"] = table["x"].round(0), table["y"].round(0)
    return table


VALUES = (
    ("commands in percent", _percent, "percent|beyond"),
    ("commands ten times too large", _commands_times(10.0), "beyond"),
    ("one side 1.6 times too large", _commands_times(1.6, 1.0), "beyond"),
    ("positions jump by 60 m", _jumping((0.4, 60.0, 0.0)), "jump"),
    ("positions jump by 6 m and 9 m", _jumping((0.3, 6.0, 0.0), (0.7, 0.0, -9.0)), "jump"),
    ("the origin is set anew", changed(_reset), "jump"),
    ("positions 30 m off for 3 s", changed(_out_and_back), "jump"),
    ("headings drawn through their wrap", changed(_through_the_wrap), "wrap"),
    ("positions in whole metres", changed(_coarse), "whole|round|coarse"),
)


# Commands that are no sides


def _mixed(share: float, sign: float, exchanged: bool = False) -> Spoil:
    """Sum and difference of the sides, times a share, under the names of the sides."""

    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        if len(sound.commands) != 2:
            return None
        table, names = sound.table.copy(), sound.commands
        zero = 1500.0 if names[0].startswith("pwm") else 0.0
        port, stbd = (table[name].to_numpy() - zero for name in names)
        mixed = [zero + share * (port + stbd), zero + sign * share * (port - stbd)]
        table[names[0]], table[names[1]] = reversed(mixed) if exchanged else mixed
        if zero:
            table[names] = table[names].clip(800.0, 2200.0)
        return sound.written(folder, table)

    return spoil


def _stick(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
    """Throttle and steering as shares, under names of their own."""
    if len(sound.commands) != 2 or not sound.free:
        return None
    shares = [
        thruster.curve.normalised(sound.table[thruster.channel].to_numpy(), thruster.command)
        for thruster in sound.vehicle.thrusters
    ]
    table = sound.table.drop(columns=sound.commands)
    table["throttle_demand"], table["steering_demand"] = 0.5 * (shares[0] + shares[1]), 0.5 * (shares[0] - shares[1])
    return sound.written(folder, table)


def _stick_mapped(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
    """The same in newtons, with the map that mixes them."""
    if len(sound.commands) != 2 or not sound.free or not sound.commands[0].startswith("newton"):
        return None
    port, stbd = (sound.table[name].to_numpy() for name in sound.commands)
    table = sound.table.drop(columns=sound.commands)
    table["throttle_demand"], table["steering_demand"] = 0.5 * (port + stbd), 0.5 * (port - stbd)
    lines = [f"{name}: {{from: throttle_demand, mix: skid, steering: steering_demand}}" for name in sound.commands]
    return sound.written(folder, table).mapped("\n".join(lines) + "\n")


def _force_and_moment(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
    """The force ahead and the moment to starboard that the thrusters make, as research sets log them."""
    if not sound.free:
        return None
    table = sound.table.drop(columns=sound.commands)
    table["tau_surge"], table["tau_yaw"] = 0.0, 0.0
    for thruster in sound.vehicle.thrusters:
        force = thruster.curve.thrust(sound.table[thruster.channel].to_numpy(), thruster.command)
        table["tau_surge"] += force * np.cos(thruster.angle)
        table["tau_yaw"] += force * (thruster.x * np.sin(thruster.angle) - thruster.y * np.cos(thruster.angle))
    return sound.written(folder, table)


MIXES = (
    ("throttle and steering in place of the sides", _mixed(0.5, 1.0), "throttle and steering"),
    ("the same, steering to the other side", _mixed(0.5, -1.0), "throttle and steering"),
    ("the same, steering first", _mixed(0.5, 1.0, exchanged=True), "throttle and steering"),
    ("sum and difference", _mixed(1.0, 1.0), "throttle and steering"),
    ("throttle and steering under their names", _stick, "mix: skid"),
    ("throttle and steering, mapped", _stick_mapped, "mix"),
    ("force and moment", _force_and_moment, "tau_surge"),
)

KINDS: tuple[Kind, ...] = tuple(
    Kind(name, bullet, spoil, expect)
    for bullet, kinds in ((Bullet.OWN, OWN), (Bullet.FRAMES, FRAMES), (Bullet.VALUES, VALUES), (Bullet.MIXES, MIXES))
    for name, spoil, expect in kinds
)
"""All kinds of part 1."""
