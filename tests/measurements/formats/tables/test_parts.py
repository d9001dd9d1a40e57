"""Tables are read in parts: whatever these are, the recording is the same, and only its numbers are kept."""

import gzip
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from undertow.measurements.formats.base import Recording, Request
from undertow.measurements.formats.registry import read_recording
from undertow.measurements.formats.tables import text_tables
from undertow.physics.errors import LogError

ROWS = 4000
FIELDS = ("psi", "u", "x")


def long_text() -> str:
    lines = ["time,topic,field,value"]
    for k in range(ROWS):
        lines += [f"{k / 20:.3f},odometry,{name},{'word' if k == 7 else k}" for name in FIELDS]
        lines += [f"{k / 20 + 0.01:.3f},command,newton_port,{k % 3}"]
    return "\n".join(lines) + "\n"


def wide_text() -> str:
    rows = (f"{1_700_000_000 + k / 20:.3f},{k},{'-' if k == 9 else 0.5 * k}" for k in range(ROWS))
    return "\n".join(["t,u,v", *rows])


def numbers(recording: Recording) -> list[tuple[str, bytes, bytes, bytes]]:
    return [(s.name, s.time.tobytes(), s.value.tobytes(), s.row.tobytes()) for s in recording.streams]


@pytest.mark.parametrize("text", [long_text(), wide_text()], ids=["long", "wide"])
@pytest.mark.parametrize("packed", [False, True])
def test_the_size_of_the_parts_changes_nothing(text: str, packed: bool, tmp_path: Path, monkeypatch):
    path = tmp_path / "log.csv"
    path.write_bytes(gzip.compress(text.encode()) if packed else text.encode())
    whole, told = read_recording(path), []
    monkeypatch.setattr(text_tables, "_PART", 1000)
    parts = read_recording(path, Request(progress=lambda done, total: told.append((done, total))))
    assert numbers(parts) == numbers(whole)
    assert (parts.notes, parts.start_ns) == (whole.notes, whole.start_ns)
    size = path.stat().st_size
    assert len(told) > 10
    assert told == sorted(told)
    assert told[-1] == (size, size)


def test_the_fields_of_one_message_share_their_stamps(tmp_path: Path):
    path = tmp_path / "log.csv"
    path.write_text(long_text())
    command, *odometry = read_recording(path).streams
    assert [stream.field for stream in odometry] == list(FIELDS)
    assert all(stream.time is odometry[0].time for stream in odometry)
    assert not np.array_equal(command.time, odometry[0].time)
    assert odometry[0].row[:3].tolist() == [2, 6, 10]
    assert np.isnan(odometry[0].value[7])


def test_a_table_takes_little_more_memory_than_its_numbers(tmp_path: Path, monkeypatch):
    path = tmp_path / "log.csv"
    rows = 100_000
    path.write_text("time,topic,field,value\n" + "".join(f"{k // 4},a,f{k % 4},{k}\n" for k in range(rows)))
    monkeypatch.setattr(text_tables, "_PART", 40_000)
    read_recording(path)
    tracemalloc.start()
    try:
        read_recording(path)
        assert tracemalloc.get_traced_memory()[1] < 8 * 6 * rows  # time twice, value and row, and a part
    finally:
        tracemalloc.stop()


PLAIN = {
    "long": "time,topic,field,value\n0.1,/odom,u,1\n0.1,/odom,v,\n0.3,cmd,port,-2.5e-3\n\n0.2,cmd,port,inf\n",
    "wide": "# a remark\nt,u,v,empty\n1700000000000000001,1,2.5,\n1700000000100000002,nan,1e400,\n",
    "semicolons": "time;u;v\r\n0;1;2\r\n0.5;3;4\r\n",
}
ODD = {
    "words": "t,u\n0,1\n1,off\n",
    "no time": "t,u\n0,1\n,2\n2,3\n",
    "a topic of numbers": "time,topic,field,value\n0,1,u,1\n1,1,u,2\n",
    "no topic": "time,topic,field,value\n0,,u,1\n1,NA,u,2\n",
    "instants": "time,u\n2024-01-01 00:00:00,1\n2024-01-01 00:00:01,2\n",
    "hexadecimal": "t,u\n0,1\n1,0x10\n",
    "truth": "t,u\n0,true\n1,false\n",
    "quoted": 't,u\n0,"1"\n1,2\n',
    "too many cells": "t,u\n0,1\n1,2,3\n",
    "no rows": "t,u\n",
    "too few cells": "t,u\n0\n",
    "no times": "t,u\nnan,1\nnan,2\n",
}
REFUSED = ("too many cells", "no rows", "no times")


@pytest.mark.parametrize("name", [*PLAIN, *ODD])
def test_in_parts_of_a_row_it_is_the_same_or_refused_in_the_same_words(name: str, tmp_path: Path, monkeypatch):
    path = tmp_path / "log.csv"
    path.write_text({**PLAIN, **ODD}[name], newline="")
    first = read(path)
    assert isinstance(first, str) is (name in REFUSED)
    monkeypatch.setattr(text_tables, "_PART", 1)
    assert first == read(path)


def test_the_numbers_of_a_table_are_read_to_the_last_digit(tmp_path: Path):
    path = tmp_path / "log.csv"
    values = np.random.default_rng(0).normal(size=200) ** 3
    path.write_text("t,u\n" + "".join(f"{k},{value!r}\n" for k, value in enumerate(values.tolist())))
    (stream,) = read_recording(path).streams
    np.testing.assert_allclose(stream.value, values, rtol=4e-16, atol=0.0)


def read(path: Path) -> object:
    try:
        found = read_recording(path)
    except LogError as error:
        return str(error)
    return numbers(found), found.notes, found.start_ns
