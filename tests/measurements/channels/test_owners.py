"""Whose a message is: nothing of a camera, a light or a buoy is taken as the boat's, while the boat tells it itself."""

import numpy as np
import pytest

from undertow.measurements.channels.mapping import map_channels
from undertow.measurements.channels.recognition import recognise
from undertow.measurements.formats.base import Name, Stream

TIME = np.arange(0.0, 10.0, 0.1)
POSE = ("position.x", "position.y", "orientation.x", "orientation.y", "orientation.z", "orientation.w")


def streams(topic: str, kind: str, fields: tuple[str, ...], frame: str = "") -> list[Stream]:
    rows = np.arange(1, TIME.size + 1)
    return [Stream(topic, field, TIME, 0.1 * (k + 1) * TIME + 0.2, rows, kind, frame) for k, field in enumerate(fields)]


def own() -> list[Stream]:
    imu = (*(f"orientation.{axis}" for axis in "xyzw"), "angular_velocity.z")
    return [
        *streams("/imu/data", "sensor_msgs/msg/Imu", imu, "imu_link"),
        *streams("/gps/fix", "sensor_msgs/msg/NavSatFix", ("latitude", "longitude"), "gps_link"),
    ]


def origins(found: list[Stream]) -> dict[str, str]:
    mapped = map_channels(found, None, {}, "log")
    return {name: channel.origin for name, channel in mapped.channels.items()}


@pytest.mark.parametrize(
    ("topic", "kind", "prefix", "frame"),
    [
        ("/aruco/pose", "geometry_msgs/msg/PoseStamped", "pose.", "map"),
        ("/pose", "geometry_msgs/msg/PoseStamped", "pose.", "front_camera_optical"),
        ("/buoy_1/pose", "geometry_msgs/msg/PoseStamped", "pose.", "map"),
        ("/seen", "geometry_msgs/msg/PoseStamped", "pose.", "base_link"),
        ("/zed/odom", "nav_msgs/msg/Odometry", "pose.pose.", "odom"),
    ],
)
def test_a_pose_of_another_thing_is_passed_over(topic, kind, prefix, frame):
    fields = tuple(prefix + field for field in POSE)
    found = origins([*streams(topic, kind, fields, frame), *own()])
    assert set(found) == {"x", "y", "psi", "r"}
    assert all(topic not in origin for origin in found.values()), found


def test_it_is_taken_where_nothing_else_tells_it_and_the_note_says_so():
    fields = tuple(f"pose.{field}" for field in POSE)
    mapped = map_channels(streams("/aruco/pose", "geometry_msgs/msg/PoseStamped", fields, "camera"), None, {}, "log")
    assert set(mapped.channels) == {"x", "y", "psi"}
    assert any("/aruco/pose taken, because no other message tells them" in note for note in mapped.notes)


def test_the_boats_heading_and_place_make_a_cameras_rate_needless():
    boat = [stream for stream in own() if stream.field != "angular_velocity.z"]
    found = origins([*boat, *streams("/gimbal/imu", "sensor_msgs/msg/Imu", ("angular_velocity.z",), "gimbal_link")])
    assert "r" not in found


def test_r_beside_g_and_b_is_a_colour():
    lamp = streams("/mast/light", "", ("r", "g", "b"))
    boat = streams("/boat", "", ("x", "y", "psi"))
    mapped = map_channels([*lamp, *boat], None, {}, "log")
    assert "r" not in mapped.channels
    assert any("r, g and b together are a colour" in note for note in mapped.notes)
    assert "r" in map_channels([*streams("/state", "", ("r",)), *boat], None, {}, "log").channels


@pytest.mark.parametrize("name", ["SERVO_OUTPUT_RAW.port", "SERVO_OUTPUT_RAW:port", "RC_CHANNELS_RAW.port"])
def test_mavlinks_port_is_no_side(name):
    topic, _, field = name.rpartition(":")
    assert recognise(Name(topic, field)) is None


def test_outputs_of_mavlink_in_a_table_have_numbers():
    guess = recognise(Name("", "SERVO_OUTPUT_RAW.servo3_raw"))
    assert guess is not None
    assert (guess.role, guess.within) == ("pwm_3", (800.0, 2200.0))
    port = recognise(Name("", "servo_port"))
    assert port is not None
    assert port.role == "pwm_port"
