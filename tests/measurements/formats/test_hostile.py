"""Files made to fill memory or to run for ever are refused early, and odd names do no harm."""

import gzip
import os
import sqlite3
import struct

import lz4.frame
import numpy as np
import pandas as pd
import pyarrow
import pyarrow.parquet
import pytest
from bags import Message, nanoseconds, write_ros2

from undertow.measurements.formats import unpacking
from undertow.measurements.formats.base import Name, Request
from undertow.measurements.formats.registry import read_recording
from undertow.measurements.formats.ros import mcap, ros_messages, ros_types
from undertow.measurements.formats.unpacking import zstd
from undertow.measurements.log import read_log
from undertow.physics.errors import LogError

TIME = np.arange(0.0, 20.0, 0.1)
TOPICS = "create table topics(id integer primary key, name text, type text, serialization_format text)"


def thrust():
    return [Message("/left/thrust", "std_msgs/msg/Float64", {"data": time}, nanoseconds(time)) for time in TIME]


@pytest.mark.parametrize(
    "messages",
    [
        "create table messages(id integer primary key, topic_id integer, timestamp integer, "
        "data blob generated always as (zeroblob(900000000)) virtual)",
        "create view Messages as with recursive c(id) as (select 1 union all select id + 1 from c) "
        "select id, 1 as topic_id, id as timestamp, zeroblob(12) as data from c",
    ],
)
def test_a_bag_whose_messages_are_computed_is_refused(tmp_path, messages):
    path = tmp_path / "log.db3"
    with sqlite3.connect(path) as database:
        database.execute(TOPICS)
        database.execute("insert into topics values(1, '/left/thrust', 'std_msgs/msg/Float64', 'cdr')")
        database.execute(messages)
        if "generated" in messages:
            database.execute("insert into messages(id, topic_id, timestamp) values(1, 1, 100)")
    database.close()
    with pytest.raises(LogError, match="no plain table"):
        read_log(path)


def record(op, data):
    return struct.pack("<BQ", op, len(data)) + data


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


def chunk(content, how="zstd"):
    packed = zstd().compress(content, 3) if how == "zstd" else lz4.frame.compress(content)
    start = struct.pack("<QQQI", 0, 1, len(content), 0) + text(how)
    return record(6, start + struct.pack("<Q", len(packed)) + packed)


def channel(number, topic):
    return record(4, struct.pack("<HH", number, 1) + text(topic) + text("cdr") + struct.pack("<I", 0))


def of(path, definition, *records):
    """An MCAP file of one schema, and the records after it."""
    schema = record(3, struct.pack("<H", 1) + text("my_msgs/msg/Thr") + text("ros2msg") + text(definition))
    path.write_bytes(
        mcap.MAGIC + record(1, text("ros2") + text("")) + schema + b"".join(records) + record(15, bytes(4))
    )
    return path


NESTED = [f"L{k + 1}[1000] a\n" for k in range(3)] + ["uint8[0] z\n"]
DOUBLED = [f"L{k + 1} a\nL{k + 1} b\n" for k in range(40)] + ["uint8[0] z\n"]


def bundle(parts):
    bar = "=" * 80
    return "float64 newton_port\nL0 first\n" + "".join(f"{bar}\nMSG: my_msgs/L{k}\n{p}" for k, p in enumerate(parts))


@pytest.mark.parametrize(
    ("definition", "why"),
    [
        ("float64 newton_port\nstring[300000000] names", "more than 10000 elements"),
        (bundle(NESTED), "more than 10000 elements"),
        (bundle(DOUBLED), "more than 10000 elements"),
        ("float64 newton_port\nThr more", "holds itself"),
        ("float64 newton_port\n" + "# more\n" * 200_000, "a definition of 1400020 characters"),
    ],
)
def test_types_that_fill_the_memory_are_not_compiled(definition, why):
    with pytest.raises(ValueError, match=why):
        ros_types.message_type("my_msgs/msg/Thr", definition, "msg", "cdr")


@pytest.mark.parametrize("how", ["zstd", "lz4"])
def test_a_bag_that_unpacks_to_hundreds_of_times_its_size_is_refused(tmp_path, monkeypatch, how):
    monkeypatch.setattr(unpacking, "_ALWAYS", 10**6)
    message = record(5, struct.pack("<HIQQ", 7, 0, 1, 1) + bytes(2**20))
    path = of(tmp_path / "log.mcap", "float64 newton_port", chunk(message * 80, how))
    with pytest.raises(LogError, match=r"log\.mcap: expected a log that unpacks to at most \d+ MB, for it has 0\."):
        read_log(path)


@pytest.mark.parametrize("how", ["gzip", "line", "rows"])
def test_a_packed_table_that_would_fill_the_memory_is_refused(tmp_path, monkeypatch, how):
    path, head = tmp_path / "log.csv.gz", b"t,x,y,psi\n"
    monkeypatch.setattr(unpacking, "_ALWAYS", 100_000)
    content = {"gzip": b"0,0,0,0\n" * 400_000, "line": b"0," * 2**20, "rows": b"1,2,3,4\n" * 40_000}[how]
    if how == "rows":
        monkeypatch.setattr(unpacking, "HELD", 100_000)
        monkeypatch.setattr(unpacking, "_ALWAYS", 10**7)
    path.write_bytes(gzip.compress(head + content))
    why = "lines of at most 1048576 bytes" if how == "line" else r"unpacks to at most \d+ MB, for it has 0\.0"
    if how == "line":
        path = tmp_path / "log.csv"
        path.write_bytes(head + content)
    with pytest.raises(LogError, match=rf"log\.csv.*: expected a .*{why}"):
        read_log(path)


def test_a_zstd_bag_is_bounded_by_its_size_on_disk_though_it_holds_packed_chunks(tmp_path, monkeypatch):
    message = record(5, struct.pack("<HIQQ", 7, 0, 1, 1) + bytes(2**20))
    inner = of(tmp_path / "log.mcap", "float64 newton_port", *[chunk(message * 4)] * 20)
    (tmp_path / "bag").mkdir()
    packed = tmp_path / "bag" / "bag_0.mcap.zstd"
    packed.write_bytes(zstd().compress(inner.read_bytes(), 3))
    monkeypatch.setattr(unpacking, "_ALWAYS", 10**7)
    with pytest.raises(LogError, match=r"bag: expected a log that unpacks to at most \d+ MB"):
        read_log(tmp_path / "bag")


def test_more_messages_than_a_file_has_bytes_for_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(unpacking, "_FREE_MESSAGES", 100)
    message = record(5, struct.pack("<HIQQ", 7, 0, 1, 1) + struct.pack("<Id", 1 << 8, 0.5))
    path = of(tmp_path / "log.mcap", "float64 newton_port", channel(7, "/thr"), chunk(message * 20_000))
    with pytest.raises(LogError, match=r"log\.mcap: expected at most \d+ messages in a file of 0\.00"):
        read_log(path)


@pytest.mark.parametrize(("columns", "rows", "why"), [(10_001, 2, "10000 columns"), (3, 12_000, "topics and fields")])
def test_tables_of_countless_columns_or_topics_are_refused(tmp_path, columns, rows, why):
    path = tmp_path / "log.csv"
    if columns > 3:
        lines = [",".join(["t", *(f"c{k}" for k in range(columns))]), *[",".join(["0"] * (columns + 1))] * rows]
    else:
        lines = ["time,topic,field,value", *(f"{k},/t{k},x,0" for k in range(rows))]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(LogError, match=f"log.csv: expected a .*at most 10000.*|{why}"):
        read_log(path)


def test_words_that_stand_in_every_row_of_a_parquet_are_held_once(tmp_path):
    path = tmp_path / "log.parquet"
    word = "w" * 100_000
    words = pyarrow.array([word, "2.5"] * (TIME.size // 2))
    pyarrow.parquet.write_table(pyarrow.table({"t": TIME, "u": TIME, "v": words}), path)
    log = read_log(path)
    assert log.channels["v"].value.size == TIME.size // 2
    np.testing.assert_array_equal(log.channels["v"].value, 2.5)


def test_lists_in_the_columns_of_a_parquet_are_left_alone(tmp_path):
    path = tmp_path / "log.parquet"
    pyarrow.parquet.write_table(pyarrow.table({"t": TIME, "u": TIME, "v": [[0.0] * 1000] * TIME.size}), path)
    log = read_log(path)
    assert "v" not in log.channels
    assert "v" in log.unused


def test_a_bag_of_countless_topics_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(ros_messages, "_MOST_TOPICS", 20)
    channels = b"".join(channel(k, f"/t{k}") for k in range(30))
    with pytest.raises(LogError, match=r"log\.mcap: expected at most 20 topics"):
        read_log(of(tmp_path / "log.mcap", "float64 newton_port", channels))


def test_a_table_of_countless_rows_in_a_few_bytes_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(unpacking, "_ALWAYS", 0)
    path = tmp_path / "log.parquet"
    table = pyarrow.table({"t": np.zeros(1_000_000), "x": np.zeros(1_000_000), "other": np.zeros(1_000_000)})
    pyarrow.parquet.write_table(table, path, compression="zstd")
    with pytest.raises(LogError, match=r"log\.parquet: expected a log that unpacks to at most \d+ MB, for it has"):
        read_log(path)


def test_only_wanted_columns_of_a_wide_parquet_are_read(tmp_path):
    path = tmp_path / "log.parquet"
    pd.DataFrame({"t": TIME, " u ": TIME, "note": ["calm"] * TIME.size}).to_parquet(path)
    log = read_log(path)
    np.testing.assert_array_equal(log.channels["u"].value, TIME)
    request = Request(lambda names: frozenset(name for name in names if name.field == "u"))
    recording = read_recording(path, request)
    assert [stream.field for stream in recording.streams] == ["u"]
    assert recording.unread == (Name("", "note"),)


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
def test_a_duration_is_a_time_in_seconds(tmp_path, unit):
    path = tmp_path / "log.parquet"
    pd.DataFrame({"t": pd.to_timedelta(TIME, unit="s").astype(f"timedelta64[{unit}]"), "u": TIME}).to_parquet(path)
    np.testing.assert_allclose(read_log(path).channels["u"].time, TIME, atol=1e-9)


def test_stamps_that_no_clock_shows_are_left_out(tmp_path):
    path = tmp_path / "log.parquet"
    stamps = (1.7e18 + 1e9 * TIME).astype(np.uint64)
    stamps[7] = 2**63 + 5
    pd.DataFrame({"timestamp_ns": stamps, "u": TIME}).to_parquet(path)
    channel = read_log(path).channels["u"]
    np.testing.assert_allclose(channel.time, np.delete(TIME, 7), atol=1e-6)
    np.testing.assert_array_equal(channel.value, np.delete(TIME, 7))


def test_names_that_are_not_text_are_read(tmp_path):
    def odd(suffix):
        return os.fsdecode(os.fsencode(tmp_path) + b"/\xff\xfe#? log" + suffix.encode())

    (write_ros2(tmp_path / "bag", thrust()) / "bag.db3").rename(odd(".db3"))
    pd.DataFrame({"t": TIME, "u": TIME}).to_parquet(tmp_path / "log.parquet")
    (tmp_path / "log.parquet").rename(odd(".parquet"))
    assert read_log(odd(".db3")).channels["newton_port"].value.size == TIME.size
    assert read_log(odd(".parquet")).channels["u"].value.size == TIME.size
