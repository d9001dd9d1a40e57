"""Which effects are candidates for a vehicle, and which of them a log with a blind axis can judge."""

import pytest

from undertow.discovery.candidates.candidate import candidates, part_by_sight
from undertow.physics.effects import EFFECTS
from undertow.physics.vehicle import Hull, Vehicle, load_vehicle


@pytest.fixture(scope="module")
def stated() -> Vehicle:
    return load_vehicle("blueboat").model_copy(update={"hull": Hull(length=1.4, draught=0.12)})


def test_cross_flow_drag_is_one_only_where_the_file_states_the_hull(stated: Vehicle) -> None:
    bare, whole = ({c.effect.name for c in candidates(v)} for v in (load_vehicle("blueboat"), stated))
    assert whole - bare == {"cross_flow_drag"}
    assert whole == {effect.name for effect in EFFECTS}


def test_a_log_that_is_blind_in_sway_does_not_judge_it(stated: Vehicle) -> None:
    """What is left of it in yaw is N_rr r|r|."""
    seen, unseen = part_by_sight(candidates(stated), (False, True, False))
    assert "cross_flow_drag" in {c.key for c in unseen}
    assert "yaw_quadratic_damping" in {c.key for c in seen}
