"""A search that ended with stand-ins is searched again: from without each of them, and from the other side."""

import numpy as np

from undertow.discovery.discover import find_missing
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


def named(seed: int, hidden: dict[str, float], programme: str, noise: str) -> set[str]:
    hull = random_hull(load_vehicle("blueboat"), np.random.default_rng([seed, 77]))
    motion = simulate_world(hull, hidden, programme=programme, duration=240.0, noise=noise, seed=seed).motion()
    return set(find_missing([motion], hull).findings.missing)


def test_a_few_stand_ins_are_exchanged_for_as_many():
    """In gentle turns a short arm, a drag and a battery look like weak thrusters, a trim and the battery."""
    found = named(7123, {"thrust_rate": -0.0928, "X_u": -16.27, "arm_scale": 0.6143}, "gentle", "clean")
    assert found == {"thruster_arm", "battery_sag", "surge_linear_damping"}


def test_a_crowd_is_met_from_every_effect_of_the_hull():
    """Added mass in surge, a moment and another curve of the thrusters drew seven names one after the other."""
    gains = {"astern_100": 0.411, "astern_67": 1.077, "astern_33": 1.48}
    gains |= {"ahead_33": 1.351, "ahead_67": 1.115, "ahead_100": 0.384}
    hidden = {"X_udot": -16.09, "N_uv": -16.21, **{f"gain_{where}": gain for where, gain in gains.items()}}
    assert named(7112, hidden, "rich", "field") == {"surge_added_mass", "munk_moment", "thrust_curve"}
