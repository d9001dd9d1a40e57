"""Where all thrusters push harder than a file says, that is told, and not as an asymmetry alone."""

from undertow.discovery.add_effects import add_effects
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.search.rival_explanations import all_thrusters
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
BOTH = ["thruster_asymmetry[port]", "thruster_asymmetry[stbd]"]


def test_a_thrust_that_is_too_low_on_both_sides_is_told_beside_their_difference():
    hidden = {"port_scale": 1.3, "stbd_scale": 1.6}
    log = simulate_world(HULL.with_values(hidden), {}, duration=60.0, seed=5).motion(0.05)
    findings = add_effects([log], HULL, BOTH, DiscoverySettings()).findings
    told = "Both thrusters push harder than the vehicle file says, port 1.30 times and stbd 1.60 times. Of that, a"
    assert findings.reasons[0].startswith(told)
    assert [c.sentence.startswith(told) for c in findings.added] == [True, True]


def test_a_guess_is_called_one_and_a_fault_of_one_side_is_no_thrust_of_all():
    guess = {"thrusters": {"port": "force: full 26 N, typical, sure to a factor of 2.5; x: given"}}
    assumed = HULL.model_copy(update={"sources": guess})
    weaker = all_thrusters(assumed, assumed.with_values({"port_scale": 0.5, "stbd_scale": 0.75}), BOTH)
    assert weaker.startswith("Both thrusters push weaker than the vehicle file assumes (sure to a factor of 2.5), port")
    assert "a factor of 1.50 is the difference" in weaker
    assert weaker.endswith("the rest is thrust that the file has too high.")
    assert all_thrusters(HULL, HULL.with_values({"port_scale": 0.9, "stbd_scale": 1.1}), BOTH) == ""
    assert all_thrusters(HULL, HULL.with_values({"port_scale": 1.2}), BOTH[:1]) == ""
