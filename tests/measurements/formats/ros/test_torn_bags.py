"""Bags that break off, lack their index or are damaged are read as far as they go, and say so."""

import sqlite3

import numpy as np
import pytest
from bags import WRITERS, recorded, write_ros1, write_ros2
from logged import assert_same_motion, note, without_a_file

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
    assert_same_motion(log, truth, world)


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
    assert_same_motion(log, truth, world)
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: [")
    note(read_log(path), "metadata.yaml is broken")
    assert_same_motion(read_log(path / "bag.db3"), truth, world)


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
    third = len(messages) // 3
    first = write_ros2(tmp_path / "bag", messages[:third], "mcap")
    second = write_ros2(tmp_path / "bag_9", messages[third : 2 * third], "mcap")
    last = write_ros2(tmp_path / "bag_10", messages[2 * third :], "mcap")
    (first / "bag.mcap").rename(first / "bag_0.mcap")
    (second / "bag_9.mcap").rename(first / "bag_9.mcap")
    (last / "bag_10.mcap").rename(first / "bag_10.mcap")
    text = (first / "metadata.yaml").read_text().replace("bag.mcap", "bag_0.mcap\n  - bag_9.mcap\n  - bag_10.mcap", 1)
    (first / "metadata.yaml").write_text(text)
    assert_same_motion(read_log(first), truth, world)
    (first / "metadata.yaml").unlink()
    assert_same_motion(read_log(first), truth, world)


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


def test_metadata_of_aliases_in_aliases_is_broken_and_not_written_out(tmp_path, world):
    path = write_ros2(tmp_path / "bag", recorded(world)[:200], "mcap")
    lists = ["a0: &a0 [" + ",".join("x" * 10) + "]"]
    lists += [f"a{k}: &a{k} [" + ",".join([f"*a{k - 1}"] * 10) + "]" for k in range(1, 6)]
    told = "rosbag2_bagfile_information:\n  relative_file_paths: [*a5]\n"
    (path / "metadata.yaml").write_text("\n".join(lists) + "\n" + told)
    note(read_log(path), "metadata.yaml is broken")
    named = "rosbag2_bagfile_information:\n  relative_file_paths: [bag.mcap]\n  ros_distro: [a, b]\n"
    (path / "metadata.yaml").write_text(named)
    note(read_log(path), "metadata.yaml is broken")
