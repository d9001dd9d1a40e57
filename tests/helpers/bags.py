"""Small writers of bags: a simulated world as a robot with ROS would have recorded it."""

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from undertow.physics.worlds.world import SimulatedLog

EPOCH = 1_700_000_000_000_000_000
"""First stamp of the bags [ns]."""
WORDS = {"pwm": "pwm", "newton": "thrust", "normalized": "throttle", "rad_s": "omega"}
OTHERS = {
    "mavros_msgs/msg/RCOut": "std_msgs/Header header\nuint16[] channels\n",
    "mavros_msgs/msg/VfrHud": "std_msgs/Header header\nfloat32 airspeed\nfloat32 groundspeed\nint16 heading\n"
    "float32 throttle\nfloat32 altitude\nfloat32 climb\n",
    "heron_msgs/msg/Drive": "float32 left\nfloat32 right\n",
}
"""Types that are no part of the standard ones."""


@dataclass(frozen=True)
class Message:
    """One message: topic, type, fields by dotted name, receipt [ns], and header stamp [ns] (None: the receipt)."""

    topic: str
    kind: str
    values: dict[str, Any]
    received: int
    header: int | None = None
    frame: str = ""


@functools.cache
def types(ros: int) -> Any:
    store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_JAZZY)
    for kind, definition in OTHERS.items():
        header = "=" * 80 + "\nMSG: std_msgs/Header\n"
        header += (
            "uint32 seq\ntime stamp\nstring frame_id\n"
            if ros == 1
            else "builtin_interfaces/Time stamp\nstring frame_id\n"
        )
        text = definition + (header if "Header" in definition else "")
        if ros == 2:
            text += "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" if "Header" in text else ""
        found = get_types_from_msg(text, kind)
        store.register({name: what for name, what in found.items() if name not in store.fielddefs})
    return store


def blank(store: Any, kind: str) -> Any:
    """A message with every number zero and every text empty."""
    values = {}
    for name, (node, what) in store.fielddefs[kind][1]:
        if node == 2:
            values[name] = blank(store, what)
        elif node == 1:
            values[name] = "" if what[0] == "string" else 0
        elif what[0][0] == 1 and what[0][1][0] != "string":
            values[name] = np.zeros(what[1] if node == 3 else 0, np.dtype(what[0][1][0]))
        else:
            values[name] = []
    return store.types[kind](**values)


def filled(store: Any, message: Message) -> Any:
    made = blank(store, message.kind)
    for path, value in message.values.items():
        *parents, name = path.split(".")
        setattr(functools.reduce(getattr, parents, made), name, value)
    if hasattr(made, "header"):
        stamp = message.received if message.header is None else message.header
        made.header.stamp.sec, made.header.stamp.nanosec = divmod(stamp, 10**9)
        made.header.frame_id = message.frame
    return made


def write_ros1(path: Path, messages: Iterable[Message], compression: str = "none", chunk: int = 2**20) -> Path:
    """Write a ROS 1 bag; compression none, bz2 or lz4."""
    store = types(1)
    writer = Writer1(path)
    writer.chunk_threshold = chunk
    if compression != "none":
        writer.set_compression(Writer1.CompressionFormat[compression.upper()])
    with writer:
        connections: dict[str, Any] = {}
        for message in messages:
            if message.topic not in connections:
                connections[message.topic] = writer.add_connection(message.topic, message.kind, typestore=store)
            raw = store.serialize_ros1(filled(store, message), message.kind)
            writer.write(connections[message.topic], message.received, raw)
    return path


def write_ros2(path: Path, messages: Iterable[Message], storage: str = "sqlite3", compression: str = "none") -> Path:
    """Write the folder of a ROS 2 bag; storage sqlite3 or mcap, compression none, message, file or storage."""
    store = types(2)
    writer = Writer2(path, version=9, storage_plugin=StoragePlugin[storage.upper()])
    if compression != "none":
        writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for message in messages:
            if message.topic not in connections:
                connections[message.topic] = writer.add_connection(message.topic, message.kind, typestore=store)
            raw = store.serialize_cdr(filled(store, message), message.kind)
            writer.write(connections[message.topic], message.received, raw)
    return path


def write_mcap(path: Path, messages: Iterable[Message], compression: str = "none") -> Path:
    """Write a bare MCAP file."""
    folder = write_ros2(path.with_suffix(""), messages, "mcap", compression)
    return (folder / f"{folder.name}.mcap").replace(path)


WRITERS: dict[str, tuple[str, Callable[[Path, Iterable[Message]], Path]]] = {
    "ROS 1": (".bag", write_ros1),
    "ROS 1 bz2": (".bag", functools.partial(write_ros1, compression="bz2", chunk=20_000)),
    "ROS 1 lz4": (".bag", functools.partial(write_ros1, compression="lz4", chunk=20_000)),
    "ROS 2 sqlite3": ("", write_ros2),
    "ROS 2 sqlite3 by message": ("", functools.partial(write_ros2, compression="message")),
    "ROS 2 sqlite3 by file": ("", functools.partial(write_ros2, compression="file")),
    "ROS 2 MCAP": ("", functools.partial(write_ros2, storage="mcap")),
    "ROS 2 MCAP in chunks": ("", functools.partial(write_ros2, storage="mcap", compression="storage")),
    "ROS 2 MCAP by message": ("", functools.partial(write_ros2, storage="mcap", compression="message")),
    "ROS 2 MCAP by file": ("", functools.partial(write_ros2, storage="mcap", compression="file")),
    "bare MCAP": (".mcap", write_mcap),
}
"""Every way to write a bag: ending of its name, and the writer."""


def recorded(world: SimulatedLog, namespace: str = "", late: float = 0.0) -> list[Message]:
    """A world as ROS records it: odometry (ENU/FLU by REP-103) and one command topic for each thruster.

    Parameters
    ----------
    world : the world
    namespace : before all topics, such as "/alpha"
    late : receipt after the stamp of the odometry [s]
    """
    found = []
    for time, (north, east, psi, u, v, r) in zip(world.odometry_time, world.odometry.tolist(), strict=True):
        yaw = np.pi / 2 - psi
        values = {
            "child_frame_id": "base_link",
            "pose.pose.position.x": east,
            "pose.pose.position.y": north,
            "pose.pose.orientation.z": float(np.sin(yaw / 2)),
            "pose.pose.orientation.w": float(np.cos(yaw / 2)),
            "twist.twist.linear.x": u,
            "twist.twist.linear.y": -v,
            "twist.twist.angular.z": -r,
        }
        stamp = nanoseconds(time)
        found.append(
            Message(f"{namespace}/odometry", "nav_msgs/msg/Odometry", values, stamp + round(1e9 * late), stamp, "odom")
        )
    for time, commands in zip(world.command_time, world.commands.tolist(), strict=True):
        for thruster, command in zip(world.vehicle.thrusters, commands, strict=True):
            topic = f"{namespace}/thrusters/{thruster.name}/{WORDS[thruster.command]}"
            found.append(Message(topic, "std_msgs/msg/Float64", {"data": command}, nanoseconds(time)))
    return sorted(found, key=lambda message: message.received)


def nanoseconds(time: float) -> int:
    """A time of the world [s] as a stamp of the bag [ns]."""
    return EPOCH + round(1e9 * float(time))


def moved(messages: Iterable[Message], seconds: float) -> list[Message]:
    """The same messages, received later or earlier."""
    return [replace(message, received=message.received + round(1e9 * seconds)) for message in messages]
