"""Commands that are recorded early or late name no effect: their timing is a part of every model."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.add_effects import add_effects
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.candidates.candidate import calibratable
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.record_errors import record_errors
from undertow.discovery.search.estimation import Interval
from undertow.measurements.canonical import Channel
from undertow.measurements.kinematics import gyro_lateness
from undertow.measurements.log import read_log
from undertow.measurements.preparation.prepare import WEAK, prepare
from undertow.measurements.preparation.resampling import command_step
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.sampled_series import area_average
from undertow.physics.vehicle import load_vehicle, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import parse_effect
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


def test_what_is_added_by_name_is_fitted_beside_the_timing():
    found = add_effects([zigzag(0.06)], HULL, ["yaw_added_mass"], DiscoverySettings())
    (term,) = found.findings.candidates[0].terms
    assert abs(term.value) < 0.06  # without it, a third of the boat's own
    assert all(vehicle.value("command_offset") == 0.0 for _, vehicle in found.steps)
    with pytest.raises(RequestError, match="an error of the log"):
        calibratable(HULL, ("command_offset",))
    with pytest.raises(RequestError, match="command_offset"):
        parse_effect("command_offset=0.3")


def test_changes_that_were_logged_are_exact_however_often_they_come():
    rng = np.random.default_rng(2)
    time = np.array([0.05, 0.06, 0.4, 1.5] * 50, dtype=float).cumsum()
    changes = Channel("newton_port", time, rng.uniform(-20.0, 20.0, 200), "command")
    at_a_rate = Channel(
        "newton_port", np.linspace(0.0, 19.9, 200), np.repeat(rng.uniform(-20.0, 20.0, 10), 20), "command"
    )
    assert command_step([changes]) == 0.0
    assert command_step([changes, at_a_rate]) == pytest.approx(0.1)


def test_a_delay_within_the_step_of_the_record_is_its_look_alike():
    findings = find_missing([zigzag(0.0, effects={"input_delay": 0.08})], HULL).findings
    assert "input_delay" not in findings.missing
    assert [s.verdict for s in findings.sensors] == ["present"]
    delay = next(c for c in findings.candidates if c.effect == "input_delay")
    assert (delay.verdict, delay.indistinguishable_from) == ("possible", ("channel_offset",))


@pytest.mark.parametrize("late", [2, 4])
def test_a_gyro_that_is_late_is_told_and_is_no_inertia(late):
    motion = simulate_world(HULL, {}, programme="gentle", duration=240.0, noise="field", seed=5).motion()
    velocity = motion.velocity.copy()
    velocity[late:, 2] = velocity[:-late, 2]
    findings = find_missing([replace(motion, velocity=velocity)], HULL).findings
    assert findings.missing == ()
    (told,) = [s for s in findings.sensors if s.verdict == "present"]
    assert told.sentence.startswith("The gyro tells of turns 0.")
    assert gyro_lateness([replace(motion, velocity=velocity)]) == pytest.approx(late * motion.time_step, abs=0.005)


def test_an_offset_beside_a_model_that_is_not_certain_is_only_possible():
    discovery = find_missing([zigzag(0.06, effects={"yaw_quadratic_damping": 1.0})], HULL)
    assert [s.what for s in discovery.findings.sensors if s.verdict != "no evidence"] == ["command_offset"]
    search = discovery.basis.force_search
    state = search.evaluate(HULL, ())
    intervals = {"command_offset": Interval(-0.07, -0.05)}
    (told,) = record_errors(search, state.vehicle, state.active, intervals, certain=False)
    assert (told.verdict, told.what) == ("possible", "command_offset")
    assert "The commands may act" in told.sentence
    assert "is not certain itself" in told.sentence
