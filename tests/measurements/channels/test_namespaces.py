"""Vehicles of one log are told apart by their namespaces, and one of them is chosen."""

import numpy as np
import pandas as pd
import pytest
from bags import recorded, write_mcap

from undertow.measurements.channels.channel_map import map_text, read_channel_map
from undertow.measurements.channels.recognition import check_namespace, vehicles
from undertow.measurements.formats.base import Name
from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world


@pytest.fixture(scope="module")
def two_boats():
    boat = load_vehicle("blueboat")
    alpha, beta = (simulate_world(boat, {}, duration=40.0, noise="field", seed=seed) for seed in (1, 2))
    both = [*recorded(alpha, "/sim/alpha"), *recorded(beta, "/sim/beta")]
    return alpha, beta, sorted(both, key=lambda message: message.received)


def test_of_several_vehicles_one_is_chosen_by_its_namespace(tmp_path, two_boats):
    alpha, beta, messages = two_boats
    path = write_mcap(tmp_path / "log.mcap", messages)
    with pytest.raises(ValueError, match="expected the log of one vehicle, got 2: /sim/alpha, /sim/beta. Choose one"):
        read_log(path)
    for name, world in (("sim/alpha", alpha), ("/sim/beta/", beta)):
        log = read_log(path, Reading(namespace=name))
        np.testing.assert_array_equal(log.channels["u"].value, world.odometry[:, 3])
        np.testing.assert_array_equal(log.channels["newton_port"].value, world.commands[:, 0])
        assert any(f"namespace {name} chosen, not /sim/" in note for note in log.notes)
        (tmp_path / "map.yaml").write_text(map_text(log.entries, log.unused))
        assert read_channel_map(tmp_path / "map.yaml") == log.entries
    with pytest.raises(
        ValueError, match="no topic lies in the namespace 'gamma'; namespaces in the log: /sim/alpha, /sim/b"
    ):
        read_log(path, Reading(namespace="gamma"))


def test_namespaces_of_a_long_table_are_told_apart_as_well(tmp_path, two_boats):
    alpha, _, _ = two_boats
    rows = pd.read_csv(alpha.write(tmp_path / "alpha.csv"))
    both = pd.concat([rows.assign(topic=f"/{name}/" + rows["topic"]) for name in ("alpha", "beta")])
    both.sort_values("time", kind="stable").to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(ValueError, match=r"got 2: /alpha, /beta\. Choose one with Reading\(namespace=\"/alpha\"\)"):
        read_log(tmp_path / "log.csv")
    log = read_log(tmp_path / "log.csv", Reading(namespace="beta"))
    assert log.channels["u"].origin == "/beta/odometry:u"
    np.testing.assert_allclose(log.channels["u"].value, alpha.odometry[:, 3], rtol=1e-8)


POSE = ("pose.pose.position.x", "pose.pose.position.y", *(f"pose.pose.orientation.{axis}" for axis in "xyzw"))


def names(*topics, kind="nav_msgs/msg/Odometry", fields=POSE):
    return [Name(topic, field, kind) for topic in topics for field in fields]


def thrusts(*topics):
    return names(*topics, kind="std_msgs/msg/Float64", fields=("data",))


ONE = {
    "two estimators of one boat": names("/boat/ekf_a/odometry", "/boat/ekf_b/odometry") + thrusts("/boat/left/thrust"),
    "two estimators at the top": names("/odometry/filtered", "/odometry/gps") + thrusts("/left/thrust"),
    "two receivers": names(
        "/front/fix", "/rear/fix", kind="sensor_msgs/msg/NavSatFix", fields=("latitude", "longitude")
    ),
    "an imu on each side": names("/left/imu", "/right/imu", kind="sensor_msgs/msg/Imu", fields=("orientation.w",)),
    "a wide table": [Name("", field) for field in ("x", "y", "psi", "u")],
}
SEVERAL = {
    "no commands": (names("/a/odom", "/b/odom"), ("/a", "/b")),
    "commands of each": (names("/a/odom", "/b/odom") + thrusts("/a/left/thrust", "/b/left/thrust"), ("/a", "/b")),
    "deeper down": (names("/world/model/a/odom", "/world/model/b/odom"), ("/world/model/a", "/world/model/b")),
    "each with two estimators": (
        names(*(f"/{boat}/{ekf}/odom" for boat in "ab" for ekf in ("x", "y"))) + thrusts("/a/left/thrust"),
        ("/a", "/b"),
    ),
    "a shared anemometer": ([*names("/a/odom", "/b/odom"), Name("/weather", "wind_u")], ("/a", "/b")),
}


@pytest.mark.parametrize("case", ONE)
def test_what_one_vehicle_writes_is_one_vehicle(case):
    assert vehicles(ONE[case]) == ()


@pytest.mark.parametrize("case", SEVERAL)
def test_several_vehicles_are_seen(case):
    assert vehicles(SEVERAL[case][0]) == SEVERAL[case][1]


@pytest.mark.parametrize(
    ("topics", "there"),
    [
        (names("/model/a/odom") + thrusts("/model/a/joint/left/cmd_thrust"), "/model/a"),
        (names("/model/a/odom", "/model/b/odom"), "/model/a, /model/b"),
        ([*names("/model/a/odom"), Name("/model/buoy/state", "mood"), Name("/world/state", "mood")], "/model/a"),
        (names("/odometry/filtered") + thrusts("/left/thrust"), "/left, /odometry"),
        ([Name("/world/state", "mood"), Name("/flat", "mood")], "/world"),
    ],
)
def test_the_namespaces_of_one_vehicle_are_listed_as_deep_as_those_of_several(topics, there):
    with pytest.raises(ValueError, match=f"in the namespace '/model/foo'; namespaces in the log: {there}\\."):
        check_namespace(topics, "/model/foo", "log.mcap")
