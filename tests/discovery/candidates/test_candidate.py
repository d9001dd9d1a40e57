"""Which effects are candidates for a vehicle."""

import pytest

from undertow.discovery.candidates.candidate import candidates
from undertow.physics.effects import BY_NAME, EFFECTS
from undertow.physics.vehicle import Hull, Vehicle, load_vehicle


@pytest.fixture(scope="module")
def stated() -> Vehicle:
    return load_vehicle("blueboat").model_copy(update={"hull": Hull(length=1.4, draught=0.12)})


def test_cross_flow_drag_is_one_only_where_the_file_states_the_hull(stated: Vehicle) -> None:
    bare, whole = ({c.effect.name for c in candidates(v)} for v in (load_vehicle("blueboat"), stated))
    assert whole - bare == {"cross_flow_drag"}
    assert whole == {effect.name for effect in EFFECTS}


@pytest.mark.parametrize("name", ["sway_added_mass", "yaw_added_mass", "surge_linear_damping", "sway_linear_damping"])
def test_a_search_keeps_the_limits_of_the_hull(name: str) -> None:
    hull = load_vehicle("blueboat")
    (candidate,) = candidates(hull, [BY_NAME[name]])
    (parameter,) = candidate.parameters
    assert parameter.lower == hull.parameter(parameter.symbol).lower > -float("inf")
    heavy = hull.with_values({parameter.symbol: 2.0 * parameter.lower})
    (beyond,) = candidates(heavy, [BY_NAME[name]])
    assert beyond.parameters[0].lower == 2.0 * parameter.lower, "what the file says is its own limit"
