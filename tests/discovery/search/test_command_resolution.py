"""Commands recorded in coarse steps: what the steps explain as well is not called missing, and what they do not is."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.base import Balance, WeakSettings
from undertow.discovery.balance.shooting import Shooting, ShootingSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.discover import find_missing
from undertow.discovery.search.rival_explanations import coarse_records
from undertow.discovery.sensor_error_search import HiddenErrors
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import typical_effect
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
LARGEST = 35.0


def zigzag(effects: dict[str, float] | None = None) -> Motion:
    return simulate_world(HULL, effects or {}, programme="zigzag", duration=200.0, noise="clean", seed=3).motion()


def rounded(motion: Motion, step: float = LARGEST / 30.0) -> Motion:
    return replace(motion, commands=np.round(motion.commands / step) * step)


def held_at(*levels: float) -> Motion:
    motion = zigzag()
    rows = np.arange(motion.time.size) * len(levels) // motion.time.size
    return replace(motion, commands=np.column_stack([np.array(levels)[rows]] * 2), run_up=None)


def test_the_step_of_a_coarse_record_is_seen():
    (found,) = coarse_records([rounded(zigzag())])
    assert found.columns == (0, 1)
    assert found.step == pytest.approx(LARGEST / 30.0, rel=1e-3)


def test_thrusters_whose_steps_differ_have_one_each():
    motion = rounded(zigzag())
    other = replace(motion, commands=motion.commands * np.array([1.0, 1.13]))
    steps = [found.step for found in coarse_records([other])]
    assert steps == pytest.approx([LARGEST / 30.0, 1.13 * LARGEST / 30.0], rel=1e-3)


@pytest.mark.parametrize(
    "levels",
    [(0.0, 10.0, 20.0, 30.0, 40.0), (0.0, 17.31, 20.77, 8.113, 3.019, 29.4), (5.0,) * 6],
    ids=["chosen", "as they come", "one"],
)
def test_levels_that_are_no_multiples_of_a_small_step_tell_none(levels: tuple[float, ...]):
    assert coarse_records([held_at(*levels)]) == ()


def test_rounded_commands_are_not_called_a_thrust_curve():
    found = find_missing([rounded(zigzag())], HULL).findings
    assert found.missing == ()


@pytest.mark.parametrize("name", ["surge_quadratic_damping", "thrust_curve", "thrust_exponent", "thruster_lag"])
def test_what_is_more_than_a_rounding_is_named(name: str):
    motion = zigzag(typical_effect(name, HULL, np.random.default_rng(1)))
    assert find_missing([motion], HULL).findings.missing == (name,)


@pytest.mark.parametrize("moved", ["commands", "sensor"])
@pytest.mark.parametrize("kind", ["forces", "rollouts"])
def test_a_balance_of_another_record_is_that_of_a_log_with_it(kind: str, moved: str):
    motion = zigzag()
    other = rounded(motion, 7.0) if moved == "commands" else HiddenErrors(0.2, -0.1, 0.05).corrected(motion)

    def judge(of: Motion) -> Balance:
        weak = WeakForm([of], WeakSettings())
        return weak if kind == "forces" else Shooting([of], HULL, ShootingSettings(robust=np.inf))

    balance = judge(motion)
    np.testing.assert_array_equal(balance.recorded([motion], HULL), balance.residual(HULL))
    told = balance.recorded([other], HULL)
    np.testing.assert_allclose(told, judge(other).residual(HULL), atol=1e-12)
    assert np.abs(told - balance.residual(HULL)).max() > 0.01
