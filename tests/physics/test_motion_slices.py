"""A piece of a motion keeps what was before it, and no more of that than lag, delay and the wake ask for."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.measurements.compass import Compass, corrected
from undertow.measurements.kinematics import corrected_for
from undertow.physics.errors import LogError
from undertow.physics.forces import memory_states
from undertow.physics.motion import RUN_UP, Motion
from undertow.physics.vehicle import load_vehicle

STEP = 0.1


def motion(rows: int, before: int = 0) -> Motion:
    time = STEP * np.arange(rows, dtype=float)
    commands = np.arange(-before, rows, dtype=float)[:, None]
    return Motion(
        time=time,
        position=np.zeros((rows, 2)),
        heading=np.zeros(rows),
        velocity=np.zeros((rows, 3)),
        commands=commands[before:],
        thrusters=("port",),
        run_up=commands[:before] if before else None,
    )


def test_a_piece_keeps_the_last_commands_before_it():
    most = round(RUN_UP / STEP)
    for before, start in ((0, 50), (30, 50), (30, most - 10), (most, 20), (0, most + 40), (30, most + 40)):
        run_up = motion(1000, before).slice(start, start + 100).run_up
        assert run_up is not None
        first = max(start - most, -before)
        assert run_up[:, 0].tolist() == list(range(first, start))
    assert motion(1000).slice(0, 100).run_up is None


def test_a_piece_copies_none_of_a_long_log():
    long = motion(100_000, 200)
    run_up = long.slice(90_000, 91_000).run_up
    assert run_up is not None
    assert np.shares_memory(run_up, long.commands)


def test_a_piece_keeps_heading_and_velocity_before_it():
    whole = replace(motion(1000), heading=np.arange(1000.0), velocity=np.arange(3000.0).reshape(1000, 3))
    past = whole.slice(500, 700).slice(50, 100).past
    assert past is not None
    np.testing.assert_array_equal(past[:, 0], np.arange(350.0, 550.0))
    np.testing.assert_array_equal(past[:, 1:], whole.velocity[350:550])
    assert whole.slice(0, 100).past is None


def test_the_wake_of_a_piece_is_that_of_the_whole():
    rng = np.random.default_rng(3)
    swinging = np.cumsum(rng.standard_normal((1000, 3)), axis=0) * 0.05
    whole = replace(motion(1000), velocity=swinging, heading=np.cumsum(swinging[:, 2]) * STEP)
    hull = load_vehicle("blueboat").with_values(
        {"memory_sway": 20.0, "memory_time": 2.0, "current_north": 0.3, "current_rate_north": 0.5}
    )
    expected = np.array(memory_states(hull, whole))[:, 400:600]
    found = np.array(memory_states(hull, whole.slice(400, 600)))
    np.testing.assert_allclose(found, expected, atol=2e-4)  # what 20 s leave of it
    alone = np.array(memory_states(hull, replace(whole.slice(400, 600), past=None)))
    assert np.abs(alone - expected)[:, 0].max() > 0.05


def test_past_of_another_shape_is_refused():
    with pytest.raises(LogError, match=r"past of shape \(m, 4\), got \(5, 3\)"):
        replace(motion(50), past=np.zeros((5, 3)))


def test_the_past_of_a_piece_is_corrected_as_the_piece_is():
    rng = np.random.default_rng(4)
    whole = replace(motion(900), velocity=rng.standard_normal((900, 3)), heading=np.cumsum(rng.standard_normal(900)))
    errors = {"compass_constant": 0.2, "compass_sine": 0.05, "gyro_scale": 1.05, "gyro_bias": 0.01, "mount_x": 0.5}
    compass = Compass(0.05, 0.1, -0.1, 0.1, 0.01, 1.0, 1.0)

    def by_errors(motion: Motion) -> Motion:
        return corrected_for(motion, errors)

    def by_compass(motion: Motion) -> Motion:
        return corrected(motion, compass)

    for correct in (by_errors, by_compass):
        later, found = correct(whole).slice(400, 600).past, correct(whole.slice(400, 600)).past
        assert later is not None
        assert found is not None
        np.testing.assert_allclose(found, later, rtol=1e-12)
