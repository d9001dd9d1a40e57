"""A log that grows gives the motions of the whole log, waits for what is half-written, and forgets what is past."""

import io
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from undertow.measurements.growing_log import GrowingLog, GrowingTable, growing_lines
from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.measurements.preparation.prepare import WEAK, prepare
from undertow.physics.errors import LogError, RequestError
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


def grown(lines: list[str], sizes: tuple[int, ...]) -> tuple[GrowingLog, list[Motion]]:
    growing, found, at, begun = GrowingLog("log", HULL, Reading()), [], 0, False
    while at < len(lines):
        size = sizes[at % len(sizes)]
        growing.table.take(lines[at : at + size])
        at += size
        if not begun and growing.seconds > 25.0:
            growing.begin()
            begun = True
        if begun:
            found += growing.motions()
    return growing, [*found, *growing.motions(ended=True)]


@pytest.mark.parametrize("wide", [False, True])
def test_its_motions_are_those_of_the_whole_log(tmp_path: Path, wide: bool):
    simulated = simulate_world(HULL, {}, duration=50.0, seed=4)
    path = simulated.write(tmp_path / "log.csv")
    if wide:  # every other row lacks its commands, and a gap cuts the log
        motion = simulated.motion()
        rows = np.column_stack([motion.time, motion.heading, motion.velocity, motion.commands])
        cells = [[f"{x:.6f}" for x in row] for k, row in enumerate(rows) if not 800 <= k < 850]
        for row in cells[1::2]:
            row[-2:] = ["", ""]
        header = ",".join(["t", "psi", "u", "v", "r", *(t.channel for t in HULL.thrusters)])
        path.write_text("\n".join([header, *(",".join(row) for row in cells), ""]))
    whole = prepare(read_log(path), HULL, WEAK).motions
    growing, parts = grown(path.read_text().splitlines(), (60, 500, 97))
    assert len(whole) == (2 if wide else 1)
    for name in ("time", "velocity", "commands", "minutes"):
        joined = np.concatenate([getattr(part, name) for part in parts])
        expected = np.concatenate([getattr(motion, name) for motion in whole])
        assert abs(len(joined) - len(expected)) <= len(whole)
        if not wide:
            assert joined == pytest.approx(expected[: len(joined)], abs=1e-9)
    assert np.diff(np.concatenate([part.time for part in parts])).min() > 0.0
    assert max(stream.time.size for stream in growing.table.streams()) < 60 * 20, "it forgets"


def test_a_bad_row_is_told_once_and_skipped():
    table = GrowingTable("log")
    table.take(["# a remark", "t,u", "0,1", "oops", "x,2", "0.1,3", "0.2,", ""])
    (stream,) = table.streams()
    assert stream.value == pytest.approx([1.0, 3.0, np.nan], nan_ok=True)
    assert table.take_notes() == ["line 4: expected 2 values, got 1; the row is skipped, and so are others like it"]
    assert (table.skipped, table.take_notes()) == (2, [])


def test_time_since_1970_counts_from_the_first_stamp():
    table = GrowingTable("log")
    table.take(["timestamp_ns,u", "1790000000000000001,1", "1790000000050000001,2"])
    assert table.streams()[0].time == pytest.approx([0.0, 0.05], abs=1e-12)
    assert "time counts from the first stamp" in table.take_notes()[0]
    assert table.start_ns == 1790000000000000001


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["t,u", "1,0", "0.5,0"], r"time runs backwards at line 3: 0\.500000 s after 1\.000000 s in u"),
        (["time,topic,field,value", "1,a,u,0", "0.5,b,v,0", "0.9,a,u,0"], "line 4: .* in a:u"),
        (["a,b"], "line 1: expected a CSV or Parquet table"),
    ],
)
def test_what_cannot_be_followed_is_refused(lines: list[str], words: str):
    with pytest.raises(LogError, match=words):
        GrowingTable("log").take(lines)


def test_a_value_that_cannot_be_is_refused():
    growing = GrowingLog("log", HULL, Reading())
    rows = [f"{0.05 * k},0,{'900' if k == 500 else '1'},0,0,0,0" for k in range(600)]
    growing.table.take(["t,psi,u,v,r,newton_port,newton_stbd", *rows[:450]])
    growing.begin()
    growing.motions()
    growing.table.take(rows[450:])
    with pytest.raises(LogError, match=r"u \(u\) must lie within -100 to 100"):
        growing.motions()


def test_a_channel_that_falls_silent_is_told():
    growing = GrowingLog("log", HULL, Reading())
    rows = [f"{0.05 * k:.2f},0,{'1' if k < 500 else ''},0,0,0,0" for k in range(700)]
    growing.table.take(["t,psi,u,v,r,newton_port,newton_stbd", *rows[:450]])
    growing.begin()
    growing.motions()
    for k in range(450, 700, 10):
        growing.table.take(rows[k : k + 10])
        growing.motions()
    (told,) = growing.table.take_notes()
    assert "nothing to follow since t = 24.9 s: u said nothing since" in told


def test_a_half_written_line_is_waited_for_and_left_out_in_the_end(tmp_path: Path):
    path = tmp_path / "log.csv"
    path.write_text("t,u\n0,1\n0.1,")

    def write() -> None:
        time.sleep(0.1)
        with path.open("a") as file:
            file.write("2\n0.2,3")

    writer = threading.Thread(target=write)
    writer.start()
    lines = [line for part in growing_lines(str(path), follow=True, idle=0.4) for line in part]
    writer.join()
    assert lines == ["t,u", "0,1", "0.1,2"]
    assert [line for part in growing_lines(str(path)) for line in part] == [*lines, "0.2,3"]


def test_a_file_that_shrinks_or_is_not_there_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "log.csv"
    path.write_text("t,u\n0,1\n")
    parts = growing_lines(str(path), follow=True)
    next(parts)
    path.write_text("t\n")
    with pytest.raises(LogError, match="became shorter while it was followed"):
        next(parts)
    with pytest.raises(LogError, match=r"no such file; expected a CSV log, or - for standard input"):
        next(growing_lines(str(tmp_path / "other.csv")))
    with pytest.raises(RequestError, match="--follow waits for a file"):
        next(growing_lines("-", follow=True))
    path.write_bytes(b"\x1f\x8b")
    with pytest.raises(LogError, match="a gzip file cannot be followed"):
        next(growing_lines(str(path), follow=True))
    monkeypatch.setattr("undertow.measurements.growing_log._LONGEST", 10)
    path.write_bytes(io.BytesIO(bytes(100)).read())
    with pytest.raises(LogError, match="without an end of a line"):
        next(growing_lines(str(path)))


def test_a_channel_map_names_the_time_and_its_unit(tmp_path: Path):
    lines = tmp_path / "map.yaml"
    lines.write_text("time: {from: clk, unit: ms}\n")
    growing = GrowingLog("log", HULL, Reading(channel_map=lines))
    growing.table.take(["clk,u", *(f"{500 + 50 * k},{k}" for k in range(20))])
    (u,) = growing.table.streams()
    assert u.time == pytest.approx(0.5 + 0.05 * np.arange(20))
    other = GrowingTable("log")
    other.take(["timestamp,u", *(f"{1_777_000_000_000 + 50 * k},{k}" for k in range(20))])
    assert other.streams()[0].time == pytest.approx(0.05 * np.arange(20))
