"""Bags of ROS 1 and ROS 2, and MCAP: the same motion from each, whatever the packing, the clock or the break."""

import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags import EPOCH, WRITERS, Message, nanoseconds, recorded, write_mcap, write_ros1, write_ros2
from rosbags.highlevel import AnyReader
from verbs import done, refused, strict

from undertow.measurements.channels import Channel
from undertow.measurements.dataset import WEAK
from undertow.measurements.formats.base import Request
from undertow.measurements.formats.registry import FORMATS, read_recording
from undertow.measurements.log import Log, read_log
from undertow.measurements.prepare import prepare
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds import simulate_world

BOAT = load_vehicle("blueboat")
TIME = np.arange(0.0, 30.0, 0.1)


@pytest.fixture(scope="module")
def world():
    return simulate_world(BOAT, {}, duration=60.0, noise="field", seed=4)


@pytest.fixture(scope="module")
def truth(world):
    """The log as the world has it, without a file, on the time axis of the bags."""
    first = min(world.odometry_time[0], world.command_time[0])

    def channel(name, time, value):
        return Channel(name, (np.round(1e9 * time) - round(1e9 * float(first))) / 1e9, value.copy(), name)

    odometry = zip(("x", "y", "psi", "u", "v", "r"), world.odometry.T, strict=True)
    commands = zip((thruster.channel for thruster in BOAT.thrusters), world.commands.T, strict=True)
    channels = {name: channel(name, world.odometry_time, value) for name, value in odometry}
    return Log(Path("truth"), channels | {name: channel(name, world.command_time, value) for name, value in commands})


def motion_of(log):
    return prepare(log, BOAT, WEAK).motions


def assert_same_motion(log, truth):
    found, expected = motion_of(log), motion_of(truth)
    assert len(found) == len(expected) == 1
    for name in ("time", "position", "velocity", "commands"):
        np.testing.assert_allclose(getattr(found[0], name), getattr(expected[0], name), rtol=0, atol=1e-8)
    turned = found[0].heading - expected[0].heading
    np.testing.assert_allclose(np.exp(1j * turned), 1.0, atol=1e-8)


def test_every_way_to_write_a_bag_gives_the_same_motion(tmp_path, world, truth):
    messages = recorded(world)
    for name, (ending, write) in WRITERS.items():
        path = write(tmp_path / f"{name.replace(' ', '_')}{ending}", messages)
        log = read_log(path)
        assert list(log.channels) == ["x", "y", "psi", "u", "v", "r", "newton_port", "newton_stbd"], name
        np.testing.assert_array_equal(log.channels["u"].value, world.odometry[:, 3])
        assert any("ENU/FLU (REP-103)" in note for note in log.notes)
        assert not any("breaks off" in note or "left out" in note for note in log.notes), name
        assert_same_motion(log, truth)


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


# Clocks.


def odometry(values=(), late=0.0, header=lambda time: nanoseconds(time), topic="/odometry"):
    """A straight run north at 1 m/s, as odometry; `header` gives the stamp."""
    found = []
    for time in TIME:
        fields = {"pose.pose.position.y": time, "pose.pose.orientation.z": np.sqrt(0.5)}
        fields |= {"pose.pose.orientation.w": np.sqrt(0.5), "twist.twist.linear.x": 1.0, **dict(values)}
        stamp = nanoseconds(time) + round(1e9 * late)
        found.append(Message(topic, "nav_msgs/msg/Odometry", fields, stamp, header(time), "odom"))
    return found


def thrust(offset=0.0):
    return [
        Message(f"/{side}/thrust", "std_msgs/msg/Float64", {"data": 10.0 * time}, nanoseconds(time + offset))
        for time in TIME
        for side in ("left", "right")
    ]


def note(log, *parts):
    found = [text for text in log.notes if all(part in text for part in parts)]
    assert len(found) == 1, log.notes
    return found[0]


def test_header_stamps_are_preferred_to_receive_times_and_said_where_they_differ(tmp_path):
    log = read_log(write_ros2(tmp_path / "bag", [*thrust(), *odometry(late=0.25)]))
    np.testing.assert_allclose(log.channels["x"].value, log.channels["x"].time, atol=1e-9)
    note(log, "/odometry: received 0.250 s (median)", "which are used")
    punctual = read_log(write_ros2(tmp_path / "other", [*thrust(), *odometry(late=0.001)]))
    assert not any("received" in text for text in punctual.notes)


@pytest.mark.parametrize(
    ("header", "why"),
    [
        (lambda time: 0, "300 of 300 header stamps are zero"),
        (lambda time: nanoseconds(time) if time < 20 else nanoseconds(time - 15), "header stamps run back by 14.900 s"),
        (lambda time: nanoseconds(time if time < 20 else time + 3600), "header stamps stray by 3600"),
    ],
)
def test_header_stamps_that_are_zero_or_go_astray_are_left_for_the_receive_times(tmp_path, header, why):
    log = read_log(write_ros1(tmp_path / "log.bag", [*thrust(), *odometry(header=header)]))
    np.testing.assert_allclose(log.channels["x"].value, log.channels["x"].time, atol=1e-9)
    note(log, f"/odometry: {why}", "receive times used")


def test_messages_that_overtake_each_other_are_put_in_order_of_their_headers(tmp_path):
    messages = odometry()
    swapped = [messages[k ^ 1] for k in range(len(messages))]
    late = [
        Message(m.topic, m.kind, m.values, nanoseconds(time), m.header) for m, time in zip(swapped, TIME, strict=True)
    ]
    log = read_log(write_ros1(tmp_path / "log.bag", late))
    np.testing.assert_allclose(log.channels["x"].value, log.channels["x"].time + log.channels["x"].value[0], atol=1e-9)


def test_commands_without_a_header_are_put_on_the_clock_of_a_simulation(tmp_path):
    # Simulated time starts at 7 s and runs at half the speed of the wall clock, which stamps the receipts.
    def shown(time):
        return round(1e9 * (7.0 + 0.5 * time))

    log = read_log(write_ros2(tmp_path / "bag", [*odometry(header=shown), *thrust()], "mcap"))
    command = log.channels["newton_port"]
    np.testing.assert_allclose(command.time, 0.5 * TIME, atol=1e-6)
    np.testing.assert_allclose(log.channels["x"].time, 0.5 * TIME, atol=1e-9)
    note(log, "header stamps are of another clock", "0.500 times its rate", "by /odometry")


def test_one_sensor_with_a_clock_of_its_own_is_moved_to_the_receive_times(tmp_path):
    def imu(rate):
        return [
            Message(
                "/imu",
                "sensor_msgs/msg/Imu",
                {"angular_velocity.z": -0.01 * time},
                nanoseconds(time),
                round(1e9 * (50 + rate * time)),
            )
            for time in TIME
        ]

    values = {"twist.twist.angular.z": np.nan}
    log = read_log(write_ros2(tmp_path / "bag", [*odometry(values), *imu(1.0)]))
    np.testing.assert_allclose(log.channels["r"].value, 0.01 * log.channels["r"].time, atol=1e-9)
    note(log, "/imu: its header stamps are of another clock, moved by 1699999950.000 s")
    drifting = read_log(write_ros2(tmp_path / "other", [*odometry(values), *imu(1.5)]))
    np.testing.assert_allclose(drifting.channels["r"].value, 0.01 * drifting.channels["r"].time, atol=1e-9)
    note(drifting, "/imu", "runs at another rate; receive times used")


def test_a_receive_clock_that_was_set_back_is_refused(tmp_path):
    messages = thrust()
    for k in range(300, 600):
        messages[k] = Message(
            messages[k].topic, messages[k].kind, messages[k].values, messages[k].received - 12 * 10**9
        )
    with pytest.raises(ValueError, match="time runs backwards in newton_port"):
        read_log(write_mcap(tmp_path / "log.mcap", [*odometry(header=lambda time: 0), *messages]))


# Breaks.


BREAKABLE = {
    "ROS 1": "log.bag",
    "ROS 1 bz2": "log.bag",
    "ROS 1 lz4": "log.bag",
    "ROS 2 sqlite3": "bag/bag.db3",
    "ROS 2 sqlite3 by file": "bag/bag.db3.zstd",
    "ROS 2 MCAP": "bag/bag.mcap",
    "ROS 2 MCAP in chunks": "bag/bag.mcap",
    "ROS 2 MCAP by file": "bag/bag.mcap.zstd",
    "bare MCAP": "log.mcap",
}


@pytest.mark.parametrize("way", BREAKABLE)
@pytest.mark.parametrize("share", [0.6, 0.85])
def test_a_bag_that_breaks_off_is_read_up_to_the_break_with_a_note(tmp_path, world, truth, way, share):
    ending, write = WRITERS[way]
    path = write(tmp_path / ("log" + ending if ending else "bag"), recorded(world))
    file = tmp_path / BREAKABLE[way]
    whole = file.read_bytes()
    file.write_bytes(whole[: int(share * len(whole))])
    log = read_log(path)
    told = note(log, "breaks off") if "by file" not in way else note(log, "cannot be unpacked")
    assert "MB" in told
    speed = log.channels["u"]
    # Packed content and the index at the end are not spread evenly over the bytes.
    assert 0.3 * share < speed.value.size / truth.channels["u"].value.size <= 1.0
    np.testing.assert_array_equal(speed.value, truth.channels["u"].value[: speed.value.size])
    np.testing.assert_allclose(speed.time, truth.channels["u"].time[: speed.time.size], atol=1e-9)


def test_a_bag_without_index_is_read_to_its_end_with_a_note(tmp_path, world, truth):
    path = write_ros1(tmp_path / "log.bag", recorded(world), chunk=50_000)
    content = bytearray(path.read_bytes())
    place = content.index(b"index_pos=") + len(b"index_pos=")
    end = int.from_bytes(content[place : place + 8], "little")
    content[place : place + 8] = bytes(8)
    path.write_bytes(content[:end])
    log = read_log(path)
    note(log, "the bag has no index")
    assert_same_motion(log, truth)


def test_a_chunk_that_the_recorder_never_closed_is_read(tmp_path, world, truth):
    # roscpp writes a chunk's size when it closes the chunk; until then the record says that it is empty.
    path = write_ros1(tmp_path / "log.bag", recorded(world), chunk=2**30)
    content = path.read_bytes()
    start = content.index(b"op=\x05") - 8
    while int.from_bytes(content[start : start + 4], "little") > 200:
        start -= 1
    length = int.from_bytes(content[start : start + 4], "little")
    at = start + 4 + length
    size = int.from_bytes(content[at : at + 4], "little")
    path.write_bytes(content[:at] + bytes(4) + content[at + 4 : at + 4 + size - 100])
    log = read_log(path)
    note(log, "breaks off (in the middle of a message)")
    count = log.channels["u"].value.size
    assert count > 0.99 * truth.channels["u"].value.size
    np.testing.assert_array_equal(log.channels["u"].value, truth.channels["u"].value[:count])


def test_a_damaged_chunk_is_left_out_and_the_rest_is_read(tmp_path, world):
    for ending, write, mark in (
        (".bag", lambda p, m: write_ros1(p, m, "bz2", chunk=40_000), b"BZh9"),
        (".bag", lambda p, m: write_ros1(p, m, "lz4", chunk=40_000), b"\x04\x22\x4d\x18"),
    ):
        path = write(tmp_path / f"log{len(mark)}{mark[0]}{ending}", recorded(world))
        content = bytearray(path.read_bytes())
        place = content.index(mark, content.index(mark) + 4)
        content[place + 8 : place + 40] = bytes(32)
        path.write_bytes(content)
        log = read_log(path)
        note(log, "1 damaged chunks left out")
        assert 0.5 < log.channels["u"].value.size / world.odometry_time.size < 1.0


def test_a_folder_without_metadata_is_still_a_bag(tmp_path, world, truth):
    path = write_ros2(tmp_path / "bag", recorded(world))
    (path / "metadata.yaml").unlink()
    log = read_log(path)
    note(log, "no metadata.yaml in the folder")
    assert_same_motion(log, truth)
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: [")
    note(read_log(path), "metadata.yaml is broken")
    assert_same_motion(read_log(path / "bag.db3"), truth)


def test_a_database_that_the_recorder_left_open_is_read_with_its_journal(tmp_path, world):
    path = write_ros2(tmp_path / "bag", recorded(world)) / "bag.db3"
    database = sqlite3.connect(path)
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("PRAGMA wal_autocheckpoint = 0")
    database.execute("DELETE FROM messages WHERE id > 400")
    database.commit()
    log = read_log(path)
    database.close()
    note(log, "bag.db3-wal", "is read with it")
    assert sum(log.channels[name].value.size for name in ("u", "newton_port", "newton_stbd")) == 400


def test_splits_of_a_bag_are_read_in_order(tmp_path, world, truth):
    messages = recorded(world)
    half = len(messages) // 2
    first = write_ros2(tmp_path / "bag", messages[:half], "mcap")
    second = write_ros2(tmp_path / "bag_9", messages[half:], "mcap")
    (first / "bag.mcap").rename(first / "bag_9.mcap")
    (second / "bag_9.mcap").rename(first / "bag_10.mcap")
    text = (first / "metadata.yaml").read_text().replace("bag.mcap", "bag_9.mcap\n  - bag_10.mcap", 1)
    (first / "metadata.yaml").write_text(text)
    assert_same_motion(read_log(first), truth)
    (first / "metadata.yaml").unlink()
    assert_same_motion(read_log(first), truth)


REFUSED = {
    "an old version": (
        "log.bag",
        b"#ROSBAG V1.2\n" + bytes(99),
        "expected a ROS 1 bag of version 2.0, got '#ROSBAG V1.2'",
    ),
    "a bag of one line": ("log.bag", b"#ROSBAG V2.0\n", "no channel is recognised among nothing"),
    "another database": ("log.db3", None, "expected a ROS 2 bag with tables 'topics' and 'messages'"),
    "an empty MCAP": ("log.mcap", b"\x89MCAP0\r\n", "no channel is recognised among nothing"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_files_that_are_no_logs_are_refused_in_words(tmp_path, case):
    name, content, message = REFUSED[case]
    path = tmp_path / name
    if content is None:
        database = sqlite3.connect(path)
        database.execute("CREATE TABLE other(id)")
        database.commit()
        database.close()
    else:
        path.write_bytes(content)
    with pytest.raises(ValueError, match=message):
        read_log(path)


def test_missing_rosbags_is_said(tmp_path, world, monkeypatch):
    path = write_ros1(tmp_path / "log.bag", recorded(world)[:100])
    for name in ("rosbags.typesys", "rosbags"):
        monkeypatch.setitem(__import__("sys").modules, name, None)
    from undertow.measurements.formats import ros_types

    ros_types._store.cache_clear()
    with pytest.raises(ValueError, match=r"ROS 1 bag needs rosbags; run pip install 'undertow\[logs\]'"):
        read_log(path)


def test_the_expected_formats_are_all_named(tmp_path):
    (tmp_path / "log.bin").write_bytes(bytes(range(256)) * 9)
    with pytest.raises(
        ValueError, match=r"got binary content; expected a CSV .* ROS 1 bag \(\.bag\), ROS 2 bag"
    ) as caught:
        read_log(tmp_path / "log.bin")
    assert all(form.name in str(caught.value) for form in FORMATS if form.library)


def test_the_verbs_read_a_bag_and_give_its_map_back(tmp_path, world, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_ros2(tmp_path / "bag", [*recorded(world, "/alpha"), *recorded(world, "/beta")], "mcap")
    refused("inspect", "bag", match=r"expected the log of one vehicle, got 2: /alpha, /beta\. Choose one with --namesp")
    shown = done("inspect", "bag", "--namespace", "alpha", "--map-out", "channels.yaml")
    assert "newton_port: {from: '/alpha/thrusters/port/thrust:data'}" in shown
    found = strict(done("inspect", "bag", "--namespace", "alpha", "--map", "channels.yaml", "--json"))
    assert found["map"]["x"] == {"from": "/alpha/odometry:pose.pose.position.x", "frame": "enu"}
    again, first = read_log("bag", namespace="/alpha", channel_map="channels.yaml"), read_log("bag", namespace="alpha")
    assert again.entries == first.entries
    for name, channel in first.channels.items():
        np.testing.assert_array_equal(again.channels[name].value, channel.value)
        np.testing.assert_array_equal(again.channels[name].time, channel.time)
