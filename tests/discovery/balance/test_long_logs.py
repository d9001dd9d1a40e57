"""What a long log is searched on: its manoeuvres, however rare, and the rest evenly; a short log is itself."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.basis import MOST_TESTS, subsample_long_log
from undertow.discovery.discover import find_missing
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
SETTINGS = WeakSettings()
STEP = 0.2


def calm(hours: float, seed: int = 0) -> Motion:
    """A boat that goes straight ahead at an even pace, at five rows a second."""
    time = np.arange(0.0, 3600.0 * hours, STEP)
    rng = np.random.default_rng(seed)
    velocity = np.column_stack([np.ones_like(time), np.zeros_like(time), np.zeros_like(time)])
    velocity += 0.01 * rng.standard_normal(velocity.shape)
    place = np.column_stack([time, np.zeros_like(time)])
    return Motion(time, place, np.zeros_like(time), velocity, np.full((time.size, 2), 10.0), ("port", "stbd"))


def with_a_turn(motion: Motion, at: float) -> Motion:
    """The same, but a minute of turning and going astern in the middle of it."""
    velocity, commands = motion.velocity.copy(), motion.commands.copy()
    rows = (motion.time >= at) & (motion.time < at + 60.0)
    velocity[rows] += np.array([-1.6, 0.2, 0.4])
    commands[rows] = (-12.0, -20.0)
    return replace(motion, velocity=velocity, commands=commands)


def test_a_short_log_is_itself():
    motion = calm(0.4)
    assert subsample_long_log([motion], SETTINGS) == ((motion,), "")


@pytest.mark.parametrize("at", [100.0, 5000.0, 14_000.0])
def test_a_manoeuvre_that_is_done_once_is_among_what_is_searched(at: float):
    found, told = subsample_long_log([with_a_turn(calm(4.0), at)], SETTINGS)
    assert any(m.time[0] <= at + 10.0 and m.time[-1] >= at + 50.0 for m in found)
    assert "of its 240 min" in told


def test_pieces_are_within_the_limit_in_order_and_from_all_over_the_log():
    first, second = calm(2.0, 1), replace(calm(3.0, 2), source="another")
    found, _ = subsample_long_log([first, second], SETTINGS)
    assert 0.9 * MOST_TESTS <= sum(m.time.size for m in found) <= MOST_TESTS + 10
    for motion in (first, second):
        times = np.concatenate([m.time for m in found if m.source == motion.source])
        assert (np.diff(times) > 0.0).all()
        assert np.count_nonzero(np.histogram(times, bins=4, range=(0.0, motion.time[-1]))[0]) >= 3
    for motion in found:
        whole = first if motion.source == first.source else second
        rows = np.searchsorted(whole.time, motion.time)
        np.testing.assert_array_equal(whole.velocity[rows], motion.velocity)


def test_a_log_of_an_hour_gives_the_answer_of_ten_minutes_and_says_what_was_searched():
    hidden = {"surge_quadratic_damping": -8.0, "thruster_asymmetry": 0.85}
    motion = simulate_world(HULL, hidden, duration=3600.0, noise="field", seed=5).motion()
    found = find_missing([motion], HULL)
    assert set(found.findings.missing) == {"surge_quadratic_damping", "thruster_asymmetry"}
    assert any("of its 60 min" in note for note in found.notes)


def test_short_stretches_are_among_what_is_searched():
    short = [replace(calm(1.0, k).slice(0, 300), source="short") for k in range(40)]
    found, _ = subsample_long_log(short, SETTINGS)
    assert 0.8 * MOST_TESTS <= sum(m.time.size for m in found) <= 1.2 * MOST_TESTS
    mixed = [calm(1.5, 1), *(with_a_turn(calm(1.0, k).slice(0, 400), 10.0) for k in range(4))]
    found, _ = subsample_long_log(mixed, SETTINGS)
    assert any(m.time.size == 400 for m in found)


def test_a_digest_is_digested_no_further():
    found, _ = subsample_long_log([calm(4.0)], SETTINGS)
    assert subsample_long_log(found, SETTINGS) == (found, "")
