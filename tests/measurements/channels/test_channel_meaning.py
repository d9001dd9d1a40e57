"""Messages become channels by their types."""

import re

import numpy as np
import pandas as pd
import pytest
from bags import EPOCH, Message, nanoseconds, write_ros1, write_ros2

from undertow.measurements.canonical import local_metres
from undertow.measurements.channels.channel_map import map_text
from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.measurements.preparation.needs import problems
from undertow.measurements.preparation.prepare import prepare
from undertow.physics.motion import body_to_earth
from undertow.physics.vehicle import load_vehicle

TIME = np.arange(0.0, 40.0, 0.2)
PSI = 0.3 + 0.05 * TIME
"""Heading of a boat that turns to starboard, clockwise from north [rad]."""


def message(topic, kind, frame="", **columns):
    """A message for every stamp; a column is an array, or one value for all."""
    return [
        Message(
            topic,
            kind,
            {
                name.replace("__", "."): column[k] if isinstance(column, list | np.ndarray) else column
                for name, column in columns.items()
            },
            nanoseconds(time),
            frame=frame,
        )
        for k, time in enumerate(TIME)
    ]


def in_order(*topics):
    return sorted((m for topic in topics for m in topic), key=lambda m: m.received)


def quaternion(yaw, prefix="orientation"):
    return {f"{prefix}__z": np.sin(yaw / 2), f"{prefix}__w": np.cos(yaw / 2)}


def imu(**more):
    return message("/imu/data", "sensor_msgs/msg/Imu", **quaternion(np.pi / 2 - PSI), **more)


def fix(north, east, **more):
    """Fixes near Trondheim; a metre is 1/111.5 km north, and 1/49.9 km east, to within 1 %."""
    latitude, longitude = 63.44 + north / 111_500.0, 10.40 + east / 49_900.0
    return message("/gps/fix", "sensor_msgs/msg/NavSatFix", latitude=latitude, longitude=longitude, **more)


def read(tmp_path, *topics):
    tmp_path.mkdir(exist_ok=True)
    return read_log(write_ros2(tmp_path / "bag", in_order(*topics)))


def told(log, *parts):
    return [note for note in log.notes if all(part in note for part in parts)]


def test_a_log_of_fixes_and_a_compass_gives_metres_and_body_velocities(tmp_path):
    # A circle at 1.2 m/s: the course is the heading, so that all speed is ahead.
    north, east = 24.0 * (np.sin(PSI) - np.sin(0.3)), -24.0 * (np.cos(PSI) - np.cos(0.3))
    log = read(tmp_path, fix(north, east), imu(angular_velocity__z=np.nan))
    assert set(log.channels) >= {"x", "y", "psi"}
    np.testing.assert_allclose(log.channels["x"].value, north, atol=0.3)
    np.testing.assert_allclose(log.channels["y"].value, east, atol=0.3)
    expected = local_metres(63.44 + north / 111_500.0, 10.40 + east / 49_900.0)
    np.testing.assert_allclose(log.channels["x"].value, expected[0], atol=1e-6)
    np.testing.assert_allclose(log.channels["psi"].value, PSI, atol=1e-12)
    (note,) = told(log, "metres north and east of the first fix")
    assert "latitude 63.4400000, longitude 10.4000000 [deg]" in note
    (motion,) = prepare(log, None).motions
    inner = motion.velocity[20:-20]
    np.testing.assert_allclose(inner[:, 0], 1.2, rtol=0.02)
    np.testing.assert_allclose(inner[:, 1], 0.0, atol=0.03)
    np.testing.assert_allclose(inner[:, 2], 0.05, rtol=0.02)
    assert any("u: not in the log, derived from x, y and psi" in note for note in prepare(log, None).notes)


def test_rows_without_a_fix_are_dropped_and_odometry_goes_before_fixes(tmp_path):
    status = np.where(np.arange(TIME.size) < 10, -1, 0)
    north = np.where(status < 0, 5e6, TIME)
    log = read(tmp_path, fix(north, TIME, status__status=status), imu())
    assert log.channels["x"].time[0] == pytest.approx(TIME[10])
    assert told(log, "lat lon: 10 rows without a number dropped")
    pose = message(
        "/odom", "nav_msgs/msg/Odometry", pose__pose__position__x=TIME, **quaternion(TIME, "pose__pose__orientation")
    )
    both = read_log(write_ros1(tmp_path / "log.bag", in_order(fix(TIME, TIME), pose)))
    np.testing.assert_allclose(both.channels["y"].value, TIME)
    assert told(both, "latitude and longitude are not used")


def test_a_flattened_bag_of_fixes_goes_through_the_same_door(tmp_path):
    frame = pd.DataFrame(
        {"t": TIME, "latitude": 63.44 + 1e-5 * TIME, "longitude": 10.4, "psi": PSI, "status.status": 0}
    )
    table = frame.melt("t", var_name="field").assign(topic="/gps/fix").sort_values("t", kind="stable")
    table.to_csv(tmp_path / "log.csv", index=False)
    assert read_log(tmp_path / "log.csv").channels["x"].value[-1] == pytest.approx(1e-5 * TIME[-1] * 111_500, rel=0.01)
    wide = frame.rename(columns={"latitude": "lat", "longitude": "lon"})
    wide.to_csv(tmp_path / "wide.csv", index=False)
    assert list(read_log(tmp_path / "wide.csv").channels) == ["x", "y", "psi"]
    wide.assign(lat=0.0, lon=0.0).to_csv(tmp_path / "none.csv", index=False)
    with pytest.raises(ValueError, match="are zero in all 200 rows: no fix"):
        read_log(tmp_path / "none.csv")
    wide.assign(lat=6344.0).to_csv(tmp_path / "scaled.csv", index=False)
    with pytest.raises(ValueError, match=r"lat \(lat\) must lie within -90 to 90 \[deg\], got 6344"):
        read_log(tmp_path / "scaled.csv")


def test_an_imu_that_says_it_knows_no_orientation_is_no_compass(tmp_path):
    unknown = np.array([-1.0, *np.zeros(8)])
    pose = message("/pose", "geometry_msgs/msg/PoseStamped", **quaternion(np.pi / 2 - PSI, "pose__orientation"))
    log = read(tmp_path, imu(orientation_covariance=[unknown] * TIME.size, angular_velocity__z=-0.05), pose)
    assert log.channels["psi"].origin.startswith("quaternion /pose")
    np.testing.assert_allclose(log.channels["r"].value, 0.05)
    zero = read_log(
        write_ros1(
            tmp_path / "log.bag", in_order(message("/imu", "sensor_msgs/msg/Imu", angular_velocity__z=-0.05), pose)
        )
    )
    assert zero.channels["psi"].origin.startswith("quaternion /pose")


@pytest.mark.parametrize(
    ("frame", "sway"),
    [("base_link", -0.2), ("boat/base_link", -0.2), ("base_link_frd", 0.2), ("earth", None), ("", -0.2)],
)
def test_the_frame_that_a_twist_names_decides_what_it_is(tmp_path, frame, sway):
    pose = message(
        "/pose", "geometry_msgs/msg/PoseStamped", pose__position__x=TIME, **quaternion(PSI, "pose__orientation")
    )
    twist = message("/vel", "geometry_msgs/msg/TwistStamped", frame, twist__linear__x=1.0, twist__linear__y=0.2)
    log = read(tmp_path, pose, twist)
    if sway is None:
        assert "v" not in log.channels
        assert told(log, "/vel: its velocity is in the frame 'earth', of the earth, not of the body")
    else:
        np.testing.assert_allclose(log.channels["v"].value, sway)
    how = "converted from ENU/FLU (REP-103) to NED/FRD: north = world y, east = world x, psi = pi/2 - yaw"
    other = {None: ("x y psi r", ", r changes sign"), -0.2: ("x y psi u v r", ", v and r change sign")}
    converted, signs = other.get(sway, ("x y psi", ""))
    assert [text for text in log.notes if "REP-103" in text] == [f"{converted}: {how}{signs}"]


@pytest.mark.parametrize(
    ("topic", "frame", "down"),
    [
        ("/vel", "map", False),
        ("/vel", "boat/odom", False),
        ("/vel", "map_ned", True),
        # MAVROS names the body's frame in this one, and gives ENU.
        ("/mavros/local_position/velocity_local", "base_link", False),
    ],
)
def test_a_velocity_along_the_axes_of_the_earth_is_turned_by_the_heading(tmp_path, topic, frame, down):
    along, across = 1.2 + 0.01 * TIME, 0.3 * np.sin(TIME)
    north, east = body_to_earth(PSI, along, across)
    x, y, rate = (north, east, 0.05) if down else (east, north, -0.05)
    twist = message(topic, "geometry_msgs/msg/TwistStamped", frame, twist__linear__x=x, twist__linear__y=y)
    for part in twist:
        part.values["twist.angular.z"] = rate
    log = read(tmp_path, twist[3:], imu(angular_velocity__z=np.nan)[:-2])
    np.testing.assert_allclose(log.channels["u"].value, along[3:-2], atol=1e-9)
    np.testing.assert_allclose(log.channels["v"].value, across[3:-2], atol=1e-9)
    np.testing.assert_allclose(log.channels["r"].value, 0.05)
    assert "x_dot" not in log.channels
    assert told(log, f"u v: velocity in earth axes ({topic}:", "turned by the heading (quaternion /imu/data")
    (tmp_path / "map.yaml").write_text(map_text(log.entries))
    again = read_log(tmp_path / "bag", Reading(channel_map=tmp_path / "map.yaml"))
    np.testing.assert_array_equal(again.channels["v"].value, log.channels["v"].value)


def test_a_velocity_along_the_earth_gives_way_to_one_of_the_body_and_needs_a_heading(tmp_path):
    local = message("/a/velocity_local", "geometry_msgs/msg/TwistStamped", "base_link", twist__linear__x=TIME)
    body = message("/z/velocity_body", "geometry_msgs/msg/TwistStamped", "base_link", twist__linear__x=1.0)
    log = read(tmp_path, local, body, imu())
    np.testing.assert_array_equal(log.channels["u"].value, 1.0)
    assert told(log, "u and v are channels of their own; velocities in earth axes are not used")
    blind = read_log(write_ros1(tmp_path / "blind.bag", local))
    assert list(blind.channels) == ["r"]
    assert told(blind, "a velocity in earth axes (/a/velocity_local:", "is not used: without a heading")
    pd.DataFrame({"t": TIME, "psi": 0.0, "x_dot": 1.0}).to_csv(tmp_path / "wide.csv", index=False)
    assert told(read_log(tmp_path / "wide.csv"), "(x_dot) is not used: one part of it")


def test_a_flattened_bag_says_by_the_topic_that_a_velocity_is_along_the_earth(tmp_path):
    frame = pd.DataFrame({"time": TIME, "twist.linear.x": np.sin(PSI), "twist.linear.y": np.cos(PSI)})
    rows = frame.melt("time", var_name="field").assign(topic="/mavros/local_position/velocity_local")
    heading = pd.DataFrame({"time": TIME, "topic": "/compass", "field": "psi", "value": PSI})
    pd.concat([rows, heading]).sort_values("time", kind="stable").to_csv(tmp_path / "log.csv", index=False)
    log = read_log(tmp_path / "log.csv")
    np.testing.assert_allclose(log.channels["u"].value, 1.0, atol=1e-9)
    np.testing.assert_allclose(log.channels["v"].value, 0.0, atol=1e-9)


def test_a_pose_in_a_frame_that_says_ned_is_not_turned(tmp_path):
    values = {"pose__position__x": TIME, "pose__position__y": 2 * TIME, **quaternion(PSI, "pose__orientation")}
    log = read(tmp_path, message("/pose", "geometry_msgs/msg/PoseStamped", "map_ned", **values))
    np.testing.assert_allclose(log.channels["x"].value, TIME)
    np.testing.assert_allclose(log.channels["psi"].value, PSI, atol=1e-12)


def test_outputs_of_a_flight_controller_are_pwm_by_number_and_idle_ones_are_left_out(tmp_path):
    pulses = [np.array([1500 + k, 0, 0 if k < 5 else 1400 + k, 65535], np.uint16) for k in range(TIME.size)]
    out = message("/mavros/rc/out", "mavros_msgs/msg/RCOut", channels=pulses)
    hud = message("/mavros/vfr_hud", "mavros_msgs/msg/VfrHud", heading=[90] * TIME.size)
    log = read(tmp_path, out, hud)
    assert list(log.channels) == ["psi", "pwm_1", "pwm_3"]
    np.testing.assert_allclose(log.channels["psi"].value, np.pi / 2)
    np.testing.assert_allclose(log.channels["pwm_1"].value, 1500 + np.arange(TIME.size))
    assert log.channels["pwm_3"].value.size == TIME.size - 5
    assert told(log, "/mavros/rc/out: no value in channels[1], channels[3]")
    line = "pwm_port: '/mavros/rc/out:channels[0]'"
    assert told(log, f"pwm_1: output 1 by number [us]; if it drives port, map {line}")
    (tmp_path / "map.yaml").write_text(line)
    mapped = read_log(tmp_path / "bag", Reading(channel_map=tmp_path / "map.yaml"))
    np.testing.assert_allclose(mapped.channels["pwm_port"].value, 1500 + np.arange(TIME.size))
    assert list(mapped.channels) == ["psi", "pwm_3", "pwm_port"]


def test_outputs_by_number_come_with_the_lines_of_the_map_that_is_missing(tmp_path):
    pulses = [np.array([1500, 0, 1600, 1700], np.uint16)] * TIME.size
    out = message("/mavros/rc/out", "mavros_msgs/msg/RCOut", channels=pulses)
    pose = message(
        "/pose", "geometry_msgs/msg/PoseStamped", pose__position__x=TIME, **quaternion(PSI, "pose__orientation")
    )
    log = read(tmp_path, out, pose)
    (problem,) = problems(log, load_vehicle("blueboat_paper"))
    assert "missing command channel pwm_port pwm_stbd; the log has pwm_1 pwm_3 pwm_4, by number" in problem
    lines = re.findall(r"pwm_\w+: \{.*?\}", problem)
    (tmp_path / "map.yaml").write_text("\n".join(lines))
    mapped = read_log(tmp_path / "bag", Reading(channel_map=tmp_path / "map.yaml"))
    assert problems(mapped, load_vehicle("blueboat_paper")) == []
    assert mapped.channels["pwm_stbd"].origin == "/mavros/rc/out:channels[2]"
    assert "pwm_4" in mapped.channels
    # A vehicle that wants newtons is another matter.
    assert problems(log, load_vehicle("blueboat"))[0].startswith("missing command channel newton_port of thruster")


def test_joints_of_propellers_drives_and_compass_headings_are_known(tmp_path):
    names = ["left_engine_propeller_joint", "right_engine_propeller_joint", "left_chassis_engine_joint"]
    joints = message(
        "/joint_states",
        "sensor_msgs/msg/JointState",
        name=[names[::-1] if k % 2 else names for k in range(TIME.size)],
        velocity=[np.array([3.0, 2.0, 1.0])[:: -1 if k % 2 else 1].copy() for k in range(TIME.size)],
    )
    drive = message("/cmd_drive", "heron_msgs/msg/Drive", left=0.25, right=-0.5)
    compass = message("/mavros/global_position/compass_hdg", "std_msgs/msg/Float64", data=np.rad2deg(PSI))
    log = read(tmp_path, joints, drive, compass)
    np.testing.assert_allclose(log.channels["rad_s_port"].value, 3.0)
    np.testing.assert_allclose(log.channels["rad_s_stbd"].value, 2.0)
    np.testing.assert_allclose(log.channels["rad_s_port"].time, TIME, atol=1e-9)
    np.testing.assert_allclose(log.channels["psi"].value, PSI)
    assert told(log, "rad_s_port: the measured speed of /joint_states:left_engine_propeller_joint.velocity")
    assert "normalized_port" in log.channels
    assert "/joint_states:left_chassis_engine_joint.velocity" in log.unused


def test_markers_goals_and_commanded_poses_are_no_measurements(tmp_path):
    pose = message(
        "/pose", "geometry_msgs/msg/PoseStamped", pose__position__x=TIME, **quaternion(PSI, "pose__orientation")
    )
    goal = message("/goal", "geometry_msgs/msg/PoseStamped", pose__position__x=99.0)
    marker = message("/a_marker", "visualization_msgs/msg/Marker", pose__position__x=99.0)
    corner = message("/a_corner", "geometry_msgs/msg/Vector3", x=99.0, y=99.0)
    log = read(tmp_path, goal, marker, corner, pose)
    np.testing.assert_allclose(log.channels["y"].value, TIME)
    assert not told(log, "not from")


def test_thrust_that_never_exceeds_one_is_asked_whether_it_is_normalized(tmp_path):
    left = message("/thrusters/left_thrust_cmd", "std_msgs/msg/Float32", data=0.5)
    right = message("/thrusters/right_thrust_cmd", "std_msgs/msg/Float32", data=20.0)
    log = read(tmp_path, left, right)
    assert told(log, "newton_port: guessed", "never above 1, so is it normalized?")
    assert not told(log, "newton_stbd", "normalized")


def test_the_epoch_of_the_bag_is_in_the_notes(tmp_path):
    assert told(read(tmp_path, imu()), f"time counts from the first message, {EPOCH} ns")


def test_the_angle_of_an_azimuth_thruster_is_no_command(tmp_path):
    angle = message("/wamv/left_thrust_angle", "std_msgs/msg/Float32", data=0.3)
    command = message("/wamv/left_thrust_cmd", "std_msgs/msg/Float32", data=0.9 * TIME)
    log = read(tmp_path, angle, command)
    assert log.channels["newton_port"].origin == "/wamv/left_thrust_cmd:data"
    assert "/wamv/left_thrust_angle:data" in log.unused


def test_a_thrust_that_says_it_is_the_command_goes_before_another(tmp_path):
    log = read(
        tmp_path,
        message("/a/left_thrust", "std_msgs/msg/Float32", data=3.0),
        message("/b/left_thrust_cmd", "std_msgs/msg/Float32", data=TIME),
    )
    assert log.channels["newton_port"].origin == "/b/left_thrust_cmd:data"


def mavros(covariance):
    """The receiver's odometry of MAVROS, going east at 1.5 m/s: velocity along the earth, frame of the body."""
    yaw = quaternion(0.0, "pose__pose__orientation")
    values = {"pose__pose__position__x": 500_000.0 + 1.5 * TIME, "twist__twist__linear__x": 1.5, **yaw}
    values |= {"child_frame_id": "base_link", "twist__covariance": [np.array([covariance] + [0.0] * 35)] * TIME.size}
    return message("/mavros/global_position/local", "nav_msgs/msg/Odometry", "map", **values)


def test_the_receivers_odometry_of_mavros_is_along_the_earth_and_comes_last(tmp_path):
    pose = message(
        "/mavros/local_position/pose",
        "geometry_msgs/msg/PoseStamped",
        "map",
        pose__position__x=1.5 * TIME,
        **quaternion(0.0, "pose__orientation"),
    )
    body = message("/mavros/local_position/velocity_body", "geometry_msgs/msg/TwistStamped", twist__linear__x=1.4)
    log = read(tmp_path, pose, body, mavros(0.0))
    origins = {name: channel.origin.rpartition(":")[0] for name, channel in log.channels.items()}
    assert (origins["x"], origins["u"]) == (pose[0].topic, body[0].topic)
    assert origins["r"] == body[0].topic
    alone = read(tmp_path / "alone", mavros(0.0))
    np.testing.assert_allclose(alone.channels["u"].value, 1.5)
    assert "r" not in alone.channels


def test_a_twist_whose_covariance_is_minus_one_is_unknown(tmp_path):
    log = read(tmp_path, mavros(-1.0))
    assert "u" not in log.channels
    told(log, "/mavros/global_position/local: no value in", "twist.twist.linear.x")


def test_one_message_of_a_wanted_or_rare_pose_does_not_displace_the_measured_ones(tmp_path):
    pose = message(
        "/robot_pose", "geometry_msgs/msg/PoseStamped", pose__position__x=TIME, **quaternion(0.1, "pose__orientation")
    )
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    fields = {"pose__pose__position__x": 99.0, **quaternion(1.0, "pose__pose__orientation")}
    for topic in ("/initialpose", "/a_pose"):
        log = read(tmp_path / topic[1:], pose, message(topic, kind, **fields)[7:8])
        assert log.channels["y"].origin.startswith("/robot_pose:"), topic
    with pytest.raises(ValueError, match="no channel is recognised"):
        read(tmp_path / "alone", message("/initialpose", kind, **fields))


def test_an_imu_that_ceases_to_know_its_orientation_gives_it_up_to_there(tmp_path):
    covariance = [np.array([0.0 if k < 50 else -1.0] + [0.0] * 8) for k in range(TIME.size)]
    known = np.where(np.arange(TIME.size) < 50, 0.25, 0.0)
    log = read(
        tmp_path,
        message("/imu", "sensor_msgs/msg/Imu", orientation_covariance=covariance, **quaternion(2.0 * known)),
    )
    assert log.channels["psi"].time.size == 50
    assert log.channels["r"].time.size == TIME.size
