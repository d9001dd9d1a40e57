"""MAVLink telemetry logs: a world recorded by a ground station is the same motion when it is read."""

import struct

import numpy as np
import pytest
from dataflash_files import SERVOS
from pymavlink.dialects.v20 import ardupilotmega
from round_trip import assert_equal, expected, motion_of, world
from telemetry_files import BOOT, START, Writer, telemetry_of

from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError

FORMAT = {"position": 1e-5, "heading": 1e-6, "speed": 1e-6, "rate": 1e-6, "command": 0.51}
"""Single precision, whole microseconds; the stamps of the vehicle are whole milliseconds, as the world's are."""


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return expected(tmp_path_factory.mktemp("csv"))


@pytest.fixture(scope="module")
def content():
    return bytes(telemetry_of(world()).content)


def saved(folder, data):
    path = folder / "flight.tlog"
    path.write_bytes(bytes(data))
    return path


def told(log, start):
    return next(note for note in log.notes if note.startswith(start))


def test_a_world_recorded_as_telemetry_is_the_same_motion(content, truth, tmp_path):
    assert_equal(motion_of(saved(tmp_path, content)), truth, **FORMAT)


def test_positions_in_degrees_become_metres(truth, tmp_path):
    path = saved(tmp_path, telemetry_of(world(), local=False).content)
    coarse = FORMAT | {"position": 0.02, "speed": 0.0072}  # 1e-7 degrees, and whole cm/s on two axes
    assert_equal(motion_of(path), truth, **coarse)
    assert "GLOBAL_POSITION_INT" in told(read_log(path), "x y u v")


def test_a_vehicle_without_a_fix_is_not_off_africa(tmp_path):
    writer = Writer()
    for row in range(200):
        stamp = 1000 + 100 * row
        place = (600_000_000 + 10 * row, 100_000_000) if row >= 50 else (0, 0)
        received = BOOT + 1000 * stamp
        writer.add(received, ardupilotmega.MAVLink_attitude_message(stamp, 0.0, 0.0, 0.1, 0.0, 0.0, 0.01))
        message = ardupilotmega.MAVLink_global_position_int_message(stamp, *place, 0, 0, 100, 0, 0, 65535)
        writer.add(received, message)
    log = read_log(saved(tmp_path, writer.content))
    assert log.channels["x"].time.size == log.channels["u"].time.size == 150
    assert log.channels["x"].value[[0, -1]] == pytest.approx([0.0, 16.6], abs=0.1)
    assert "50 rows without a fix (0 degrees both) left out" in told(log, "x y u v")


def test_the_vehicles_clock_is_used_and_not_the_time_of_receipt(content, tmp_path):
    log = read_log(saved(tmp_path, content))
    assert log.channels["u"].time[0] == START / 1000
    assert np.diff(log.channels["pwm_port"].time) == pytest.approx(0.1, abs=1e-9)
    assert log.channels["ax"].value[0] == pytest.approx(0.0980665)


def test_a_vehicle_that_restarts_is_read_by_the_time_of_receipt(tmp_path):
    writer = Writer()
    for row in range(200):
        stamp = 1000 + 100 * (row if row < 100 else row - 100)
        received = BOOT + 100_000 * row
        writer.add(received, ardupilotmega.MAVLink_attitude_message(stamp, 0.0, 0.0, 0.1, 0.0, 0.0, 0.01))
    log = read_log(saved(tmp_path, writer.content))
    assert told(log, "the clock of the vehicle starts anew")
    assert log.channels["psi"].time == pytest.approx(0.1 * np.arange(200), abs=1e-6)


def test_a_clock_of_32_bits_may_turn_over(tmp_path):
    writer = Writer()
    for row in range(100):
        stamp = 4_294_000 + 100 * row  # the output's clock turns over after 4 294 967 296 us
        received = BOOT + 1000 * stamp
        writer.add(received, ardupilotmega.MAVLink_attitude_message(stamp, 0.0, 0.0, 0.1, 0.0, 0.0, 0.01))
        output = ardupilotmega.MAVLink_servo_output_raw_message(1000 * stamp % 2**32, 0, 1500, 0, 1600, *[0] * 13)
        writer.add(received, output)
    for name, value in SERVOS.items():
        writer.add(received, ardupilotmega.MAVLink_param_value_message(name.encode(), float(value), 9, 9, 0))
    log = read_log(saved(tmp_path, writer.content))
    assert np.diff(log.channels["pwm_port"].time) == pytest.approx(0.1, abs=1e-9)
    assert not [note for note in log.notes if "clock" in note]


def test_of_two_vehicles_one_must_be_chosen(tmp_path, truth):
    first = telemetry_of(world(20.0), Writer(2))
    both = telemetry_of(world(), Writer(1, first.content))
    path = saved(tmp_path, both.content)
    with pytest.raises(LogError, match="got 2: /sys1, /sys2"):
        read_log(path)
    one, two = read_log(path, Reading(namespace="sys1")), read_log(path, Reading(namespace="sys2"))
    assert one.channels["u"].time.size == truth.time.size
    assert two.channels["u"].time.size == 401
    assert {channel.origin.split("/")[0] for channel in two.channels.values()} == {"sys2"}


def test_a_ground_station_in_the_log_is_no_vehicle(content, truth, tmp_path):
    station = Writer(255)
    station.add(BOOT, ardupilotmega.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    path = saved(tmp_path, bytes(station.content) + content)
    assert_equal(motion_of(path), truth, **FORMAT)
    assert "sys255/comp1/HEARTBEAT:autopilot" in read_log(path).unused


def test_without_parameters_no_output_is_a_command(tmp_path):
    log = read_log(
        saved(tmp_path, telemetry_of(world(20.0), servos=SERVOS | {"SERVO1_FUNCTION": 0, "SERVO3_FUNCTION": 0}).content)
    )
    assert not [name for name in log.channels if name.startswith("pwm")]
    assert "SERVO_OUTPUT_RAW:servo1_raw" in told(log, "no parameter SERVOn_FUNCTION")


def test_a_reversed_output_is_mirrored(truth, tmp_path):
    servos = SERVOS | {"SERVO1_REVERSED": 1}
    assert_equal(motion_of(saved(tmp_path, telemetry_of(world(), servos=servos).content)), truth, **FORMAT)


def test_a_truncated_log_is_read_up_to_the_break(content, tmp_path):
    log = read_log(saved(tmp_path, content[: len(content) // 2]))
    assert told(log, "the file breaks off")
    assert log.channels["u"].time[-1] == pytest.approx(50.0, abs=1.0)


def test_messages_with_a_wrong_checksum_are_left_out_and_counted(content, truth, tmp_path):
    data = bytearray(content)
    at = data.find(struct.pack("<I", START + 30_000))  # a stamp in the payload of an ATTITUDE
    data[at + 12] ^= 0x40
    log = read_log(saved(tmp_path, data))
    assert told(log, "ATTITUDE: 1 messages with a wrong checksum")
    assert log.channels["psi"].time.size == truth.time.size - 1


def test_garbage_in_between_is_skipped_and_told(content, truth, tmp_path):
    middle = len(content) // 2
    log = read_log(saved(tmp_path, content[:middle] + bytes(range(256)) * 4 + content[middle:]))
    assert "are no message; they were skipped" in " ".join(log.notes)
    assert log.channels["u"].time.size >= truth.time.size - 2


def test_a_log_of_a_ground_station_alone_is_refused(tmp_path):
    writer = Writer(255)
    for row in range(5):
        writer.add(BOOT + row, ardupilotmega.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    with pytest.raises(LogError, match="Was the vehicle connected"):
        read_log(saved(tmp_path, writer.content))
