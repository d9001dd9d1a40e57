"""Which effects are candidates for a vehicle."""

import pytest

from undertow.discovery.candidates.candidate import candidates
from undertow.physics.effects import EFFECTS
from undertow.physics.vehicle import Hull, Vehicle, load_vehicle


@pytest.fixture(scope="module")
def stated() -> Vehicle:
    return load_vehicle("blueboat").model_copy(update={"hull": Hull(length=1.4, draught=0.12)})


def test_cross_flow_drag_is_one_only_where_the_file_states_the_hull(stated: Vehicle) -> None:
    bare, whole = ({c.effect.name for c in candidates(v)} for v in (load_vehicle("blueboat"), stated))
    assert whole - bare == {"cross_flow_drag"}
    assert whole == {effect.name for effect in EFFECTS}
