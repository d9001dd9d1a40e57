"""What a vehicle leaves to learn is told apart from the noise of the sensors."""

import numpy as np
import pytest

from undertow.measurements.preparation.dataset import PAPER, DataSet
from undertow.measurements.preparation.derive import smooth
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.left_to_learn import left_to_learn

HULL = load_vehicle("blueboat")
TRIM = {"surge_trim": 6.0}


def world(noise: str) -> DataSet:
    """Two parts of a boat that is pushed ahead by 6 N."""
    motion = simulate_world(HULL, TRIM, programme="gentle", duration=240.0, noise=noise, seed=4).motion(0.1)
    raw = motion.slice(0, 1200), motion.slice(1210, motion.time.size)
    return DataSet(tuple(smooth(part, 1.2) for part in raw), (), PAPER, raw)


@pytest.mark.parametrize("noise", ["field", "rough"])
def test_a_push_is_learnable_and_noise_is_not(noise: str):
    data = world(noise)
    left = left_to_learn(HULL, [data])
    assert left.learnable.tolist() == [True, False, False]
    assert left.beyond[0] == pytest.approx(6.0 / (HULL.mass - HULL.value("X_udot")), rel=0.1)
    np.testing.assert_allclose(left.noise[1:], left.error[1:], rtol=0.15)
    assert not left_to_learn(apply_effects(HULL, TRIM), [data]).learnable.any()
    assert left.to_dict()["surge"]["learnable"] is True


def test_of_a_record_without_noise_all_is_learnable():
    left = left_to_learn(HULL, [world("clean")])
    assert left.noise[0] < 0.01 * left.error[0]
    assert left.learnable[0]


def test_parts_count_together():
    data = world("field")
    parts = [DataSet((motion,), (), PAPER, (raw,)) for motion, raw in zip(data.motions, data.raw, strict=True)]
    both, whole = left_to_learn(HULL, parts), left_to_learn(HULL, [data])
    np.testing.assert_array_equal(both.error, whole.error)
    assert both.scatter == whole.scatter < left_to_learn(HULL, parts[:1]).scatter
