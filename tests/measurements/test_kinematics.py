"""What sensors say of each other: every error is found at its size, nothing is found where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.measurements.compass import Compass, compass_of
from undertow.measurements.kinematics import compass_shown, corrected_for, kinematics_of
from undertow.physics.forces import apparent_wind
from undertow.physics.motion import Motion, body_to_earth, earth_to_body
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


def sailed(noise: str = "field", waves: float = 0.0, programme: str = "rich") -> Motion:
    world = simulate_world(HULL, {}, duration=240.0, noise=noise, waves=waves, seed=7, programme=programme)
    return world.motion(0.05)


def later(series: np.ndarray, motion: Motion, by: float) -> np.ndarray:
    return np.column_stack([np.interp(motion.time - by, motion.time, column) for column in series.T])


def spoilt(motion: Motion, name: str, size: float) -> Motion:
    """The motion as sensors with an error of that size record it."""
    velocity, position, psi = motion.velocity.copy(), motion.position.copy(), motion.heading
    if name == "gyro_scale":
        velocity[:, 2] *= size
    elif name == "gyro_bias":
        velocity[:, 2] += size
    elif name == "velocity_scale":
        velocity[:, :2] *= size
    elif name == "velocity_latency":
        velocity[:, :2] = later(velocity[:, :2], motion, size)
    elif name == "position_latency":
        position = later(position, motion, size)
    elif name == "compass_sine":
        off = size * np.sin(psi)
        velocity[:, :2] = np.column_stack(earth_to_body(-off, *velocity[:, :2].T))
        return replace(motion, velocity=velocity, heading=psi - off)
    elif name == "misalignment":
        return replace(motion, heading=psi - size)
    elif name == "water_east":
        velocity[:, :2] -= np.column_stack(earth_to_body(psi, np.zeros_like(psi), np.full_like(psi, size)))
    else:
        position += np.column_stack(body_to_earth(psi, np.full_like(psi, size), np.zeros_like(psi)))
    return replace(motion, velocity=velocity, position=position)


ERRORS = {
    "gyro_scale": 0.97,
    "gyro_bias": -0.01,
    "velocity_scale": 1.06,
    "velocity_latency": 0.25,
    "position_latency": 0.4,
    "compass_sine": 0.1,
    "misalignment": 0.12,
    "water_east": 0.2,
    "arm_x": 0.8,
}


def straight(seconds: float = 200.0) -> Motion:
    """A boat that bends to starboard by less than a quarter of a circle."""
    time = np.arange(0.0, seconds, 0.1)
    rate = 0.004 + 0.01 * np.sin(0.1 * time)
    heading = np.concatenate([[0.0], np.cumsum(0.05 * (rate[1:] + rate[:-1]))])
    speeds = np.column_stack([np.full_like(time, 1.2), np.zeros_like(time), rate])
    north, east = body_to_earth(heading, speeds[:, 0], speeds[:, 1])
    place = np.column_stack([np.cumsum(north), np.cumsum(east)]) * 0.1
    noise = np.random.default_rng(3).standard_normal((time.size, 2)) * [0.002, 0.002]
    speeds[:, 2] += noise[:, 1]
    return Motion(time, place, heading + noise[:, 0], speeds, np.zeros((time.size, 2)), ("port", "stbd"))


def test_a_gyro_bias_is_told_where_the_boat_turns_too_little_for_the_rest():
    found = kinematics_of([spoilt(straight(), "gyro_bias", 0.006)])
    assert "gyro_bias" in found.present
    assert found.values["gyro_bias"][0] == pytest.approx(0.006, abs=5e-4)
    assert not {"gyro_scale", "compass_sine"} & set(found.values)
    assert "gyro_bias" not in kinematics_of([straight()]).present


@pytest.mark.parametrize("noise", ["clean", "field"])
@pytest.mark.parametrize("name", list(ERRORS))
def test_an_error_of_a_sensor_is_found_and_taken_away(name: str, noise: str):
    right, size = sailed(noise), ERRORS[name]
    wrong = spoilt(right, name, size)
    found = kinematics_of([wrong])
    assert name in found.present
    assert set(found.present) <= {name, name.replace("sine", "cosine")}
    assert found.values[name][0] == pytest.approx(size, abs=0.06 * max(abs(size), 0.1))
    mended = corrected_for(wrong, found.errors)
    rows = np.isin(right.time, mended.time)
    assert np.abs(mended.velocity - right.velocity[rows])[20:-20].std() < 0.05
    assert kinematics_of([mended]).present == ()


@pytest.mark.parametrize("noise", ["clean", "field"])
def test_positions_that_are_ahead_belong_to_speeds_over_ground_that_are_late(noise: str):
    """A receiver gives its speeds late, and the heading of that moment turns them into the body."""
    right = sailed(noise)
    ground = later(np.column_stack(body_to_earth(right.heading, *right.velocity[:, :2].T)), right, 0.4)
    speeds = np.column_stack(earth_to_body(right.heading, *ground.T))
    wrong = replace(right, velocity=np.column_stack([speeds, right.velocity[:, 2]]))
    found = kinematics_of([wrong])
    assert found.present == ("position_latency",)
    assert found.values["position_latency"][0] == pytest.approx(-0.4, abs=0.03)
    assert found.sentences["position_latency"].startswith("the speeds over ground are 0.4")
    mended = corrected_for(wrong, found.errors)
    rows = np.isin(right.time, mended.time)
    assert np.abs(mended.velocity - right.velocity[rows])[20:-20].std() < 0.05
    assert np.array_equal(mended.position, right.position[rows])
    assert kinematics_of([mended]).present == ()


@pytest.mark.parametrize("programme", ["rich", "zigzag", "gentle"])
@pytest.mark.parametrize(("noise", "waves"), [("clean", 0.0), ("field", 0.0), ("rough", 0.0), ("field", 0.2)])
def test_right_sensors_are_not_accused(noise: str, waves: float, programme: str):
    assert kinematics_of([sailed(noise, waves, programme)]).present == ()


def test_records_derived_from_each_other_say_nothing():
    motion = replace(spoilt(sailed(), "gyro_scale", 0.9), derived=(True, True, True))
    assert kinematics_of([motion]).values == {}


def test_a_boat_that_hardly_turns_tells_nothing_of_its_gyro():
    motion = sailed()
    slow = np.abs(motion.heading - motion.heading[0]) < 1.0
    stop = int(np.argmin(slow)) or slow.size
    assert "gyro_scale" not in kinematics_of([motion.slice(0, max(stop, 400))]).values


def test_two_errors_at_once_are_told_apart():
    wrong = spoilt(spoilt(sailed(), "velocity_scale", 0.93), "gyro_bias", 0.02)
    assert set(kinematics_of([wrong]).present) == {"velocity_scale", "gyro_bias"}


def test_sentences_tell_the_number_and_the_sensor():
    told = kinematics_of([spoilt(sailed("clean"), "velocity_scale", 0.93)]).sentences
    assert told == {
        "velocity_scale": "the speeds are 0.930 of those that the positions tell of, 7.0 % too little",
    }


@pytest.mark.parametrize("step", [0.1, 0.2, 0.3, 0.5, 1.0])
def test_slow_logs_are_not_accused(step: float):
    world = simulate_world(HULL, {}, duration=400.0, noise="clean", seed=8, programme="gentle")
    assert set(kinematics_of([world.motion(step)]).present) <= {"velocity_latency", "position_latency"}


def test_chords_between_rows_of_a_second_are_no_wrong_scale():
    whole = simulate_world(HULL, {}, duration=400.0, noise="clean", seed=8, programme="rich").motion(0.05)

    def rows(table: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(whole.time, whole.time[::20], column[::20]) for column in table.T])

    heading = rows(whole.heading[:, None])[:, 0]
    lines = replace(whole, position=rows(whole.position), heading=heading, velocity=rows(whole.velocity))
    assert "velocity_scale" in kinematics_of([lines]).present, "the case is one"
    assert "velocity_scale" not in kinematics_of([lines], row=1.0).present
    told = kinematics_of([spoilt(lines, "velocity_scale", 1.15)], row=1.0)
    assert told.errors["velocity_scale"] == pytest.approx(1.15, rel=0.05)


def test_a_log_without_a_record_says_nothing_of_it():
    motion = spoilt(sailed(), "gyro_scale", 0.9)
    assert not any(name.startswith("gyro") for name in kinematics_of([motion], ("x", "y", "psi", "u", "v")).values)
    assert set(kinematics_of([motion], ("psi", "r")).present) == {"gyro_scale"}


def test_what_is_further_off_than_sensors_are_is_no_error_of_a_sensor():
    knots = spoilt(sailed("clean"), "velocity_scale", 1.94)
    found = kinematics_of([knots])
    assert found.present == ()
    assert "velocity_scale" in found.beyond or not found.agree


def test_speeds_that_stand_still_tell_of_no_antenna():
    motion = sailed()
    still = replace(motion, velocity=motion.velocity * np.array([0.0, 0.0, 1.0]))
    assert not {"arm_x", "arm_y", "misalignment", "velocity_scale"} & set(kinematics_of([still]).values)


def test_speeds_measured_in_the_body_are_not_turned_with_the_compass():
    motion = sailed("clean")
    off = 0.1 * np.sin(motion.heading)
    wrong = replace(motion, heading=motion.heading - off)
    found = kinematics_of([wrong])
    assert "compass_sine" in found.present
    assert found.body_speeds
    mended = corrected_for(wrong, found.errors)
    np.testing.assert_allclose(mended.velocity[:, :2], motion.velocity[:, :2], atol=0.01)


def test_the_apparent_wind_stays_what_it_was_measured():
    motion = sailed("clean")
    air = np.tile([3.0, -2.0], (motion.time.size, 1))
    windy = replace(motion, air=air)
    mended = corrected_for(windy, {"misalignment": 0.15, "velocity_scale": 1.1})
    before = apparent_wind(windy.heading, tuple(windy.velocity.T[:2]), tuple(air.T))
    assert mended.air is not None
    after = apparent_wind(mended.heading, tuple(mended.velocity.T[:2]), tuple(mended.air.T))
    np.testing.assert_allclose(after, before, atol=1e-9)


def test_a_boat_that_drifts_with_its_heading_has_a_sound_compass_where_the_gyro_says_so():
    motion = sailed("clean")
    drift = motion.velocity[:, 0] * 0.12 * np.sin(motion.heading)
    drifting = replace(motion, velocity=motion.velocity + np.outer(drift, [0.0, 1.0, 0.0]))
    shown, cleared = compass_of([drifting]), compass_shown([drifting])
    assert abs(shown.sine) + abs(shown.cosine) > 0.05
    assert abs(cleared.sine) + abs(cleared.cosine) < 0.001
    assert compass_shown([replace(drifting, derived=(False, False, True))]) == shown


def test_a_short_stretch_survives_its_correction():
    motion = sailed().slice(0, 30)
    assert corrected_for(motion, {"velocity_latency": 0.9, "position_latency": -0.6}).time.size == 30


def test_a_boat_that_is_pushed_aside_on_every_heading_has_no_bent_compass():
    known = {"size": 0.8, "error": 0.05, "explained": 0.9, "agree": 1.0}
    assert Compass(0.6, 0.1, 0.05, **known).plain, "a sensor may be mounted askew by any angle"
    assert not Compass(0.1, 0.75, 0.49, **known).plain
