"""A cause has one size all over a log; what stands in for another cause has several, and is not certain."""

import numpy as np
import pytest

from undertow.discovery.discover import find_missing
from undertow.discovery.findings import FoundEffect
from undertow.discovery.reason import Reason
from undertow.physics.matrices import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.simulation import rollout
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import NOISE, World, simulate_world

HULL = load_vehicle("blueboat")


class Kinked(World):
    """A hull whose drag begins at 0.8 m/s."""

    __slots__ = ()

    def _driven(self, start: Motion) -> Motion:
        inverse = np.linalg.inv(mass_matrix(self.vehicle))

        def added(step: int, state: np.ndarray) -> np.ndarray:
            u = state[3]
            return inverse @ np.stack([-30.0 * np.sign(u) * np.maximum(np.abs(u) - 0.8, 0.0), 0.0 * u, 0.0 * u])

        found = rollout(self.vehicle, start, np.array([0]), start.time.size - 1, added).states[0]
        return Motion(start.time, found[:, :2], found[:, 2], found[:, 3:], start.commands, start.thrusters)


def effect(motion: Motion, name: str) -> FoundEffect:
    findings = find_missing([motion], HULL).findings
    return next(c for c in findings.candidates if c.effect == name)


@pytest.mark.parametrize("noise", ["clean", "field"])
def test_a_true_drag_is_one_number_everywhere(noise: str):
    world = simulate_world(HULL, {"surge_quadratic_damping": -8.0}, duration=240.0, noise=noise, seed=3)
    found = effect(world.motion(), "surge_quadratic_damping")
    assert found.verdict == "missing"
    assert found.agrees is True
    assert {"slow", "fast", "ahead", "astern"} & {part.where for part in found.parts}
    for part in found.parts:
        assert part.value == pytest.approx(-8.0, rel=0.15)
        assert part.ci95.lower <= part.value <= part.ci95.upper


def test_a_drag_with_a_kink_is_no_quadratic_drag_for_sure():
    """Fast, it asks for more of it than slow."""
    found = effect(Kinked(HULL, "zigzag", 240.0, 4).run(NOISE["field"]).motion(), "surge_quadratic_damping")
    assert found.agrees is False
    assert (found.verdict, found.reason) == ("possible", Reason.DOUBTFUL_VALUE)
    assert "slow and" in found.sentence


def test_parts_stand_in_the_file_beside_whether_they_agree():
    world = simulate_world(HULL, {"yaw_trim": 2.0}, duration=200.0, noise="field", seed=5)
    content = effect(world.motion(), "yaw_trim").to_dict()
    assert content["agrees"] is True
    assert set(content["parts"][0]) == {"where", "symbol", "value", "ci95"}
