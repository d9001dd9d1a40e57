"""Bags of ROS 1 and ROS 2, and MCAP: the same motion from each, however it is packed."""

from typing import Any

import numpy as np
import pytest
from bags import EPOCH, WRITERS, Message, recorded, write_ros1
from logged import assert_same_motion, without_a_file
from rosbags.highlevel import AnyReader

from undertow.measurements.formats.base import Request
from undertow.measurements.formats.registry import FORMATS, read_recording
from undertow.measurements.log import read_log
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

BOAT = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def world():
    return simulate_world(BOAT, {}, duration=60.0, noise="field", seed=4)


@pytest.fixture(scope="module")
def truth(world):
    return without_a_file(world)


def test_every_way_to_write_a_bag_gives_the_same_motion(tmp_path, world, truth):
    messages = recorded(world)
    for name, (ending, write) in WRITERS.items():
        path = write(tmp_path / f"{name.replace(' ', '_')}{ending}", messages)
        log = read_log(path)
        assert list(log.channels) == ["x", "y", "psi", "u", "v", "r", "newton_port", "newton_stbd"], name
        np.testing.assert_array_equal(log.channels["u"].value, world.odometry[:, 3])
        assert any("ENU/FLU (REP-103)" in note for note in log.notes)
        assert not any("breaks off" in note or "left out" in note for note in log.notes), name
        assert_same_motion(log, truth, world)


@pytest.mark.parametrize("way", ["ROS 1 lz4", "ROS 2 sqlite3", "ROS 2 MCAP in chunks"])
def test_what_is_read_is_what_the_library_reads(tmp_path, world, way):
    ending, write = WRITERS[way]
    path = write(tmp_path / f"bag{ending}", recorded(world))
    with AnyReader([path]) as reader:
        unpack: Any = reader.deserialize
        theirs = [
            (stamp, unpack(raw, connection.msgtype).pose.pose.position.x)
            for connection, stamp, raw in reader.messages()
            if connection.topic == "/odometry"
        ]
    (stream,) = [s for s in read_recording(path).streams if s.name == "/odometry:pose.pose.position.x"]
    np.testing.assert_array_equal(stream.value, [value for _, value in theirs])
    np.testing.assert_allclose(np.diff(stream.time), np.diff([stamp for stamp, _ in theirs]) / 1e9, atol=1e-9)
    assert stream.kind == "nav_msgs/msg/Odometry"
    assert stream.frame == "odom"


def test_only_what_becomes_a_channel_is_unpacked(tmp_path, world):
    picture = Message("/camera", "sensor_msgs/msg/Image", {"data": np.arange(100, dtype=np.uint8)}, EPOCH)
    path = write_ros1(tmp_path / "log.bag", [picture, *recorded(world)])
    asked = []

    def choose(names):
        asked.extend(names)
        return frozenset(name for name in names if name.field == "data" and name.topic != "/camera")

    recording = read_recording(path, Request(choose))
    assert {stream.topic for stream in recording.streams} == {"/thrusters/port/thrust", "/thrusters/stbd/thrust"}
    assert {name.topic for name in asked} >= {"/camera", "/odometry"}
    assert {name.topic for name in recording.unread} == {"/camera", "/odometry"}
    unused = read_log(path).unused
    assert "/camera:height" in unused
    assert "/odometry:twist.twist.linear.z" in unused


def test_progress_counts_the_bytes_of_the_file(tmp_path, world):
    for name, (ending, write) in WRITERS.items():
        path = write(tmp_path / f"{name.replace(' ', '_')}{ending}", recorded(world)[:200])
        told = []
        read_log(path, progress=lambda done, total, told=told: told.append((done, total)))
        storage = sum(p.stat().st_size for p in path.iterdir() if p.suffix != ".yaml") if path.is_dir() else None
        assert told[-1] == (storage or path.stat().st_size,) * 2, name
        assert (np.diff([done for done, _ in told]) >= 0).all(), name


def test_missing_rosbags_is_said(tmp_path, world, monkeypatch):
    path = write_ros1(tmp_path / "log.bag", recorded(world)[:100])
    for name in ("rosbags.typesys", "rosbags"):
        monkeypatch.setitem(__import__("sys").modules, name, None)
    from undertow.measurements.formats.ros import ros_types

    ros_types._store.cache_clear()
    with pytest.raises(ValueError, match=r"ROS 1 bag needs rosbags: .*pip install -e '\.\[logs\]'"):
        read_log(path)


def test_the_expected_formats_are_all_named(tmp_path):
    (tmp_path / "log.bin").write_bytes(bytes(range(256)) * 9)
    with pytest.raises(
        ValueError, match=r"got binary content; expected a CSV .* ROS 1 bag \(\.bag\), ROS 2 bag"
    ) as caught:
        read_log(tmp_path / "log.bin")
    assert all(form.name in str(caught.value) for form in FORMATS if form.library)
