"""What changes while a log is recorded: thrust, drag and current by the minute, in the force equation and rollouts."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.discover import find_missing
from undertow.physics.errors import VehicleError
from undertow.physics.forces import modelled_acceleration, modelled_force
from undertow.physics.integration import rollout, simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import read_inputs

HULL = load_vehicle("blueboat")
CHANGES = ({"battery_sag": -0.08}, {"hull_fouling": 0.15}, {"turning_current": (0.05, -0.03)})
every_change = pytest.mark.parametrize("change", CHANGES, ids=lambda change: next(iter(change)))


def driven(minutes: float = 2.0) -> Motion:
    """A motion of the unchanged hull, ahead and turning, that begins at some time of a log."""
    t = 60.0 * minutes + 0.1 * np.arange(300, dtype=float)
    push = np.column_stack([20.0 + 8.0 * np.sin(0.4 * t), 20.0 + 8.0 * np.cos(0.3 * t)]) * 5.0 + 1500.0
    still = Motion(t, np.zeros((300, 2)), np.zeros(300), np.zeros((300, 3)), push, ("port", "stbd"))
    return simulate_motion(HULL, still)


@every_change
def test_nothing_has_changed_when_the_log_begins(change: Mapping[str, float]):
    start, changed = driven(0.0).slice(0, 2), apply_effects(HULL, change)
    before, after = (modelled_force(vehicle, start)[0] for vehicle in (HULL, changed))
    np.testing.assert_array_equal(after, before)


def test_a_battery_takes_its_share_of_all_thrust():
    idle = replace(driven(), velocity=np.zeros((300, 3)))
    before, after = (modelled_force(v, idle) for v in (HULL, apply_effects(HULL, {"battery_sag": -0.08})))
    np.testing.assert_allclose(after, before * (1.0 - 0.08 * idle.minutes)[:, None], atol=1e-9)


def test_an_empty_battery_does_not_push_backwards():
    idle = replace(driven(30.0), velocity=np.zeros((300, 3)))
    assert not modelled_force(HULL.with_values({"thrust_rate": -0.2}), idle).any()


def test_weed_takes_its_share_of_all_damping():
    motion = driven()
    undamped = vehicle_from_dict(HULL.to_dict() | {"damping": {}}, "undamped")
    drag = modelled_force(HULL, motion) - modelled_force(undamped, motion)
    more = modelled_force(apply_effects(HULL, {"hull_fouling": 0.15}), motion) - modelled_force(HULL, motion)
    np.testing.assert_allclose(more, 0.15 * motion.minutes[:, None] * drag, atol=1e-9)


def test_a_body_without_hydrodynamics_does_not_feel_a_current_that_changes():
    """The water carries nothing that has no added mass and no drag: its frame only moves."""
    bare = vehicle_from_dict(HULL.to_dict() | {"added_mass": {}, "damping": {}}, "bare")
    motion = driven()
    turned = bare.with_values({"current_north": 0.2, "current_rate_north": 0.6, "current_rate_east": -0.4})
    change = modelled_acceleration(turned, motion) - modelled_acceleration(bare, motion)
    # Fossen (2021), property 10.1 holds for a constant current; what changes carries the hull along (here all of it).
    ahead = (0.6 * np.cos(motion.heading) - 0.4 * np.sin(motion.heading)) / 60.0
    np.testing.assert_allclose(change[:, 0], ahead, atol=1e-12)


@every_change
def test_a_rollout_from_the_middle_goes_on_as_the_whole_does(change: Mapping[str, float]):
    changed = apply_effects(HULL, change)
    whole = simulate_motion(changed, driven())
    part = rollout(changed, whole, np.array([100]), 150).states[0]
    np.testing.assert_allclose(part[:, 3:], whole.velocity[100:251], atol=1e-9)
    other = rollout(changed, replace(whole, minutes=whole.minutes + 5.0), np.array([100]), 150).states[0]
    assert np.abs(other[:, 3:] - part[:, 3:]).max() > 1e-3


@every_change
@pytest.mark.parametrize("noise", ["clean", "field"])
def test_discovery_names_it(change: Mapping[str, float], noise: str):
    found = find_missing([simulate_world(HULL, change, duration=240.0, noise=noise, seed=11).motion()], HULL)
    assert found.findings.missing == tuple(change)
    truth: Vehicle = apply_effects(HULL, change)
    for term in next(c for c in found.findings.candidates if c.verdict == "missing").terms:
        assert term.value == pytest.approx(truth.value(term.symbol), rel=0.1, abs=0.005)


def test_nothing_changes_in_a_steady_log():
    found = find_missing([simulate_world(HULL, {}, duration=240.0, noise="field", seed=12).motion()], HULL)
    assert found.findings.missing == ()


def test_a_log_whose_clock_does_not_begin_at_zero_is_the_same_log(tmp_path: Path):
    log = simulate_world(HULL, {"battery_sag": -0.08}, duration=200.0, noise="field", seed=13)
    table = pd.read_csv(log.write(tmp_path / "log.csv"))
    later = tmp_path / "later.csv"
    table.assign(time=table["time"] + 1000.0).to_csv(later, index=False)
    found = [find_missing(read_inputs(path, HULL).fitting, HULL).findings for path in (tmp_path / "log.csv", later)]
    assert found[0].missing == found[1].missing == ("battery_sag",)
    one, other = (next(c for c in findings.candidates if c.verdict == "missing").terms[0].value for findings in found)
    assert other == pytest.approx(one, rel=1e-3)


@every_change
def test_what_a_model_claims_is_its_own_balance(change: Mapping[str, float]):
    changed, motion = apply_effects(HULL, change), driven()
    weak = WeakForm([motion], WeakSettings(), [modelled_acceleration(changed, motion)])
    np.testing.assert_allclose(weak.residual(changed), 0.0, atol=1e-9)


def test_drag_that_falls_for_ever_is_refused():
    with pytest.raises(VehicleError, match="fouling_rate must not be negative"):
        vehicle_from_dict(HULL.to_dict() | {"damping": {"X_u": -10.0, "fouling_rate": -0.1}}, "clean")
    with pytest.raises(
        VehicleError, match=r"fouling_rate = 0\.9 1/min is more than any hull has: at most 0\.5 was expected"
    ):
        vehicle_from_dict(HULL.to_dict() | {"damping": {"X_u": -10.0, "fouling_rate": 0.9}}, "fouled")


def test_a_thruster_cannot_bear_the_name_of_a_scale_of_all():
    data = HULL.to_dict()
    data["thrusters"][0]["name"] = "arm"
    with pytest.raises(VehicleError, match="arm_scale is that of all thrusters"):
        vehicle_from_dict(data, "arm")
