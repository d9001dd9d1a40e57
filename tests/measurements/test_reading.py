"""Reading logs: every format, the canonical channels, frames, quaternions, guesses and the channel map."""

import gzip
import re
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from undertow.measurements.canonical import command_kind, is_canonical
from undertow.measurements.formats.registry import FORMATS
from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.measurements.preparation.needs import problems
from undertow.physics.errors import LogError
from undertow.physics.vehicle import load_vehicle

ODOM = "/boat/odometry"
TIME = np.arange(0.0, 30.0, 0.1)


def wide():
    return pd.DataFrame(
        {
            "t": TIME,
            "x": 2.0 * TIME,
            "y": np.sin(TIME),
            "psi": 0.3 * np.cos(TIME),
            "u": 1.0 + 0.1 * np.sin(TIME),
            "v": 0.1 * np.cos(TIME),
            "r": -0.3 * np.sin(TIME),
            "pwm_port": np.where(TIME < 10, 1500, 1700),
            "pwm_stbd": np.where(TIME < 15, 1600, 1400),
        }
    )


def long(frame, topics=None):
    columns = [name for name in frame.columns if name not in ("t", "time", "timestamp_ns")]
    table = frame.melt(id_vars=[frame.columns[0]], value_vars=columns, var_name="field", value_name="value")
    table.insert(1, "topic", table["field"].map(topics) if topics else "/log")
    table = table.rename(columns={"t": "time"})
    return table.sort_values(table.columns[0], kind="stable")


def ros(yaw, u, v_port, r_ccw, east, north):
    """A long table of ROS odometry; the quaternion is deliberately not of unit length."""
    fields = {
        "pose.position.x": east,
        "pose.position.y": north,
        "pose.orientation.x": 0.0 * yaw,
        "pose.orientation.y": 0.0 * yaw,
        "pose.orientation.z": 3.0 * np.sin(yaw / 2),
        "pose.orientation.w": 3.0 * np.cos(yaw / 2),
        "twist.linear.x": u,
        "twist.linear.y": v_port,
        "twist.angular.z": r_ccw,
    }
    frame = pd.DataFrame({"t": TIME, **fields})
    return long(frame, dict.fromkeys(fields, ODOM))


def write(frame, path):
    frame.to_parquet(path, index=False) if path.suffix == ".parquet" else frame.to_csv(path, index=False)
    return path


@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz", "log.parquet"])
@pytest.mark.parametrize("shape", ["wide", "long"])
@pytest.mark.parametrize("stamp", ["t", "time", "timestamp_ns"])
def test_every_format_gives_back_what_was_written(tmp_path, name, shape, stamp):
    frame = wide()
    table = frame.rename(columns={"t": stamp})
    if stamp == "timestamp_ns":
        table[stamp] = np.round(1e9 * TIME).astype(np.int64)
    log = read_log(write(long(table) if shape == "long" else table, tmp_path / name))
    assert list(log.channels) == ["x", "y", "psi", "u", "v", "r", "pwm_port", "pwm_stbd"]
    for channel in log.channels.values():
        np.testing.assert_allclose(channel.time, TIME, atol=1e-9)
        np.testing.assert_allclose(channel.value, frame[channel.name], rtol=1e-12)
    assert not log.notes


def test_a_gzip_file_is_known_by_its_content_and_a_table_by_its_separator(tmp_path):
    path = tmp_path / "renamed.log"
    path.write_bytes(gzip.compress(wide().to_csv(index=False, sep=";").encode("utf-8-sig")))
    assert read_log(path).channels["u"].value.size == TIME.size


def test_formats_are_one_table_without_doubles():
    assert len({form.name for form in FORMATS}) == len(FORMATS)


def test_stamps_since_1970_keep_their_nanoseconds(tmp_path):
    table = wide().rename(columns={"t": "timestamp_ns"})
    table["timestamp_ns"] = 1_700_000_000_000_000_003 + np.round(1e9 * TIME).astype(np.int64)
    log = read_log(write(table, tmp_path / "log.csv"))
    np.testing.assert_allclose(log.channels["u"].time, TIME, atol=1e-12)
    assert any("1700000000000000003" in note for note in log.notes)


def test_ros_odometry_becomes_ned_and_frd(tmp_path):
    # The boat lies east-north-east (ENU yaw 20 degrees), turns to port and slips to port.
    yaw = np.deg2rad(20) + 0.1 * TIME
    one = np.ones_like(TIME)
    log = read_log(write(ros(yaw, 1.5 * one, 0.2 * one, 0.1 * one, 7 * one, -4 * one), tmp_path / "bag.csv"))
    value = {name: channel.value for name, channel in log.channels.items()}
    np.testing.assert_allclose(value["x"], -4)
    np.testing.assert_allclose(value["y"], 7)
    np.testing.assert_allclose(np.unwrap(value["psi"]), np.pi / 2 - yaw, atol=1e-12)
    np.testing.assert_allclose(value["u"], 1.5)
    np.testing.assert_allclose(value["v"], -0.2)
    np.testing.assert_allclose(value["r"], -0.1)
    assert any("ENU/FLU (REP-103)" in note for note in log.notes)
    assert "qw" not in log.channels
    straight = read_log(write(ros(yaw, one, one, one, one, 2 * one), tmp_path / "bag.csv"), Reading(frame="ned"))
    np.testing.assert_allclose(straight.channels["v"].value, 1.0)
    np.testing.assert_allclose(straight.channels["y"].value, 2.0)


def test_enu_on_request_turns_canonical_names_too(tmp_path):
    log = read_log(write(wide(), tmp_path / "log.csv"), Reading(frame="enu"))
    frame = wide()
    for name, expected in (("x", frame.y), ("y", frame.x), ("psi", np.pi / 2 - frame.psi), ("u", frame.u)):
        np.testing.assert_allclose(log.channels[name].value, expected)
    for name in ("v", "r"):
        np.testing.assert_allclose(log.channels[name].value, -frame[name])


def test_canonical_quaternion_gives_ned_heading_and_unset_ones_are_dropped(tmp_path):
    psi = 0.02 * TIME
    frame = pd.DataFrame({"t": TIME, "qx": 0.0, "qy": 0.0, "qz": np.sin(psi / 2), "qw": np.cos(psi / 2), "u": 1.0})
    frame.loc[:4, ["qz", "qw"]] = 0.0
    log = read_log(write(frame, tmp_path / "log.csv"))
    np.testing.assert_allclose(log.channels["psi"].value, psi[5:], atol=1e-12)
    assert any("5 rows with an all-zero quaternion" in note for note in log.notes)


@pytest.mark.parametrize(
    ("topic", "field", "name"),
    [
        ("/model/blueboat/joint/motor_port_joint/cmd_thrust", "data", "newton_port"),
        ("/wamv/thrusters/right/thrust", "data", "newton_stbd"),
        ("/blueboat/servo_output", "ch1_port_us", "pwm_port"),
        ("/rc", "starboard_pwm", "pwm_stbd"),
        ("/props", "left_omega", "rad_s_port"),
    ],
)
def test_thruster_commands_are_guessed_and_said(tmp_path, topic, field, name):
    frame = pd.DataFrame({"t": TIME, "u": 1.0, field: 1500.0})
    log = read_log(write(long(frame, {"u": "/odom", field: topic}), tmp_path / "log.csv"))
    assert log.channels[name].origin == f"{topic}:{field}"
    assert any(note.startswith(f"{name}: guessed from the name {topic}") for note in log.notes)


def test_commanded_velocities_and_joint_states_are_no_measurements(tmp_path):
    names = {"u": "/odom", "twist.linear.x": "/cmd_vel", "motor_port_joint.velocity": "/boat/joint_state"}
    frame = pd.DataFrame({"t": TIME, **dict.fromkeys(names, 1.0)})
    log = read_log(write(long(frame, names), tmp_path / "log.csv"))
    assert list(log.channels) == ["u"]
    assert set(log.unused) == {"/cmd_vel:twist.linear.x", "/boat/joint_state:motor_port_joint.velocity"}


def test_of_two_sources_one_whole_message_is_taken_whatever_the_order(tmp_path):
    table = ros(0 * TIME, TIME, TIME, TIME, TIME, TIME)
    other = table.assign(topic="/a/ground_truth", value=-1.0)
    half = other[other["field"].isin(["twist.linear.x"])].assign(topic="/0/odom")
    logs = []
    for number, order in enumerate(([table, other, half], [half, other, table])):
        log = read_log(write(pd.concat(order), tmp_path / f"{number}.csv"))
        assert all(channel.origin.count(ODOM) for channel in log.channels.values())
        assert any(note.startswith(f"u: taken from {ODOM}") and "/0/odom" in note for note in log.notes)
        logs.append(log)
    assert sorted(logs[0].notes) == sorted(logs[1].notes)


@pytest.mark.parametrize(("gravity", "sign"), [(9.81, -1.0), (-9.81, 1.0)])
def test_an_imu_hung_upside_down_is_seen_by_gravity(tmp_path, gravity, sign):
    fields = {"linear_acceleration.y": 0.5, "linear_acceleration.z": gravity, "angular_velocity.z": 0.2}
    frame = pd.DataFrame({"t": TIME, **fields})
    log = read_log(write(long(frame, dict.fromkeys(fields, "/imu")), tmp_path / "log.csv"))
    np.testing.assert_allclose(log.channels["ay"].value, sign * 0.5)
    np.testing.assert_allclose(log.channels["r"].value, sign * 0.2)


def test_the_channel_map_overrides_the_guess(tmp_path):
    frame = wide().drop(columns="psi").assign(heading_deg=np.rad2deg(wide()["psi"]), sway_port=1.0)
    path = write(frame, tmp_path / "log.csv")
    (tmp_path / "map.yaml").write_text(
        "psi: {from: heading_deg, scale: 0.017453292519943295}\n"
        "v: {from: sway_port, frame: enu, offset: 0.5}\n"
        "newton_port: x\npwm_port: null\n"
    )
    log = read_log(path, Reading(channel_map=tmp_path / "map.yaml"))
    np.testing.assert_allclose(log.channels["psi"].value, wide()["psi"])
    np.testing.assert_allclose(log.channels["v"].value, -1.5)
    np.testing.assert_allclose(log.channels["newton_port"].value, wide()["x"])
    assert "pwm_port" not in log.channels
    assert any("heading_deg by the channel map" in note for note in log.notes)


def test_a_ros_field_mapped_to_its_own_channel_is_still_converted(tmp_path):
    one = np.ones_like(TIME)
    path = write(ros(0 * TIME, one, 0.2 * one, 0.1 * one, 7 * one, -4 * one), tmp_path / "bag.csv")
    (tmp_path / "map.yaml").write_text(f'v: "{ODOM}:twist.linear.y"\nr: {{from: twist.angular.z, frame: ned}}\n')
    log = read_log(path, Reading(channel_map=tmp_path / "map.yaml"))
    np.testing.assert_allclose(log.channels["v"].value, -0.2)
    np.testing.assert_allclose(log.channels["r"].value, 0.1)


def test_repeated_stamps_keep_the_last_and_rows_without_number_go(tmp_path):
    frame = pd.concat([wide().iloc[:50], wide().iloc[49:].assign(u=5.0)])
    row = np.arange(len(frame))
    frame = frame.assign(u=np.where(row == 20, np.nan, frame["u"]), v=np.where(row == 30, np.inf, frame["v"]))
    log = read_log(write(frame, tmp_path / "log.csv"))
    assert log.channels["u"].value[48] == 5.0
    assert log.channels["u"].time.size == TIME.size - 1
    assert any("1 repeated time stamps, the last value" in note for note in log.notes)
    assert any(note == "u v: 1 rows without a number dropped" for note in log.notes)


def test_parquet_without_pyarrow_names_the_extra(tmp_path, monkeypatch):
    path = write(wide(), tmp_path / "log.parquet")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ValueError, match=r"pip install -e '\.\[logs\]'"):
        read_log(path)


def test_canonical_names():
    assert command_kind("rad_s_aft_port") == ("rad_s", "aft_port")
    assert is_canonical("pwm_1")
    assert not is_canonical("pwm")
    assert not is_canonical("pwm_")


BROKEN = {
    "an empty file": (b"", "the file is empty; expected a CSV"),
    "a header alone": (b"t,u\n", "a header but no rows"),
    "binary rubbish": (bytes(range(256)) * 9, "got binary content; expected a CSV or Parquet"),
    "broken gzip": (gzip.compress(b"t,u\n" + b"0,1\n" * 9000)[:60], "a broken gzip file"),
    "broken Parquet": (b"PAR1 and nothing else", "a broken Parquet file"),
    "another header": (b"a,b\n1,2\n", "got the header 'a,b'; expected a CSV"),
    "ragged rows": (b"t,u\n0,1\n1,2,3,4\n", "not a readable table"),
    "no time": (b"t,u\n,1\n,2\n", "column 't' holds no numbers and no instants, got empty cells"),
    "words as time": (b"t,u\nnoon,1\nnight,2\n", "column 't' holds no numbers and no instants, got 'noon'"),
    "no known channel": (b"t,foo\n0,1\n", "no channel is recognised among foo; expected names like x y psi"),
    "a channel of NaN": (b"t,u,v\n0,,1\n1,nan,2\n", r"u \(u\) holds no number in any of its 2 rows"),
    "time that runs back": (b"t,u\n0,1\n2,2\n1.5,3\n", r"time runs backwards in u \(u\) at row 4: 1.5"),
    "PWM of zero": (b"t,pwm_port\n0,1500\n1,0\n", r"pwm_port \(pwm_port\) must lie within 800 to 2200 \[us\], got 0"),
    "normalized beyond 1": (b"t,normalized_port\n0,0\n1,1.2\n", "throttle and steering, sum and difference"),
    "normalized in percent": (b"t,normalized_port\n0,0\n1,100\n", r"must lie within -1.05 to 1.05 \[1\], got 100"),
    "a speed of 101 m/s": (b"t,u\n0,1\n1,-101\n", r"u \(u\) must lie within -100 to 100 \[m/s\], got -101 at t = 1"),
    "drift without end": (b"t,v\n0,1\n1,1e300\n", r"v \(v\) must lie within -100 to 100 \[m/s\], got 1e\+300"),
    "yaw rate in degrees": (b"t,r\n0,1\n1,51\n", r"r \(r\) must lie within -50 to 50 \[rad/s\], got 51"),
    "position in millimetres": (b"t,x\n0,1\n1,2e8\n", r"must lie within -1e\+08 to 1e\+08 \[m\], got 2e\+08"),
    "east far off": (b"t,y\n0,1\n1,-2e8\n", r"y \(y\) must lie within -1e\+08 to 1e\+08 \[m\], got -2e\+08"),
    "acceleration in raw counts": (b"t,ax\n0,1\n1,16384\n", r"within -10000 to 10000 \[m/s\^2\], got 16384"),
    "sideways in raw counts": (b"t,ay\n0,1\n1,16384\n", r"ay \(ay\) must lie within -10000 to 10000"),
    "thrust of a rocket": (b"t,newton_port\n0,1\n1,2e7\n", r"within -1e\+07 to 1e\+07 \[N\], got 2e\+07"),
    "a turbine": (b"t,rad_s_port\n0,1\n1,2e5\n", r"within -100000 to 100000 \[rad/s\], got 200000"),
    "a zero quaternion": (b"t,qx,qy,qz,qw\n0,0,0,0,0\n", "is zero in all 1 rows"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_bad_files_are_refused_in_words(tmp_path, case):
    content, message = BROKEN[case]
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=message) as caught:
        read_log(path)
    assert str(path) in str(caught.value)


def test_missing_files_and_folders_are_refused(tmp_path):
    with pytest.raises(ValueError, match="no such file; expected a log"):
        read_log(tmp_path / "none.csv")
    with pytest.raises(ValueError, match="expected a log file, got a folder"):
        read_log(tmp_path)


MAPS = {
    "u: gone": "takes u from 'gone', which is not in the log",
    "u: pwm_prt": "did you mean 'pwm_port'",
    "speed: u": "unknown channel 'speed' in the channel map",
    "u: {from: v, scael: 2}": "'u' must be 'topic:field'",
    "u: {from: v, scale: two}": "needs a number as scale",
    "u: {from: v, frame: body}": "needs frame ned or enu",
    "- u": "expected lines of 'channel: topic:field'",
    "# nothing yet": "has no line; write some",
    "u: a: b": "the channel map is not YAML",
    "{x: {from: u, frame: enu}, y: v}": "gives y twice",
}


@pytest.mark.parametrize("text", MAPS)
def test_bad_channel_maps_are_refused_in_words(tmp_path, text):
    (tmp_path / "map.yaml").write_text(text)
    path = write(wide(), tmp_path / "log.csv")
    with pytest.raises(ValueError, match=MAPS[text]):
        read_log(path, Reading(channel_map=tmp_path / "map.yaml"))
    with pytest.raises(ValueError, match="no such channel map"):
        read_log(path, Reading(channel_map=Path("nowhere.yaml")))


def test_a_field_of_several_topics_needs_its_topic(tmp_path):
    table = long(wide())
    both = pd.concat([table, table.assign(topic="/other")])
    (tmp_path / "map.yaml").write_text("u: v")
    with pytest.raises(ValueError, match=r"which several topics have: /log:v, /other:v\. Write topic:field"):
        read_log(write(both, tmp_path / "log.csv"), Reading(channel_map=tmp_path / "map.yaml"))


@pytest.mark.parametrize("name", ["t", None, "stamp"])
def test_an_index_of_a_parquet_table_is_its_time(tmp_path, name):
    time = 0.05 * np.arange(200)
    frame = pd.DataFrame({"psi": 0.1 * time, "u": 1.0 + 0.0 * time})
    whole = pd.to_datetime((1.6e18 + 1e9 * time).astype("int64"), utc=True)
    frame.index = pd.Index(time, name=name) if name == "t" else pd.DatetimeIndex(whole, name=name)
    frame.to_parquet(tmp_path / "log.parquet")
    log = read_log(tmp_path / "log.parquet")
    np.testing.assert_allclose(log.channels["psi"].time, time, atol=1e-6)
    np.testing.assert_allclose(log.channels["psi"].value, 0.1 * time)
    assert set(log.channels) == {"psi", "u"}


def test_a_log_given_as_a_channel_map_is_not_printed_whole(tmp_path):
    log, wrong = write(wide(), tmp_path / "log.csv"), tmp_path / "map.csv"
    wrong.write_text("t,x\n" + "1.0,2.0\n" * 5000)
    with pytest.raises(LogError, match=r"'channel: topic:field'.* \.\.\. \d+ characters left out") as told:
        read_log(log, Reading(channel_map=wrong))
    assert len(str(told.value)) < 400 + len(str(wrong))


def test_a_picture_named_as_a_matlab_file_is_told_to_be_one(tmp_path):
    path = tmp_path / "photo.mat"
    path.write_bytes(b"\xff\xd8\xff\xe0\x00\x10JFIF\x00" + bytes(range(256)) * 4)
    with pytest.raises(LogError, match=r"it is a JPEG picture and no MATLAB file") as told:
        read_log(path)
    assert "Copy the log again" not in str(told.value)


def test_streams_that_may_be_commands_are_named_where_none_is_known(tmp_path):
    frame = wide().drop(columns=[name for name in wide().columns if name.startswith(("pwm", "newton"))])
    path = write(frame.assign(**{"RCOU.C9": 1500.0, "depth": 1.0}), tmp_path / "log.csv")
    (told,) = [text for text in problems(read_log(path), load_vehicle("blueboat")) if "of thruster 'port'" in text]
    assert "commands in the log: none" in told
    assert re.search(r"Map a stream to \w+_port, such as RCOU\.C9\.$", told)
