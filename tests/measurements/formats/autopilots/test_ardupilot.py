"""ArduPilot's DataFlash logs: a world written as the autopilot writes it is the same motion when it is read."""

import sys

import numpy as np
import pytest
from dataflash_files import MESSAGES, SERVOS, START, Writer, dataflash_of, write
from round_trip import assert_equal, expected, motion_of, world

from undertow.measurements.canonical import Output
from undertow.measurements.formats.autopilots import dataflash
from undertow.measurements.formats.registry import read_recording
from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError

YAW = np.radians(0.005) + 1e-7
"""Half a step of a heading in hundredths of a degree [rad]."""
FORMAT = {"position": 1e-5, "heading": YAW, "speed": 2.0 * YAW, "rate": 1e-6, "command": 0.51}
"""Single precision, whole microseconds; speeds turn with the heading."""


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return expected(tmp_path_factory.mktemp("csv"))


@pytest.fixture(scope="module")
def content():
    return bytes(dataflash_of(world()).content)


def saved(folder, data, name="00000012.BIN"):
    path = folder / name
    path.write_bytes(bytes(data))
    return path


def told(log, start):
    return next(note for note in log.notes if note.startswith(start))


def test_a_world_written_as_dataflash_is_the_same_motion(content, truth, tmp_path):
    assert_equal(motion_of(saved(tmp_path, content)), truth, **FORMAT)


def test_a_world_written_as_text_is_the_same_motion(truth, tmp_path):
    assert_equal(motion_of(write(tmp_path / "12.log", dataflash_of(world()))), truth, **FORMAT)


def test_the_primary_core_and_its_imu_are_chosen_and_named(content, tmp_path):
    log = read_log(saved(tmp_path, content))
    assert "XKF1[1], the primary core" in told(log, "psi x y u v")
    assert "IMU[1]" in told(log, "r ax ay")
    assert log.channels["ax"].value[0] == pytest.approx(0.1)
    assert log.channels["ay"].value[0] == pytest.approx(-0.2)


def test_without_units_in_the_log_sensors_are_told_by_the_usual_names(truth, tmp_path):
    writer = dataflash_of(world(), Writer(units=False))
    assert_equal(motion_of(saved(tmp_path, writer.content)), truth, **FORMAT)


def test_a_reversed_output_is_mirrored_about_its_trim_and_its_range_is_told(truth, tmp_path):
    servos = SERVOS | {"SERVO1_REVERSED": 1, "SERVO1_TRIM": 1510, "SERVO1_MIN": 1100, "SERVO1_MAX": 1950}
    path = saved(tmp_path, dataflash_of(world(), servos=servos).content)
    raw = read_recording(path).streams
    sent = next(stream for stream in raw if stream.name == "RCOU:C1")
    log = read_log(path)
    ahead = log.channels["pwm_stbd"]
    assert np.array_equal(ahead.value, 3020.0 - sent.value)
    assert sent.value.min() < 1400 < 1600 < ahead.value.max()
    note = told(log, "pwm_stbd")
    assert "neutral 1510 us, full astern 1070 us, full ahead 1920 us" in note
    assert "reversed" in note
    assert "3020 us - value" in note
    assert ahead.output == Output(
        1510.0, 1070.0, 1920.0, "SERVO1_MIN 1100, SERVO1_TRIM 1510, SERVO1_MAX 1950, SERVO1_REVERSED 1"
    )
    assert_equal(motion_of(path), truth, **FORMAT)


def test_outputs_without_pulses_are_neutral_and_counted(tmp_path):
    writer = Writer()
    writer.parameters(SERVOS | {"SERVO3_TRIM": 1510})
    for row in range(10):
        writer.add("RCOU", START + 100_000 * row, *[0, 0, 0 if row < 4 else 1700], *[0] * 11)
        writer.add("ATT", START + 100_000 * row, *[0.0] * 5, 10.0, 0.0, 0.0, 3)
    log = read_log(saved(tmp_path, writer.content))
    assert log.channels["pwm_port"].value.tolist() == [1510.0] * 4 + [1700.0] * 6
    assert "4 rows without pulses (disarmed) taken as neutral" in told(log, "pwm_port")


def test_outputs_whose_function_is_unknown_are_no_commands_but_can_be_mapped(tmp_path):
    path = saved(tmp_path, dataflash_of(world(), servos=SERVOS | {"SERVO1_FUNCTION": 0, "SERVO3_FUNCTION": 26}).content)
    log = read_log(path)
    assert not [name for name in log.channels if name.startswith("pwm")]
    assert "map them" in told(log, "no parameter SERVOn_FUNCTION")
    assert "RCOU:C3" in log.unused
    chosen = tmp_path / "map.yaml"
    chosen.write_text('pwm_port: "RCOU:C3"\npwm_stbd: "RCOU:C1"\n')
    assert set(read_log(path, Reading(channel_map=chosen)).channels) >= {"pwm_port", "pwm_stbd", "u"}


def test_a_parameter_that_changes_on_the_way_is_told(tmp_path):
    writer = Writer()
    writer.parameters(SERVOS)
    dataflash_of(world(), writer, SERVOS | {"SERVO3_TRIM": 1510})
    log = read_log(saved(tmp_path, writer.content))
    assert "1500, 1510" in told(log, "SERVO3_TRIM changes")
    assert "neutral 1510 us" in told(log, "pwm_port")


def test_the_gyro_bias_that_the_filter_estimates_is_taken_off(tmp_path):
    writer = Writer()
    for row in range(20):
        stamp = START + 100_000 * row
        writer.add("XKF1", stamp, 0, 0.0, 0.0, 10.0, *[0.0] * 9, 1.5, 0.0)
        writer.add("IMU", stamp, 0, 0.0, 0.0, 0.2, 0.0, 0.0, -9.8, 0, 0, 30.0, 1, 1, 1000, 1000)
    log = read_log(saved(tmp_path, writer.content))
    assert log.channels["r"].value == pytest.approx(0.2 - np.radians(1.5))
    assert "less the gyro bias XKF1[0]:GZ" in told(log, "r:")


def test_a_log_without_filter_is_read_from_gps_and_compass(tmp_path):
    writer = Writer()
    for row in range(40):
        stamp, fixed = START + 200_000 * row, row >= 5
        writer.add("ATT", stamp, *[0.0] * 5, 350.0 + 0.5 * row if row < 20 else 0.5 * row - 10.0, 0.0, 0.0, 0)
        for receiver, used in ((0, 0), (1, 1)):
            latitude = 60.0 + 1e-5 * row * used
            speed, course = (2.0, 90.0) if used else (9.0, 0.0)
            status = 3 if fixed else 1
            fix = (receiver, status, 0, 0, 9, 1.0, latitude, 10.0, 0.0, speed, course, 0.0, 0.0, used)
            writer.add("GPS", stamp, *fix)
    log = read_log(saved(tmp_path, writer.content))
    assert "GPS[1]" in told(log, "x y u v")
    assert "5 rows without a fix left out" in told(log, "x y u v")
    assert log.channels["x"].time.size == 35
    assert np.diff(log.channels["x"].value) == pytest.approx(1.1142, abs=0.002)
    # Course east at 2 m/s, heading 352.5 degrees at first: ahead 2 sin(-7.5 deg), nearly all to starboard.
    assert log.channels["u"].value[0] == pytest.approx(2.0 * np.cos(np.radians(90.0 - 352.5)), abs=1e-6)
    assert log.channels["v"].value[0] == pytest.approx(2.0 * np.sin(np.radians(90.0 - 352.5)), abs=1e-6)


@pytest.mark.parametrize("lost", [1, 30, 1000])
def test_a_truncated_log_is_read_up_to_the_break(content, lost, tmp_path):
    log = read_log(saved(tmp_path, content[: len(content) // 2 - lost]))
    assert told(log, "the file breaks off")
    assert log.channels["u"].time[-1] == pytest.approx(40.0, abs=0.5)


def test_the_unfilled_last_page_is_no_break(content, tmp_path):
    for padding in (b"\xff" * 200, b"\0" * 528):
        log = read_log(saved(tmp_path, content + padding))
        assert not [note for note in log.notes if "breaks off" in note]


def test_damage_in_the_middle_is_skipped_and_told(content, truth, tmp_path):
    middle = len(content) // 2
    log = read_log(saved(tmp_path, content[:middle] + bytes(700) + content[middle + 700 :]))
    assert told(log, "7")
    assert "are no message; they were skipped" in " ".join(log.notes)
    assert log.channels["u"].time.size > 0.98 * truth.time.size
    assert log.channels["u"].time[-1] == pytest.approx(70.0)


def test_a_message_of_an_unknown_type_does_not_end_the_process(content, tmp_path):
    garbage = b"\xa3\x95\xf7" + bytes(20)
    log = read_log(saved(tmp_path, content[:-500] + garbage + content[-500:]))
    assert log.channels["u"].time[-1] == pytest.approx(70.0, abs=0.2)


def test_a_few_damaged_stamps_are_left_out(content, truth, tmp_path):
    writer = Writer()
    place = len(writer.content)
    dataflash_of(world(), writer)
    data = bytearray(writer.content)
    number = MESSAGES["XKF1"][0]
    at = data.find(b"\xa3\x95" + bytes([number]), place + len(data) // 2)
    data[at + 8] = 0x7F  # 2^47 us
    log = read_log(saved(tmp_path, data))
    assert log.channels["psi"].time.size >= truth.time.size - 1


def test_a_log_that_breaks_off_before_the_boat_is_refused(content, tmp_path):
    with pytest.raises(LogError, match="breaks off before the boat was logged"):
        read_log(saved(tmp_path, content[:900]))


def test_a_log_that_starts_anew_half_way_is_refused_clearly(content, tmp_path):
    with pytest.raises(LogError, match="time runs backwards in"):
        read_log(saved(tmp_path, content + content))


def test_only_what_is_asked_for_is_unpacked(content, tmp_path):
    recording = read_recording(saved(tmp_path, content))
    everything = {stream.name for stream in recording.streams}
    assert {"RCOU:C14", "ATT:Yaw", "XKF1[0]:GX"} <= everything
    assert not {name for name in everything if "TimeUS" in name}
    log = read_log(tmp_path / "00000012.BIN")
    assert "ATT:Yaw" in log.unused


def test_the_characters_of_fields_are_those_of_pymavlink():
    reader = pytest.importorskip("pymavlink.DFReader")
    own = {one: (code, dataflash._DIVISORS.get(one, 1.0)) for one, code in dataflash._NUMBERS.items()}
    own |= {one: (f"{size}s", 1.0) for one, size in dataflash._TEXTS.items()}
    theirs = reader.FORMAT_TO_STRUCT.items()
    assert own == {one: (code, 1.0 if scale is None else round(1.0 / scale)) for one, (code, scale, _) in theirs}


def test_a_log_is_read_without_pymavlink(content, truth, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymavlink", None)
    monkeypatch.setitem(sys.modules, "pymavlink.DFReader", None)
    assert_equal(motion_of(saved(tmp_path, content)), truth, **FORMAT)
