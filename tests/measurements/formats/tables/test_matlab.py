"""MATLAB files: vectors beside a time vector are the same motion as the world that they hold."""

import struct
import zlib

import numpy as np
import pytest
from matlab_files import structs_of, write_mat
from round_trip import assert_equal, expected, motion_of, world
from scipy.io import savemat

from undertow.measurements.formats import unpacking
from undertow.measurements.formats.registry import read_recording
from undertow.measurements.log import read_log
from undertow.physics.errors import LogError

EXACT = {"position": 1e-7, "heading": 1e-8, "speed": 1e-7, "rate": 1e-8, "command": 1e-4}
"""Double precision; the long CSV beside it has nine digits."""


def saved(folder, variables, **how):
    return write_mat(folder / "log.mat", variables, **how)


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return expected(tmp_path_factory.mktemp("csv"))


@pytest.mark.parametrize("packed", [False, True])
def test_a_world_saved_as_structs_is_the_same_motion(packed, truth, tmp_path):
    path = saved(tmp_path, structs_of(world()), do_compression=packed)
    assert_equal(motion_of(path), truth, **EXACT)
    assert read_log(path).channels["u"].origin == "boat.nav:u"


def test_a_world_saved_as_plain_vectors_is_the_same_motion(truth, tmp_path):
    log = world()
    held = np.searchsorted(log.command_time, log.odometry_time + 1e-9, side="right") - 1
    rows = {name: log.commands[held, k] for k, name in enumerate(("pwm_port", "pwm_stbd"))}
    columns = dict(zip(("x", "y", "psi", "u", "v", "r"), log.odometry.T, strict=True))
    for form in ("4", "5"):
        path = saved(tmp_path, {"t": log.odometry_time, **columns, **rows, "tag": "sea trial"}, format=form)
        assert_equal(motion_of(path), truth, **EXACT)


def test_simulink_structures_and_series_with_time_and_data_are_read(tmp_path):
    time = np.arange(0.0, 10.0, 0.1)
    simulink = {"time": time, "signals": {"values": np.c_[time, -time], "label": "speeds", "dimensions": 2.0}}
    series = {"u": {"Time": time, "Data": 2.0 * time, "Name": "u"}, "psi": {"Time": time[:50], "Data": time[:50]}}
    streams = read_recording(saved(tmp_path, {"out": simulink, "ts": series})).streams
    found = {stream.name: stream for stream in streams}
    assert set(found) == {"out:speeds[0]", "out:speeds[1]", "ts:u", "ts:psi"}
    assert np.array_equal(found["ts:u"].value, 2.0 * time)
    assert found["ts:psi"].time.size == 50
    assert np.array_equal(found["out:speeds[1]"].value, -time)


def test_a_vector_belongs_to_the_nearest_time_of_its_length(tmp_path):
    coarse, fine = np.arange(0.0, 10.0, 0.5), np.arange(0.0, 10.0, 0.1)
    inner = {"time": fine, "r": fine, "u": coarse}
    streams = read_recording(saved(tmp_path, {"t": coarse, "psi": coarse, "gyro": inner})).streams
    sizes = {stream.name: stream.time.size for stream in streams}
    assert sizes == {"psi": 20, "gyro:r": 100, "gyro:u": 20}


def test_what_is_as_long_as_no_time_vector_is_told(tmp_path):
    time = np.arange(0.0, 10.0, 0.1)
    recording = read_recording(saved(tmp_path, {"t": time, "u": time, "depths": np.arange(7.0), "map": np.eye(5)}))
    assert [stream.name for stream in recording.streams] == ["u"]
    assert recording.notes == ("as long as no time vector, not read: depths 7, map 5x5",)


def test_stamps_since_1970_count_from_the_first(tmp_path):
    stamps = 1_700_000_000_000_000_000 + 100_000_000 * np.arange(50)
    recording = read_recording(saved(tmp_path, {"timestamp_ns": stamps, "u": np.arange(50.0)}))
    assert recording.streams[0].time == pytest.approx(0.1 * np.arange(50), abs=1e-9)
    assert "time counts from the first stamp" in recording.notes[0]


def test_structs_that_count_from_1970_share_one_zero(tmp_path):
    stamps = 1_700_000_000_000_000_003 + 100_000_000 * np.arange(50)
    parts = {"nav": {"timestamp_ns": stamps + 2_500_000_000, "u": np.arange(50.0)}}
    parts |= {"esc": {"timestamp_ns": stamps, "newton_port": np.arange(50.0)}}
    log = read_log(saved(tmp_path, parts))
    assert log.start_ns == stamps[0]
    assert log.channels["newton_port"].time[0] == 0.0
    assert log.channels["u"].time == pytest.approx(2.5 + 0.1 * np.arange(50), abs=1e-9)


def test_a_file_without_time_names_what_it_holds(tmp_path):
    with pytest.raises(LogError, match=r"expected a time vector .* got u 100, v 100"):
        read_log(saved(tmp_path, {"u": np.zeros(100), "v": np.zeros(100)}))


def test_version_7_3_names_the_remedy(tmp_path):
    path = tmp_path / "log.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(LogError, match=r"7\.3 \(HDF5\).*'-v7'"):
        read_log(path)


def test_a_broken_file_is_refused(tmp_path):
    path = saved(tmp_path, structs_of(world()))
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(LogError, match="a broken MATLAB file"):
        read_log(path)


def test_an_element_of_no_known_type_does_not_end_the_process(tmp_path):
    path = write_mat(tmp_path / "log.mat", structs_of(world()))
    data = bytearray(path.read_bytes())
    at = data.find(world().odometry_time.astype("<f8").tobytes()) - 8
    assert data[at] == 9  # miDOUBLE
    data[at] = 0
    path.write_bytes(data)
    with pytest.raises(LogError, match=r"a broken MATLAB file \(an element of type 0\)"):
        read_log(path)


def test_a_packed_variable_that_would_fill_the_memory_is_refused(tmp_path, monkeypatch):
    path = write_mat(tmp_path / "log.mat", {"t": np.arange(10.0)})
    bomb = zlib.compress(bytes(2_000_000))
    path.write_bytes(path.read_bytes()[:128] + struct.pack("<II", 15, len(bomb)) + bomb)
    monkeypatch.setattr(unpacking, "_ALWAYS", 1_000_000)
    monkeypatch.setattr(unpacking, "_MOST_TIMES", 0)
    with pytest.raises(LogError, match="unpacks to more than 1 MB"):
        read_log(path)


def test_small_numbers_that_grow_in_memory_are_counted(tmp_path, monkeypatch):
    path = tmp_path / "log.mat"
    savemat(path, {"t": np.arange(10.0), "u": np.zeros(200_000, np.int8)}, do_compression=True)
    monkeypatch.setattr(unpacking, "_ALWAYS", 1_000_000)
    monkeypatch.setattr(unpacking, "_MOST_TIMES", 0)
    with pytest.raises(LogError, match="hold more than 125000 numbers"):
        read_log(path)


@pytest.mark.parametrize(
    "value", [np.array([[1.0, 2.0, 3.0]], object), np.array([[(1.0, 2.0)] * 3], [("a", "O"), ("b", "O")]), "abc"]
)
def test_a_few_bytes_that_claim_a_large_array_are_refused(tmp_path, value):
    path = tmp_path / "log.mat"
    savemat(path, {"t": np.arange(10.0), "u": np.arange(10.0), "c": value})
    assert "u" in read_log(path).channels
    data = path.read_bytes()
    small, large = (struct.pack("<IIii", 5, 8, 1, many) for many in (3, 2**28))
    assert data.count(small) == 1
    path.write_bytes(data.replace(small, large))
    with pytest.raises(
        LogError, match=r"broken MATLAB file \(a cell array, struct or text of (268435456|536870912) parts"
    ):
        read_log(path)
