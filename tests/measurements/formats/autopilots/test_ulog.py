"""PX4's ULog: a world written as the autopilot writes it is the same motion when it is read."""

import struct

import numpy as np
import pytest
from round_trip import assert_equal, expected, motion_of, world
from ulog_files import PARAMETERS, START, Writer, ulog_of

from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError

FORMAT = {"position": 1e-5, "heading": 1e-6, "speed": 1e-6, "rate": 1e-6, "command": 1e-3}
"""Single precision."""


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return expected(tmp_path_factory.mktemp("csv"))


@pytest.fixture(scope="module")
def content():
    return bytes(ulog_of(world()).content)


def saved(folder, data):
    path = folder / "log_3.ulg"
    path.write_bytes(bytes(data))
    return path


def told(log, start):
    return next(note for note in log.notes if note.startswith(start))


def test_a_world_written_as_ulog_is_the_same_motion(content, truth, tmp_path, capfd):
    assert_equal(motion_of(saved(tmp_path, content)), truth, **FORMAT)
    assert capfd.readouterr() == ("", "")


def test_measurements_count_from_the_sample_and_commands_from_when_they_were_given(content, tmp_path):
    log = read_log(saved(tmp_path, content))
    assert log.channels["u"].time[0] == log.channels["normalized_port"].time[0] == START / 1e6


def test_shares_of_thrust_and_pulses_are_both_there_by_side(content, tmp_path):
    channels = read_log(saved(tmp_path, content)).channels
    assert channels["normalized_port"].value == pytest.approx((channels["pwm_port"].value - 1500.0) / 500.0, abs=1e-6)
    assert {"normalized_stbd", "pwm_stbd"} <= set(channels)


def test_where_no_parameter_tells_the_sides_motors_have_numbers(tmp_path):
    without = {name: value for name, value in PARAMETERS.items() if not name.startswith("CA_ROTOR")}
    log = read_log(saved(tmp_path, ulog_of(world(20.0), Writer(without)).content))
    assert {"normalized_motor1", "normalized_motor2", "pwm_motor1"} <= set(log.channels)
    assert "does not say on which side" in told(log, "the log does not say")


def test_a_reversed_output_is_mirrored_about_the_middle_of_its_range(content, tmp_path):
    parameters = PARAMETERS | {"PWM_MAIN_REV": 2, "PWM_MAIN_MIN2": 1100, "PWM_MAIN_MAX2": 1880}
    log = read_log(saved(tmp_path, ulog_of(world(20.0), Writer(parameters)).content))
    plain = read_log(saved(tmp_path, ulog_of(world(20.0)).content))
    assert log.channels["pwm_port"].value == pytest.approx(2980.0 - plain.channels["pwm_port"].value)
    assert "neutral 1490 us" in told(log, "pwm_port")
    assert np.array_equal(log.channels["pwm_stbd"].value, plain.channels["pwm_stbd"].value)


def test_a_motor_that_goes_ahead_only_is_neutral_at_its_least_output(tmp_path):
    log = read_log(saved(tmp_path, ulog_of(world(20.0), Writer(PARAMETERS | {"CA_R_REV": 0})).content))
    assert "neutral 1000 us" in told(log, "pwm_port")


def test_disarmed_motors_are_at_rest_and_counted(tmp_path):
    writer = Writer()
    nothing = [float("nan")] * 10
    for row in range(10):
        stamp = START + 100_000 * row
        share = [float("nan")] * 2 if row < 3 else [0.5, -0.5]
        writer.add("actuator_motors", stamp, stamp, *share, *nothing)
        writer.add("vehicle_attitude", stamp, stamp, 1.0, 0.0, 0.0, 0.0)
    log = read_log(saved(tmp_path, writer.content))
    assert log.channels["normalized_port"].value.tolist() == [0.0] * 3 + [-0.5] * 7
    assert "3 rows without a number (stopped)" in told(log, "normalized_port")


def test_positions_that_the_filter_calls_invalid_are_left_out(tmp_path):
    writer = Writer()
    for row in range(10):
        stamp = START + 100_000 * row
        writer.add("vehicle_local_position", stamp, stamp, 1.0, 2.0, 0.3, 0.4, row > 3, row > 1)
        writer.add("vehicle_attitude", stamp, stamp, 1.0, 0.0, 0.0, 0.0)
    log = read_log(saved(tmp_path, writer.content))
    assert log.channels["x"].time.size == 6
    assert log.channels["u"].time.size == 8
    assert "4 rows that it calls invalid" in told(log, "x y u v")


def test_an_attitude_that_was_never_set_is_no_heading(tmp_path):
    writer = Writer()
    for row in range(10):
        stamp = START + 100_000 * row
        writer.add("vehicle_attitude", stamp, stamp, *((0.0,) * 4 if row < 3 else (0.8, 0.0, 0.0, 0.6)))
    log = read_log(saved(tmp_path, writer.content))
    assert log.channels["psi"].value == pytest.approx([2.0 * np.arctan2(0.6, 0.8)] * 7)
    assert "3 rows that are all zero left out" in told(log, "psi")


def test_setpoints_are_no_measurements_but_can_be_mapped(content, tmp_path):
    path = saved(tmp_path, content)
    assert read_log(path).channels["x"].value.max() < 70.0
    assert "vehicle_local_position_setpoint:raw.x" in read_log(path).unused
    chosen = tmp_path / "map.yaml"
    chosen.write_text('x: "vehicle_local_position_setpoint:raw.x"\n')
    assert set(read_log(path, Reading(channel_map=chosen)).channels["x"].value) == {77.0}


def test_a_truncated_log_is_read_up_to_the_break(content, tmp_path):
    for lost in (1, 2, 40, 5000):
        log = read_log(saved(tmp_path, content[: len(content) // 2 - lost]))
        assert told(log, "the file breaks off")
        assert log.channels["u"].time[-1] == pytest.approx(35.0, abs=2.0)
    assert not [note for note in read_log(saved(tmp_path, content)).notes if "breaks off" in note]


def test_damage_in_the_middle_is_told(content, tmp_path, capfd):
    middle = len(content) // 2
    log = read_log(saved(tmp_path, content[:middle] + bytes(64) + content[middle + 64 :]))
    assert told(log, "the file is damaged")
    assert log.channels["u"].time[0] == START / 1e6
    assert capfd.readouterr() == ("", "")


def test_dropouts_of_the_logger_are_told(tmp_path):
    writer = ulog_of(world(20.0))
    writer.message("O", struct.pack("<H", 1500))
    writer.message("O", struct.pack("<H", 500))
    assert told(read_log(saved(tmp_path, writer.content)), "2 dropouts of the autopilot's logger, 2.0 s in all")


def test_nested_definitions_cannot_fill_the_memory(tmp_path):
    bomb = {"a": "uint64_t timestamp;float[60000] v;", "b": "uint64_t timestamp;a[60000] v;"}
    with pytest.raises(LogError, match=r"log_3\.ulg"):
        read_log(saved(tmp_path, Writer(formats=bomb).content))


def test_a_length_beyond_the_end_does_not_send_the_reader_in_circles(content, tmp_path):
    beyond = struct.pack("<HB", 60000, 0) + b"x" * 50
    log = read_log(saved(tmp_path, content[:20_000] + beyond))
    assert told(log, "the file breaks off")
    assert log.channels["u"].time.size > 50
    with pytest.raises(LogError, match=r"log_3\.ulg"):
        read_log(saved(tmp_path, content[:600] + beyond))


def test_an_incompatible_log_is_refused(content, tmp_path):
    data = bytearray(content)
    data[16 + 3 + 8] = 0x80
    with pytest.raises(LogError, match="a broken PX4 ULog file"):
        read_log(saved(tmp_path, data))
