"""Commands that are recorded early or late name no effect: their timing is a part of every model."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.discover import find_missing
from undertow.measurements.log import read_log
from undertow.measurements.preparation.dataset import WEAK
from undertow.measurements.preparation.prepare import prepare
from undertow.physics.averages import area_average
from undertow.physics.errors import VehicleError
from undertow.physics.vehicle import load_vehicle, vehicle_from_dict
from undertow.physics.worlds.manoeuvres import COMMAND_STEP
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


def zigzag(late: float, hold: bool = True, effects=None, seed: int = 3):
    """A zigzag whose record of the commands is so late [s], in straight lines where it does not hold."""
    log = simulate_world(HULL, effects or {}, programme="zigzag", duration=200.0, noise="field", seed=seed)
    motion = log.motion()
    commands = area_average(log.command_time + late, log.commands, motion.time, motion.time_step, hold=hold)
    return replace(motion, commands=commands, command_step=COMMAND_STEP)


@pytest.mark.parametrize(("late", "hold", "acts"), [(0.06, True, -0.06), (-0.04, True, 0.04), (0.0, False, 0.05)])
def test_a_record_that_is_early_or_late_names_nothing_and_is_told(late, hold, acts):
    findings = find_missing([zigzag(late, hold)], HULL).findings
    assert (findings.verdict, findings.unnamed) == ("nothing missing", ())
    (sensor,) = findings.sensors
    assert (sensor.error, sensor.verdict) == ("channel_offset", "present")
    (term,) = sensor.terms
    assert term.value == pytest.approx(acts, abs=0.015)
    assert term.ci95 is not None
    assert term.ci95.lower <= acts <= term.ci95.upper


def test_a_record_that_is_later_than_its_step_is_only_suspected():
    (sensor,) = find_missing([zigzag(0.3)], HULL).findings.sensors
    assert sensor.verdict == "possible"
    assert "by more than the 0.1 s" in sensor.sentence


def test_a_record_in_step_is_not_accused():
    discovery = find_missing([zigzag(0.0)], HULL)
    assert [s.verdict for s in discovery.findings.sensors] == ["no evidence"]
    assert discovery.corrected is HULL


def test_a_delay_is_named_and_as_vague_as_the_record():
    findings = find_missing([zigzag(0.0, effects={"input_delay": 0.4})], HULL).findings
    assert findings.missing == ("input_delay",)
    assert findings.sensors == ()  # the delay has taken its part
    (term,) = findings.candidates[0].terms
    assert term.value == pytest.approx(0.4, abs=0.02)
    assert term.ci95 is not None
    assert term.ci95.lower < 0.4 - 0.9 * COMMAND_STEP
    assert term.ci95.upper > 0.4 + 0.9 * COMMAND_STEP


def test_the_corrected_vehicle_and_its_steps_hold_no_error_of_the_log():
    discovery = find_missing([zigzag(0.06, effects={"surge_quadratic_damping": -8.0})], HULL)
    assert discovery.findings.missing == ("surge_quadratic_damping",)
    for vehicle in (discovery.corrected, *(v for _, v in discovery.steps)):
        assert vehicle.value("command_offset") == 0.0
    assert "command_offset" not in str(HULL.with_values({"command_offset": 0.05}).to_dict())


def test_no_vehicle_file_has_one():
    content = HULL.to_dict()
    content["thrusters"][0]["command_offset"] = 0.05
    with pytest.raises(VehicleError, match="error of a log"):
        vehicle_from_dict(content, "mine")


def test_the_time_between_two_records_is_read_from_the_log(tmp_path):
    log = simulate_world(HULL, {}, duration=60.0, noise="clean", seed=1)
    (motion,) = prepare(read_log(log.write(tmp_path / "log.csv")), HULL, WEAK).motions
    assert motion.command_step == pytest.approx(COMMAND_STEP)
    changed = np.flatnonzero(np.any(np.diff(log.commands, axis=0) != 0.0, axis=1)) + 1
    rows = np.concatenate([[0], changed])
    sparse = replace(log, command_time=log.command_time[rows], commands=log.commands[rows])
    (motion,) = prepare(read_log(sparse.write(tmp_path / "changes.csv")), HULL, WEAK).motions
    assert motion.command_step == 0.0
