"""Tables as people have them: any time column, decimal commas, quotes, blanks, no names, UTF-16, a pointer."""

import gzip
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from undertow.measurements.formats.base import TimeColumn, find_time, read_head
from undertow.measurements.formats.registry import read_recording
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError

TIME = 0.5 + 0.05 * np.arange(80)
X, PSI = np.sin(TIME), 0.1 * TIME**2
BEGIN = pd.Timestamp("2026-05-01T21:59:58Z")


def table(**time: object) -> pd.DataFrame:
    """A table with some time columns in the place of seconds."""
    return pd.DataFrame({**time, "x": X, "y": -X, "psi": PSI, "u": 2.0 * X})


def written(folder: Path, frame: pd.DataFrame, **how: object) -> Path:
    path = folder / "log.csv"
    frame.to_csv(path, index=False, **how)  # type: ignore[call-overload]
    return path


def mapped(path: Path, lines: str) -> Log:
    channels = path.with_name("map.yaml")
    channels.write_text(lines)
    return read_log(path, Reading(channel_map=channels))


def assert_right(log: Log, near: float = 1e-9) -> None:
    """The channels are those of the table, from wherever its time counts."""
    for name, true in (("x", X), ("psi", PSI), ("u", 2.0 * X)):
        channel = log.channels[name]
        np.testing.assert_allclose(channel.time - channel.time[0], TIME - TIME[0], atol=1e-6)
        np.testing.assert_allclose(channel.value, true, atol=near)


NAMES = {
    "__time": TIME,
    "%time": 1_777_000_000_000_000_000 + np.rint(1e9 * TIME).astype(np.int64),
    "timestamp": 1_777_000_000_000 + np.rint(1e3 * TIME).astype(np.int64),
    "Time (s)": TIME,
    "time_s": TIME,
    "elapsed [ms]": 1e3 * TIME,
    "Elapsed Time (us)": 1e6 * TIME,
    "TimeUS": 1e6 * TIME,
    "t_min": TIME / 60.0,
    "seconds": TIME,
    "rosbagTimestamp": 1_777_000_000_000_000_000 + np.rint(1e9 * TIME).astype(np.int64),
    "unix time": 1_777_000_000.0 + TIME,
}


@pytest.mark.parametrize("name", NAMES)
def test_a_time_of_any_usual_name_and_size_is_read(name: str, tmp_path: Path):
    assert_right(read_log(written(tmp_path, table(**{name: NAMES[name]}))))


def test_rostopic_counts_nanoseconds_also_where_a_simulator_begins_at_nought(tmp_path: Path):
    assert_right(read_log(written(tmp_path, table(**{"%time": np.rint(1e9 * TIME).astype(np.int64)}))))


@pytest.mark.parametrize("name", ["r", "tau", "temp", "height", "timeout", "min", "s", "target", "stbd"])
def test_other_names_are_no_time(name: str):
    assert find_time((name, "x")) is None


def test_t_and_time_go_before_other_names():
    assert find_time(("timestamp", "elapsed", "t")) == TimeColumn("t")


INSTANTS = {
    "ISO 8601": {"time": "%Y-%m-%dT%H:%M:%S.%fZ"},
    "with a zone": {"timestamp": "%Y-%m-%d %H:%M:%S.%f+0000"},
    "date and time": {"Date": "%Y-%m-%d", "Time": "%H:%M:%S.%f"},
    "date with points": {"Datum": "x", "date": "%d.%m.%Y", "time": "%H:%M:%S.%f"},
    "time of the day": {"time": "%H:%M:%S.%f"},
}


@pytest.mark.parametrize("name", INSTANTS)
@pytest.mark.parametrize("zone", ["UTC", "Etc/GMT-2"])
def test_instants_in_words_are_read_also_over_midnight(name: str, zone: str, tmp_path: Path):
    instants = pd.Series((BEGIN + pd.to_timedelta(TIME, unit="s")).tz_convert(zone))
    columns = {column: instants.dt.strftime(form) for column, form in INSTANTS[name].items()}
    path = written(tmp_path, table(**columns))
    assert_right(read_log(path))
    recording = read_recording(path)
    whole = name in ("ISO 8601", "date and time") and zone == "UTC"
    if whole:
        assert recording.start_ns == int((BEGIN + pd.Timedelta(seconds=0.5)).value)


def test_instants_in_a_parquet_file_are_read(tmp_path: Path):
    instants = (BEGIN + pd.to_timedelta(TIME, unit="s")).strftime("%Y-%m-%dT%H:%M:%S.%fZ")
    path = tmp_path / "log.parquet"
    table(timestamp=instants).to_parquet(path)
    assert_right(read_log(path))


def test_words_that_are_no_instants_are_refused(tmp_path: Path):
    path = written(tmp_path, table(time=["soon"] * 80))
    with pytest.raises(LogError, match=r"holds no numbers and no instants, got 'soon'; write .* ISO 8601"):
        read_log(path)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_are_read_beside_semicolons_and_tabs(separator: str, tmp_path: Path):
    path = written(tmp_path, table(t=TIME), sep=separator, decimal=",")
    assert read_head(path).text.decimal == ","
    assert_right(read_log(path))


def test_semicolons_beside_decimal_points_stay_points(tmp_path: Path):
    path = written(tmp_path, table(t=TIME), sep=";")
    assert read_head(path).text.decimal == "."
    assert_right(read_log(path))


def test_a_quoted_name_may_hold_the_separator(tmp_path: Path):
    """RFC 4180, section 2.6."""
    frame = table(t=TIME).assign(**{"Thrust, port [N]": X})
    path = written(tmp_path, frame)
    log = mapped(path, "newton_port: 'Thrust, port [N]'\n")
    np.testing.assert_allclose(log.channels["newton_port"].value, X)
    assert_right(log)


def test_columns_set_apart_by_blanks_are_read(tmp_path: Path):
    path = tmp_path / "log.txt"
    path.write_text(table(t=TIME).to_string(index=False, float_format=lambda x: f"{x:.12g}"))
    assert_right(read_log(path))


def test_the_header_of_numpy_savetxt_names_the_columns(tmp_path: Path):
    path, frame = tmp_path / "log.txt", table(t=TIME)
    np.savetxt(path, frame.to_numpy(), header=" ".join(frame.columns))
    log = read_log(path)
    assert_right(log)
    assert not any("t x y" in note for note in log.notes)


BY_NUMBER = "time: 1\nx: 2\ny: 3\npsi: 4\nu: 5\n"


def nameless(folder: Path, ending: str) -> Path:
    """The table without its names."""
    matrix = table(t=TIME).to_numpy()
    path = folder / f"log{ending}"
    if ending == ".mat":
        savemat(path, {"xout": matrix})
    elif ending == ".npy":
        np.save(path, matrix)
    else:
        np.savetxt(path, matrix, delimiter="," if ending == ".csv" else " ")
    return path


@pytest.mark.parametrize("ending", [".csv", ".txt", ".mat", ".npy"])
def test_a_table_without_names_is_read_by_the_numbers_of_its_columns(ending: str, tmp_path: Path):
    path = nameless(tmp_path, ending)
    with pytest.raises(LogError, match=r"5 columns without names \(column 1.* run.* such as 'time: 1'") as refused:
        read_log(path)
    assert refused.value.mends.startswith("time: 1\n")
    log = mapped(path, BY_NUMBER)
    assert_right(log)
    assert log.entries["time"].source == "column 1"  # type: ignore[union-attr]


def test_a_column_of_one_of_several_matrices_is_the_time_by_its_name(tmp_path: Path):
    path = tmp_path / "log.mat"
    savemat(path, {"xout": table(t=TIME).to_numpy(), "other": np.ones((300, 3))})
    with pytest.raises(LogError, match=r"'time: other\[0\]'|'time: xout\[0\]'"):
        read_log(path)
    log = mapped(path, "time: xout[0]\nx: xout[1]\ny: xout[2]\npsi: xout[3]\nu: xout[4]\n")
    assert_right(log)


def test_a_structured_array_names_its_columns(tmp_path: Path):
    path = tmp_path / "log.npy"
    np.save(path, table(t=TIME).to_records(index=False))
    assert_right(read_log(path))


@pytest.mark.parametrize("packed", [False, True])
def test_utf_16_is_read(packed: bool, tmp_path: Path):
    path = written(tmp_path, table(t=TIME), sep="\t")
    text = path.read_text().replace("\n", "\r\n").encode("utf-16")
    path.write_bytes(gzip.compress(text) if packed else text)
    assert_right(read_log(path))


@pytest.mark.parametrize("name", ["log.csv", "log.bag", "log.mcap", "log.db3", "log.mat", "log.bin"])
def test_a_git_lfs_pointer_is_called_one(name: str, tmp_path: Path):
    path = tmp_path / name
    path.write_text(f"version https://git-lfs.github.com/spec/v1\noid sha256:{'0' * 64}\nsize 48312345\n")
    with pytest.raises(LogError, match=r"a Git LFS pointer: it stands for a file of 48\.312 MB .* 'git lfs pull'"):
        read_log(path)


def test_a_pointer_in_the_folder_of_a_bag_is_called_one(tmp_path: Path):
    (tmp_path / "bag_0.db3").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12\n")
    with pytest.raises(LogError, match="a Git LFS pointer"):
        read_log(tmp_path)


def test_a_map_names_the_time_and_its_unit(tmp_path: Path):
    path = written(tmp_path, table(clk=1e3 * TIME))
    with pytest.raises(LogError, match=r"'clk' runs forward as one does.*'time: clk'") as refused:
        read_log(path)
    assert refused.value.mends == "time: clk\n"
    assert_right(mapped(path, "time: {from: clk, unit: ms}\n"))
    assert_right(mapped(path, "time: {from: clk, scale: 0.001}\n"))
    with pytest.raises(LogError, match="takes time from 'clock', which is not among clk, x"):
        mapped(path, "time: clock\n")
    for wrong in ("{from: clk, scale: 0}", "{from: clk, offset: 1}", "{from: clk, frame: enu}"):
        with pytest.raises(LogError, match="'time' needs a scale above 0"):
            mapped(path, f"time: {wrong}\n")
    with pytest.raises(LogError, match=r"is a channel in s; expected a unit that fits it \(s, ms, us, ns, min, h\)"):
        mapped(path, "time: {from: clk, unit: deg}\n")


def test_a_map_of_the_time_is_refused_where_messages_have_stamps(tmp_path: Path):
    path = nameless(tmp_path, ".csv").with_suffix(".mcap")
    path.write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(LogError, match="but MCAP has the time in its messages"):
        mapped(path, "time: clk\n")


def test_the_map_in_use_keeps_the_time(tmp_path: Path):
    log = mapped(written(tmp_path, table(clk=1e3 * TIME)), "time: {from: clk, unit: ms}\n")
    assert next(iter(log.entries)) == "time"
    assert log.clock == "clk"


def test_a_long_table_and_a_parquet_file_tell_the_column_that_runs(tmp_path: Path):
    long = table(clk=TIME).melt("clk", var_name="field").assign(topic="boat").sort_values("clk", kind="stable")
    with pytest.raises(LogError, match="'time: clk'"):
        read_log(written(tmp_path, long))
    path = tmp_path / "log.parquet"
    table(clk=TIME).to_parquet(path)
    with pytest.raises(LogError, match="'time: clk'"):
        read_log(path)
    assert_right(mapped(path, "time: clk\n"))
