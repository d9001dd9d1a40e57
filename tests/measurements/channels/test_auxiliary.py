"""Auxiliary channels: what a log has beside motion and commands has a name, and nothing else has it."""

import numpy as np
import pandas as pd
import pytest
import yaml

from undertow.measurements.channels.mapping import auxiliary_of
from undertow.measurements.formats.base import Name
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading

NAMES = {
    "outboard_steering": "steering_outboard",
    "rudder_angle": "steering_rudder",
    "steeringAngle": "steering",
    "thruster_azimuth_angle": "steering_thruster",
    "left_thruster_azimuth": "steering_port",
    "battery_voltage": "battery_voltage",
    "battery.current": "battery_current",
    "rpm_port": "rpm_port",
    "motor_1_rpm": "rpm_motor_1",
    "port_motor_current": "motor_current_port",
    "mode": "mode",
}
OTHERS = ("gps_satellite_azimuth", "sun_azimuth", "antenna_angle", "pwm_port", "current_speed", "heading", "u", "model")
OTHERS += ("rc_steer", "joystickRudder", "pilot_helm")


@pytest.mark.parametrize("column", NAMES)
def test_a_column_has_the_name_of_what_it_is(column: str):
    assert auxiliary_of(Name("", column)) == (NAMES[column], 1.0)


@pytest.mark.parametrize("column", OTHERS)
def test_other_columns_have_none(column: str):
    assert auxiliary_of(Name("", column)) is None


def test_a_namespace_of_a_remote_boat_is_no_stick():
    assert auxiliary_of(Name("/rc_boat", "rudder_angle")) is not None
    assert auxiliary_of(Name("/rc_boat/battery", "voltage")) == ("battery_voltage", 1.0)


def test_ros_messages_are_known_by_their_type():
    assert auxiliary_of(Name("/battery", "current", "sensor_msgs/msg/BatteryState")) == ("battery_current", -1.0)
    assert auxiliary_of(Name("/wamv/thrusters/left/pos", "data", "std_msgs/msg/Float64")) == ("steering_port", 1.0)


def test_what_a_map_mixes_into_sides_steers_no_more(tmp_path):
    time = np.arange(0.0, 5.0, 0.1)
    frame = pd.DataFrame({"t": time, "u": time, "psi": time, "throttle": 0.5 + 0.0 * time, "steering": 0.1 * time})
    frame.to_csv(tmp_path / "log.csv", index=False)
    side = {"from": "throttle", "mix": "skid", "steering": {"from": "steering"}}
    mixed = {"normalized_port": side, "normalized_stbd": side}
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(mixed))
    assert list(read_log(tmp_path / "log.csv").auxiliary) == ["steering"]
    assert not read_log(tmp_path / "log.csv", Reading(channel_map=tmp_path / "map.yaml")).auxiliary
    assert not Log.from_dataframe(frame, channel_map=mixed).auxiliary


def test_a_table_keeps_them_beside_its_channels(tmp_path):
    time = np.arange(0.0, 5.0, 0.1)
    frame = pd.DataFrame({"t": time, "u": time, "psi": time, "battery_voltage": 12.0 + time, "mode": ["AUTO"] * 50})
    frame.to_csv(tmp_path / "log.csv", index=False)
    for log in (read_log(tmp_path / "log.csv"), Log.from_dataframe(frame)):
        assert list(log.auxiliary) == ["battery_voltage"]
        assert "battery_voltage" not in log.channels
        assert log.auxiliary["battery_voltage"].unit == "V"
        np.testing.assert_array_equal(log.auxiliary["battery_voltage"].value, 12.0 + time)
