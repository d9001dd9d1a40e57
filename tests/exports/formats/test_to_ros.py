"""The ROS 2 parameters are lawful, and make the same vehicle again."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from exported import BOATS, boat, written

from undertow.physics.vehicle import vehicle_from_dict


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
    vehicle["name"] = parameters["vehicle_name"]
    for key in ("thrusters", "terms"):
        if key in vehicle:
            named = vehicle[key].pop("names")
            vehicle[key] = [({"name": n} if key == "thrusters" else {}) | vehicle[key][n] for n in named]
    again = vehicle_from_dict(vehicle, "the parameters")
    assert again.values == boat(name).values
    assert again.thrusters == boat(name).thrusters
