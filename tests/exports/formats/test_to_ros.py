"""The ROS 2 parameters are lawful, and make the same vehicle again."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from exported import BOATS, boat, written

from undertow.exports.formats.to_ros import ros_parameters
from undertow.physics.vehicle import Vehicle, vehicle_from_dict


def check_types(value: Any) -> None:
    """A ROS 2 parameter is a number, a text, or a list of one of these; there is no nothing, and no list of lists."""
    if isinstance(value, dict):
        for name, inner in value.items():
            assert isinstance(name, str)
            check_types(inner)
    elif isinstance(value, list):
        assert value
        assert {type(each) for each in value} in ({float}, {str})
    else:
        assert isinstance(value, float | str)


@pytest.mark.parametrize("name", BOATS)
def test_they_make_the_same_vehicle_again(name: str, tmp_path: Path):
    content = yaml.safe_load(written(name, "ros", tmp_path / "boat.yaml").read_text("utf-8"))
    parameters = content["boat"]["ros__parameters"]
    check_types(parameters)
    vehicle = {key: value for key, value in parameters.items() if key not in ("axes", "vehicle_name")}
    again = read(vehicle, parameters["vehicle_name"])
    assert again.values == boat(name).values
    assert again.thrusters == boat(name).thrusters
    assert again.hull == boat(name).hull


def read(parameters: dict[str, Any], name: str) -> Vehicle:
    """The vehicle of parameters, their lists of names taken apart."""
    vehicle = {**parameters, "name": name}
    named = vehicle.pop("thruster_names")
    vehicle["thrusters"] = [{"name": each} | vehicle["thrusters"][each] for each in named]
    if "terms" in vehicle:
        vehicle["terms"] = [vehicle["terms"][each] for each in vehicle.pop("term_names")]
    return vehicle_from_dict(vehicle, "the parameters")


def test_a_thruster_may_be_called_names():
    port, starboard = boat("as it is").thrusters
    vehicle = boat("as it is").model_copy(update={"thrusters": (port.model_copy(update={"name": "names"}), starboard)})
    parameters = ros_parameters(vehicle)
    again = read({key: x for key, x in parameters.items() if key not in ("axes", "vehicle_name")}, "boat")
    assert again.thrusters == vehicle.thrusters
