"""Rollouts judged beside a compass that may deviate: what that makes of them is whitened out, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.shooting import Shooting, ShootingSettings
from undertow.measurements.kinematics import corrected_for
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
LOG = simulate_world(HULL, {}, duration=120.0, seed=4, noise="field").motion()


@pytest.mark.parametrize("name", ["compass_constant", "compass_sine", "compass_cosine"])
def test_a_deviation_leaves_little_of_itself(name: str):
    turned = corrected_for(LOG, {name: 0.05})
    plain, beside = (
        Shooting([LOG], HULL, replace(ShootingSettings(), turned=deviation)) for deviation in (0.0, np.radians(5.0))
    )
    moved = [form.recorded([turned], HULL) - form.residual(HULL) for form in (plain, beside)]
    before, after = (np.square(rows / plain.scale).sum() for rows in moved)
    assert after < 0.05 * before


def test_what_a_law_of_sway_does_stays():
    other = HULL.with_values({"Y_vv": -150.0})
    moved = []
    for deviation in (0.0, np.radians(5.0)):
        form = Shooting([LOG], HULL, replace(ShootingSettings(), turned=deviation))
        moved.append(float(np.square((form.residual(other) - form.residual(HULL)) / form.scale).sum()))
    assert moved[1] > 0.3 * moved[0]
