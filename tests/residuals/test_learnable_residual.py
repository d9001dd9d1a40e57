"""What a vehicle leaves to learn is told apart from noise of the sensors and what preparing leaves."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.measurements.preparation.prepare import PAPER, DataSet
from undertow.measurements.preparation.resampling import smooth
from undertow.physics.integration import rollout
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.learnable_residual import measure_learnable_residual, twin

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
    left = measure_learnable_residual(HULL, [data])
    assert left.learnable.tolist() == [True, False, False]
    more = np.sqrt(left.error[0] ** 2 - left.floor[0] ** 2)
    assert more == pytest.approx(6.0 / (HULL.mass - HULL.value("X_udot")), rel=0.1)
    np.testing.assert_allclose(left.noise[1:], left.error[1:], rtol=0.15)
    assert left.worth_it
    known = measure_learnable_residual(apply_effects(HULL, TRIM), [data])
    assert not known.learnable.any()
    assert not known.worth_it
    assert known.position == pytest.approx(known.position_floor, rel=0.5)
    assert left.position > 1.5 * left.position_floor > 2.0 * left.position_preparation
    assert left.to_dict()["surge"]["learnable"] is True


def test_of_a_record_without_noise_all_but_what_preparing_leaves_is_learnable():
    left = measure_learnable_residual(HULL, [world("clean")])
    assert left.noise[0] < 0.01 * left.error[0]
    assert left.learnable[0]
    assert not measure_learnable_residual(apply_effects(HULL, TRIM), [world("clean")]).worth_it


def test_the_twin_of_a_motion_is_driven_half_a_step_of_the_record_earlier():
    motion = simulate_world(HULL, {}, duration=60.0, noise="clean", seed=4).motion(0.1)
    rows = motion.time.size
    ramp = replace(motion, commands=np.repeat(1500.0 + 2.0 * np.arange(rows)[:, None], 2, axis=1))
    early = replace(ramp, commands=np.minimum(ramp.commands + 2.0, ramp.commands[-1]))
    found = twin(HULL, replace(ramp, command_step=0.2))
    states = rollout(HULL, early, np.array([0]), rows - 1).states[0]
    np.testing.assert_allclose(found.velocity, states[:, 3:], atol=1e-12)
    assert found.commands is ramp.commands


def test_parts_count_together():
    data = world("field")
    parts = [DataSet((motion,), (), PAPER, (raw,)) for motion, raw in zip(data.motions, data.raw, strict=True)]
    both, whole = measure_learnable_residual(HULL, parts), measure_learnable_residual(HULL, [data])
    np.testing.assert_array_equal(both.error, whole.error)
    assert both.scatter == whole.scatter < measure_learnable_residual(HULL, parts[:1]).scatter
