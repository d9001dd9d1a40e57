"""What stands in for an effect that was not judged, because sway may be wrong, is not sure; what is true stays."""

import pytest

from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates, part_by_sight
from undertow.discovery.evidence.limits import beside_unjudged
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import SearchSettings
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
SWAY = (False, True, False)


def doubts(hidden: dict[str, float], names: tuple[str, ...], noise: str) -> dict[str, str]:
    """Which effects are doubted that a judge named who does not see sway."""
    log = simulate_world(HULL, hidden, duration=200.0, seed=4, noise=noise).motion()
    seen, unseen = part_by_sight(candidates(HULL), SWAY)
    forces = Search(WeakForm([log], WeakSettings()), HULL, seen, SearchSettings())
    return beside_unjudged(forces, forces.evaluate(HULL, names), names, unseen)


@pytest.mark.parametrize("noise", ["clean", "field"])
def test_stand_ins_of_a_munk_moment_are_doubted_and_it_is_named(noise: str):
    names = ("surge_quadratic_damping", "yaw_linear_damping", "yaw_added_mass")
    found = doubts({"munk_moment": -30.0, "surge_quadratic_damping": -8.0}, names, noise)
    assert set(found) == {"yaw_linear_damping", "yaw_added_mass"}
    assert all("Munk moment" in told for told in found.values())


@pytest.mark.parametrize("noise", ["clean", "field"])
@pytest.mark.parametrize(("name", "size"), [("yaw_quadratic_damping", -6.0), ("yaw_speed_damping", -8.0)])
def test_what_truly_damps_yaw_is_not_doubted(name: str, size: float, noise: str):
    assert doubts({name: size}, (name,), noise) == {}


def test_thrust_that_stands_in_for_what_drifts_otherwise_is_doubted_and_weak_thrust_is_not():
    assert "sway lift" in doubts({"sway_lift": 15.0}, ("thrust_scale",), "field")["thrust_scale"]
    assert doubts({"thrust_scale": 0.9}, ("thrust_scale",), "field") == {}


def test_nothing_is_doubted_where_nothing_was_left_out():
    log = simulate_world(HULL, {"yaw_quadratic_damping": -6.0}, duration=60.0, seed=4).motion()
    forces = Search(WeakForm([log], WeakSettings()), HULL, candidates(HULL), SearchSettings())
    names = ("yaw_quadratic_damping",)
    assert beside_unjudged(forces, forces.evaluate(HULL, names), names, ()) == {}


@pytest.mark.parametrize("drift", [{"munk_moment": -30.0}, {"sway_lift": 15.0}], ids=["moment", "lift"])
def test_what_acts_besides_what_was_not_judged_is_no_stand_in_for_it(drift: dict[str, float]):
    assert doubts(drift | {"thruster_lag": 0.4}, ("thruster_lag",), "field") == {}
