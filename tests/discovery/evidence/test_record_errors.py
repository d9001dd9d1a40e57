"""What a record is found to do wrong of which nobody can say which sensor it is."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.add_effects import add_effects
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.record_errors import turning
from undertow.measurements.kinematics import kinematics_of, turning_of
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("otter")


def turned(
    scale: float, seconds: float = 120.0, programme: str = "gentle", effects: dict[str, float] | None = None
) -> Motion:
    """A motion whose gyro says so many times what is true."""
    world = simulate_world(HULL, effects or {}, programme=programme, duration=seconds, noise="field", seed=2)
    motion = world.motion(0.05)
    return replace(motion, velocity=motion.velocity * np.array([1.0, 1.0, scale]))


@pytest.mark.parametrize("scale", [0.93, 1.06])
def test_a_gyro_that_disagrees_with_the_heading_is_told_and_blamed_on_no_effect(scale: float):
    motion = turned(scale)
    assert not kinematics_of([motion]).present
    findings = find_missing([motion], HULL).findings
    assert not findings.missing
    (told,) = [s for s in findings.sensors if s.error == "gyro_scale"]
    assert told.verdict == "possible"
    assert told.terms[0].value == pytest.approx(scale, abs=0.01)
    assert "which" in told.sentence
    assert all(0.0 <= e.claim.tests.get("accused", 0.0) <= 1.0 for e in findings.candidates if e.claim)


def test_who_adds_by_name_is_told_of_it_too():
    found = add_effects([turned(1.06)], HULL, ["yaw_linear_damping"], DiscoverySettings())
    assert [s.verdict for s in found.findings.sensors if s.error == "gyro_scale"] == ["possible"]


def test_drag_ahead_is_named_beside_it():
    findings = find_missing([turned(1.06, effects={"surge_quadratic_damping": -60.0})], HULL).findings
    said = {*findings.missing, *findings.likely}
    assert "surge_quadratic_damping" in said
    assert said <= {"surge_quadratic_damping", "surge_trim"}


def test_each_log_is_asked_alone():
    """Two that turn too little alone turn enough together: their gyros are two, and so are their scales."""
    motions = [replace(turned(scale), source=f"{scale}.csv") for scale in (1.06, 1.0)]
    (told,) = turning(motions)
    assert told.sentence.startswith("1.06.csv: ")
    assert told.terms[0].value == pytest.approx(1.06, abs=0.01)
    assert not turning([replace(motion, derived=(False, False, True)) for motion in motions])


def test_one_that_agrees_is_not_accused():
    findings = find_missing([turned(1.0)], HULL).findings
    assert findings.verdict == "nothing missing"
    assert not [s for s in findings.sensors if s.error == "gyro_scale"]


def test_where_the_boat_turns_enough_the_scale_itself_is_told():
    motion = turned(1.06, 300.0, "rich")
    assert not turning_of([motion]).values
    assert "gyro_scale" in kinematics_of([motion]).present


@pytest.mark.parametrize("effects", [{}, {"sway_lift": -40.0}])
def test_where_commands_are_late_by_more_than_a_step_nothing_is_certain(effects: dict[str, float]):
    motion = simulate_world(HULL, effects, programme="rich", duration=120.0, noise="field", seed=2).motion(0.05)
    late = np.concatenate([np.repeat(motion.commands[:1], 4, axis=0), motion.commands[:-4]])
    findings = find_missing([replace(motion, commands=late)], HULL).findings
    assert findings.missing == ()
    assert not effects or findings.candidates[0].effect in effects
    assert [s.verdict for s in findings.sensors if s.what == "command_offset"] == ["possible"]
