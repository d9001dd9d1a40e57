"""Measure how fast logs are read and inspected, and the memory that a large bag and a long log take.

python benchmarks/reading.py [--messages 20000] [--large 2.0] [--folder DIR]

Bags: `read_log` against rosbags' own reader, which iterates over the messages of the same topics and unpacks them. Wide
CSV: `read_log` against `pandas.read_csv`. Both in processor time, the best of seven runs. `inspect` of a wide CSV of
1e5 and 1e6 rows, for a vehicle, each in a process of its own: processor time and peak memory, imports included. With
--large, two ROS 1 bags
of that many GB are written to the folder (a temporary one when none is given), one with a camera's pictures and one of
odometry alone, and each is read in a process of its own, by `read_log` and by rosbags; peak memory is that of the
whole process.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
import pandas as pd
from bags import EPOCH, Message, filled, types, write_mcap, write_ros1, write_ros2
from memory import peak_memory
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer

from undertow.measurements.log import read_log
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

REPEATS = 7
PACE = 20_000_000
"""Between the messages of a topic [ns]."""
HELPERS = Path(__file__).resolve().parents[1] / "tests" / "helpers"
INSPECT = f"""
import sys, time
from pathlib import Path
sys.path.insert(0, {str(HELPERS)!r})
from memory import peak_memory
from undertow.physics.vehicle import load_vehicle
from undertow.workflows.inspect_and_init import look_over
look_over([Path(sys.argv[1])], load_vehicle("blueboat"))
print(f"{{time.process_time():.1f}} | {{peak_memory() / 1e6:.0f}}")
"""
"""A program that inspects a log, and prints its processor time and peak memory."""


def compared(theirs: Callable[[], object], ours: Callable[[], object]) -> tuple[float, float]:
    """The shortest processor time of some runs of each, in turn [s]."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(REPEATS):
        for task, found in zip((theirs, ours), times, strict=True):
            begun = time.process_time()
            task()
            found.append(time.process_time() - begun)
    return min(times[0]), min(times[1])


def messages(count: int) -> Iterator[Message]:
    """Odometry, an IMU and a thrust command in turn."""
    chance = np.random.default_rng(0)
    for k, (a, b, c, d) in enumerate(chance.normal(size=(count // 3, 4)).tolist()):
        stamp = EPOCH + PACE * k
        pose = {"pose.pose.position.x": a, "pose.pose.position.y": b, "pose.pose.orientation.w": 1.0}
        speed = {"twist.twist.linear.x": c, "twist.twist.linear.y": d, "twist.twist.angular.z": a}
        yield Message("/odom", "nav_msgs/msg/Odometry", pose | speed, stamp, frame="odom")
        yield Message(
            "/imu", "sensor_msgs/msg/Imu", {"orientation.w": 1.0, "angular_velocity.z": a}, stamp, frame="imu"
        )
        yield Message("/left/thrust", "std_msgs/msg/Float64", {"data": b}, stamp)


def bare(path: Path) -> int:
    """Iterate over all messages as rosbags does, and unpack them."""
    count = 0
    with AnyReader([path]) as reader:
        wanted = [c for c in reader.connections if c.topic != "/camera"]
        for connection, _, raw in reader.messages(connections=wanted):
            reader.deserialize(raw, connection.msgtype)
            count += 1
    return count


def bags(folder: Path, count: int) -> None:
    """Compare the speed for each kind of bag."""
    made = list(messages(count))
    print(f"| {len(made)} messages | rosbags [s] | undertow [s] | speed against rosbags |")
    print("| --- | --- | --- | --- |")
    for name, path in (
        ("ROS 1", write_ros1(folder / "log.bag", made)),
        ("ROS 1 lz4", write_ros1(folder / "packed.bag", made, "lz4")),
        ("ROS 2 sqlite3", write_ros2(folder / "database", made)),
        ("ROS 2 MCAP, zstd", write_ros2(folder / "chunks", made, "mcap", "storage")),
        ("bare MCAP", write_mcap(folder / "log.mcap", made)),
    ):
        theirs, ours = compared(lambda path=path: bare(path), lambda path=path: read_log(path))
        print(f"| {name} | {theirs:.3f} | {ours:.3f} | {100 * theirs / ours:.0f} % |", flush=True)


def tables(folder: Path) -> None:
    """Compare the speed for a wide table."""
    names = ["x", "y", "psi", "u", "v", "r", "ax", "ay", "newton_port", "newton_stbd"]
    rows = np.random.default_rng(0).normal(size=(200_000, len(names)))
    frame = pd.DataFrame(rows, columns=names)
    frame.insert(0, "t", 0.02 * np.arange(len(frame)))
    path = folder / "wide.csv"
    frame.to_csv(path, index=False)
    theirs, ours = compared(lambda: pd.read_csv(path), lambda: read_log(path))
    print(f"\nwide CSV, {len(frame)} rows, {len(names)} channels: pandas.read_csv {theirs:.3f} s, ", end="")
    print(f"read_log {ours:.3f} s, {ours / theirs:.2f} times as long", flush=True)


def inspections(folder: Path) -> None:
    """Measure `inspect` of a boat's runs of ten minutes, one after the other for an hour and a half and fourteen."""
    path = folder / "run.csv"
    simulate_world(load_vehicle("blueboat"), {}, programme="rich", duration=600.0, noise="field").write(path)
    channels = read_log(path).channels
    time = channels["u"].time
    last = {name: np.searchsorted(channel.time, time, "right") - 1 for name, channel in channels.items()}
    run = pd.DataFrame({name: channel.value[last[name].clip(0)] for name, channel in channels.items()})
    print("\n| rows | inspect [s] | peak memory [MB] |")
    print("| --- | --- | --- |")
    for rows in (100_000, 1_000_000):
        table = pd.concat([run] * -(-rows // len(run)), ignore_index=True).iloc[:rows].round(6)
        table.insert(0, "t", (channels["u"].period * np.arange(rows)).round(6))
        table.to_csv(path, index=False)
        done = subprocess.run([sys.executable, "-c", INSPECT, str(path)], capture_output=True, text=True, check=True)
        print(f"| {rows} | {done.stdout.strip()} |", flush=True)


def write_large(path: Path, size: float, picture: int) -> Path:
    """Write a ROS 1 bag of `size` bytes: odometry, and a picture of so many bytes to each, if any."""
    store = types(1)
    kinds = {"/odom": "nav_msgs/msg/Odometry"} | ({"/camera": "sensor_msgs/msg/Image"} if picture else {})
    raws = {
        topic: bytearray(store.serialize_ros1(filled(store, Message(topic, kind, _content(picture, kind), 0)), kind))
        for topic, kind in kinds.items()
    }
    with Writer(path) as writer:
        connections = {t: writer.add_connection(t, kind, typestore=store) for t, kind in kinds.items()}
        written, stamp = 0, EPOCH
        while written < size:
            stamp += PACE
            for topic, raw in raws.items():
                raw[4:12] = (stamp // 10**9).to_bytes(4, "little") + (stamp % 10**9).to_bytes(4, "little")
                writer.write(connections[topic], stamp, bytes(raw))
                written += len(raw) + 54
    return path


def _content(picture: int, kind: str) -> dict[str, object]:
    if kind.endswith("Image"):
        return {"data": np.zeros(picture, np.uint8)}
    return {"pose.pose.orientation.w": 1.0, "twist.twist.linear.x": 1.0, "child_frame_id": "base_link"}


def large(folder: Path, gigabytes: float) -> None:
    """Measure time and peak memory for large bags, each in a process of its own."""
    print(f"\n| bag of {gigabytes:g} GB | read by | processor time [s] | peak memory [MB] | messages |")
    print("| --- | --- | --- | --- | --- |")
    for name, picture in (("camera", 300_000), ("odometry alone", 0)):
        path = write_large(folder / f"large_{picture}.bag", 1e9 * gigabytes, picture)
        for reader in ("undertow", "rosbags"):
            done = subprocess.run(
                [sys.executable, __file__, "--one", reader, str(path)], capture_output=True, text=True, check=False
            )
            told = done.stdout.strip() or f"failed with exit code {done.returncode} | |"
            print(f"| {name}, {path.stat().st_size / 1e9:.2f} GB | {reader} | {told} |", flush=True)
        path.unlink()


def one(reader: str, path: Path) -> None:
    """Read a bag, and print seconds, peak memory and messages."""
    begun = time.process_time()
    count = read_log(path).channels["u"].value.size if reader == "undertow" else bare(path)
    peak = peak_memory() / 1e6
    print(f"{time.process_time() - begun:.1f} | {peak:.0f} | {count}")


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--messages", type=int, default=20_000)
    parser.add_argument("--large", type=float, metavar="GB")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--one", nargs=2, metavar=("READER", "BAG"), help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        one(chosen.one[0], Path(chosen.one[1]))
        return
    with tempfile.TemporaryDirectory(dir=chosen.folder) as name:
        folder = Path(name)
        bags(folder, chosen.messages)
        tables(folder)
        inspections(folder)
        if chosen.large:
            large(folder, chosen.large)


if __name__ == "__main__":
    main()
