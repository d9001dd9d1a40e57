"""A cause has one size all over a log; what stands in for another cause has several, and is less sure for it."""

import pytest
from dragged_world import Dragged, beyond

from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.invariance import invariance
from undertow.discovery.findings import EffectFinding
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import SearchSettings
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import NOISE, simulate_world

HULL = load_vehicle("blueboat")


def effect(motion: Motion, name: str) -> EffectFinding:
    findings = find_missing([motion], HULL).findings
    return next(c for c in findings.candidates if c.effect == name)


@pytest.mark.parametrize("noise", ["clean", "field"])
def test_a_true_drag_is_one_number_everywhere(noise: str):
    world = simulate_world(HULL, {"surge_quadratic_damping": -8.0}, duration=240.0, noise=noise, seed=3)
    found = effect(world.motion(), "surge_quadratic_damping")
    assert found.verdict == "missing"
    assert found.agrees is True
    assert found.claim is not None
    assert {"slow", "fast", "ahead", "astern"} & {part.where for part in found.parts}
    for part in found.parts:
        assert part.value == pytest.approx(-8.0, rel=0.15)
        assert part.ci95.lower <= part.value <= part.ci95.upper


def test_a_drag_with_a_kink_is_no_quadratic_drag_for_sure():
    """Fast, it asks for more of it than slow."""
    motion = Dragged(HULL, "zigzag", 240.0, 4, drag=beyond(0.8, 30.0)).run(NOISE["field"]).motion()
    key = "surge_quadratic_damping"
    search = Search(
        WeakForm([motion], WeakSettings()), HULL, [c for c in candidates(HULL) if c.key == key], SearchSettings()
    )
    state = search.evaluate(HULL, (key,))
    said = invariance(search, state, search.linearise(state.vehicle, state.active, state.fit.in_sample))
    size = abs(state.vehicle.value("X_uu") - HULL.value("X_uu"))
    assert said[key].gap > 0.15
    assert said[key].scatter["X_uu"] > 0.1 * size
    found = effect(motion, key)
    assert found.verdict != "missing"


def test_parts_stand_in_the_file_beside_whether_they_agree():
    world = simulate_world(HULL, {"yaw_trim": 2.0}, duration=200.0, noise="field", seed=5)
    content = effect(world.motion(), "yaw_trim").to_dict()
    assert content["agrees"] is True
    assert set(content["parts"][0]) == {"where", "symbol", "value", "ci95"}
