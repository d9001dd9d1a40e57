"""Recordings of BlueOS: MAVLink as JSON gives the motion of the world that it holds, also torn."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blueos_files import BOOT, START, heartbeat, messages_of, write_blueos
from dataflash_files import SERVOS
from json_files import Text, write_json
from logged import note
from round_trip import assert_equal, expected, motion_of, world
from verbs import inspected

from undertow.measurements.formats.autopilots.mavlink import JsonTelemetry
from undertow.measurements.formats.base import Request
from undertow.measurements.log import Log, read_log
from undertow.physics.errors import LogError

NEAR = {"position": 1e-5, "heading": 1e-6, "speed": 1e-6, "rate": 1e-6, "command": 0.51}
"""Single precision on the wire, and pulses in whole microseconds."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("blueos")
    return write_blueos(folder / "recorder_20260501_101010.mcap", messages_of(world()))


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return expected(tmp_path_factory.mktemp("csv"))


def told(log: Log, start: str) -> str:
    return note(log, start)


def test_a_recording_is_the_same_motion(recording: Path, truth):
    assert_equal(motion_of(recording), truth, **NEAR)


def test_unpacked_messages_are_the_same(recording: Path, tmp_path: Path):
    plain = write_blueos(tmp_path / "plain.mcap", messages_of(world()), packed=False)
    first, second = read_log(recording), read_log(plain)
    for name, channel in first.channels.items():
        assert np.array_equal(channel.value, second.channels[name].value)


def test_what_the_boat_is_beside_is_kept(recording: Path):
    log = read_log(recording)
    assert set(log.auxiliary) == {"battery_voltage", "battery_current", "mode"}
    assert log.auxiliary["battery_voltage"].value[0] == pytest.approx(16.5)
    assert log.auxiliary["battery_current"].value[0] == pytest.approx(3.0)
    assert set(log.auxiliary["mode"].value) == {0.0, 10.0}
    assert "battery_voltage" in told(log, "kept beside motion and commands")


def test_the_first_half_of_a_torn_recording_is_read(recording: Path, truth, tmp_path: Path):
    content = recording.read_bytes()
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(content[: len(content) // 2])
    log = read_log(torn)
    assert "breaks off" in told(log, "the file")
    u = log.channels["u"]
    assert 0.3 * truth.duration < u.time[-1] - u.time[0] < 0.7 * truth.duration
    whole = read_log(recording).channels["u"]
    assert np.array_equal(u.value, whole.value[: u.value.size])
    assert "what was recorded after it is lost" in " ".join(inspected("inspect", torn).split())


def test_positions_of_the_globe_are_metres(truth, tmp_path: Path):
    path = write_blueos(tmp_path / "log.mcap", messages_of(world(), local=False))
    found = motion_of(path)
    assert np.abs(found.position - found.position[0] - (truth.position - truth.position[0])).max() < 0.05
    assert np.abs(found.velocity[:, :2] - truth.velocity[:, :2]).max() < 0.01


def test_fixes_of_the_receiver_alone_are_metres(truth, tmp_path: Path):
    def satellites():
        for received, name, fields in messages_of(world(), local=False):
            if name != "GLOBAL_POSITION_INT":
                yield received, name, fields
                continue
            speed = float(np.hypot(fields["vx"], fields["vy"]))
            course = round(np.degrees(np.arctan2(fields["vy"], fields["vx"])) % 360.0 * 100.0) % 36000
            fix = {"fix_type": {"type": "GPS_FIX_TYPE_3D_FIX"}, "vel": round(speed), "cog": course}
            place = {"lat": fields["lat"], "lon": fields["lon"], "time_usec": 1000 * fields["time_boot_ms"]}
            yield received, "GPS_RAW_INT", place | fix

    found = motion_of(write_blueos(tmp_path / "log.mcap", satellites()))
    assert np.abs(found.position - found.position[0] - (truth.position - truth.position[0])).max() < 0.05
    assert np.abs(found.velocity[:, 0] - truth.velocity[:, 0]).max() < 0.02


def test_texts_flags_and_enumerations_are_read_in_every_spelling(tmp_path: Path):
    def spelt():
        for received, name, fields in messages_of(world()):
            if name == "PARAM_VALUE":
                fields = {**fields, "param_id": "".join(fields["param_id"]).rstrip("\0")}
            if name == "HEARTBEAT":
                fields = {**fields, "base_mode": "MAV_MODE_FLAG_SAFETY_ARMED | MAV_MODE_FLAG_CUSTOM_MODE_ENABLED"}
            yield received, name, fields

    log = read_log(write_blueos(tmp_path / "log.mcap", spelt()))
    assert {"pwm_port", "pwm_stbd"} <= set(log.channels)
    assert not any("no JSON of MAVLink" in each for each in log.notes)
    rows = JsonTelemetry(Request())
    topic = rows.connect("mavlink/1/1/HEARTBEAT")
    assert topic is not None
    for mode in ({"bits": 129}, "MAV_MODE_FLAG_SAFETY_ARMED | MAV_MODE_FLAG_CUSTOM_MODE_ENABLED"):
        topic.take(1, json.dumps({"message": {**heartbeat(0), "base_mode": mode}}).encode())
    body, _ = rows.rows((1, 1, 0))
    assert body["base_mode"].tolist() == [129, 129]
    assert body["type"].tolist() == [11, 11]


def test_without_parameters_outputs_that_move_have_numbers(tmp_path: Path):
    messages = (message for message in messages_of(world()) if message[1] != "PARAM_VALUE")
    log = read_log(write_blueos(tmp_path / "log.mcap", messages))
    assert {"pwm_1", "pwm_3"} == {name for name in log.channels if name.startswith("pwm")}
    assert "those that move have their numbers: pwm_1, pwm_3" in told(log, "no parameter SERVOn_FUNCTION")


def test_the_steering_of_a_boat_with_a_rudder_is_kept(tmp_path: Path):
    servos = {**SERVOS, "SERVO1_FUNCTION": 26, "SERVO3_FUNCTION": 70}
    log = read_log(write_blueos(tmp_path / "log.mcap", messages_of(world(), servos)))
    assert "pwm_throttle" in log.channels
    assert log.auxiliary["steering_ground"].time.size == log.channels["pwm_throttle"].time.size


def test_broken_messages_are_counted(tmp_path: Path):
    def some_broken():
        for k, (received, name, fields) in enumerate(messages_of(world())):
            wrong = name == "ATTITUDE" and k % 50 == 0
            yield received, name, {**fields, "yaw": "north"} if wrong else fields

    log = read_log(write_blueos(tmp_path / "log.mcap", some_broken()))
    assert "messages that are no JSON of MAVLink left out" in told(log, "ATTITUDE: ")
    assert np.isfinite(log.channels["psi"].value).all()


def test_other_topics_are_on_the_same_clock(tmp_path: Path):
    times = np.arange(0.0, 20.0, 0.5)
    begin = BOOT + START * 1_000_000
    found = [
        Text(
            "mavlink/1/1/ATTITUDE",
            {"message": {"type": "ATTITUDE", "time_boot_ms": START + round(1000 * t), "yaw": 0.1 * t, "yawspeed": 0.1}},
            begin + round(1e9 * t),
        )
        for t in times
    ]
    found += [Text("dvl/velocity", {"u": float(t)}, begin + round(1e9 * t)) for t in times]
    found += [Text("mavlink/out", {"message": {"type": "ATTITUDE"}}, begin + round(1e9 * t)) for t in times]
    log = read_log(write_json(tmp_path / "log.mcap", sorted(found, key=lambda message: message.received)))
    np.testing.assert_allclose(log.channels["u"].time, log.channels["psi"].time, atol=2e-3)
    np.testing.assert_allclose(log.channels["psi"].time, START / 1000.0 + times, atol=1e-6)


def test_a_recording_without_a_vehicle_is_refused_in_words(tmp_path: Path):
    found = [Text("mavlink/1/1/ATTITUDE", b"{broken", BOOT)]
    with pytest.raises(LogError, match="no channel is recognised"):
        read_log(write_json(tmp_path / "log.mcap", found))


def test_two_vehicles_are_told_apart(tmp_path: Path):
    messages = [Text(f"mavlink/{system}/1/ATTITUDE", {"message": {"type": "ATTITUDE", "time_boot_ms": 1000 * k,
                "yaw": 0.01 * k * system, "yawspeed": 0.01}}, BOOT + 10**9 * k)
                for k in range(30) for system in (1, 2)]  # fmt: skip
    log = read_log(write_json(tmp_path / "log.mcap", messages))
    assert "2 vehicles in the log: sys1, sys2" in told(log, "2 vehicles")
    assert replace(log).channels["psi"].origin.startswith("sys1/")
