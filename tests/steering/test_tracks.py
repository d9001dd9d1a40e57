"""Tracks are what their legs say, and ask no more of a boat than it has."""

import numpy as np
import pytest

from undertow.physics.errors import RequestError
from undertow.physics.forces import held_acceleration
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.manoeuvres import COMMAND_STEP
from undertow.steering.tracks import LEAD_OUT, SHARE, TRACKS, Pace, pace_of, track_named

PACE = Pace(1.2, 0.4)


@pytest.mark.parametrize("name", TRACKS)
def test_the_point_moves_as_it_says(name: str):
    track = track_named(name, PACE)
    time = np.arange(0.0, track.seconds, COMMAND_STEP)
    points, later = track.at(time), track.at(time + 1e-2)
    moved = (later[:, :2] - points[:, :2]) / 1e-2
    along = np.stack([np.cos(points[:, 2]), np.sin(points[:, 2])], axis=1) * points[:, 3:4]
    np.testing.assert_allclose(moved, along, atol=0.02)
    np.testing.assert_allclose((later[:, 2] - points[:, 2]) / 1e-2, points[:, 4], atol=0.01)
    assert np.abs(points[:, 4]).max() <= PACE.turn_rate * 1.01
    assert np.allclose(points[0, :4], 0.0, atol=1e-3), "it begins at rest, at the origin, heading north"
    assert track.time[-1] == pytest.approx(track.seconds + LEAD_OUT)


def test_a_square_has_four_right_angles_and_closes():
    track = track_named("square", PACE)
    points = track.at(track.time)
    assert np.degrees(points[-1, 2]) == pytest.approx(360.0, abs=0.5)
    corner = track.at(4.0 + np.arange(5, dtype=float) * (8.0 + 0.5 * np.pi / PACE.turn_rate + 1.5))
    assert np.hypot(*(corner[4, :2] - corner[0, :2])) < 0.02 * PACE.speed
    sides = np.hypot(*np.diff(corner[:, :2], axis=0).T)
    np.testing.assert_allclose(sides, sides[0], rtol=1e-2)


def test_the_pace_takes_its_share_of_thrust():
    boat = load_vehicle("blueboat").with_values({"x_g": 0.0})
    pace = pace_of(boat)
    commands = np.full((1, 2), SHARE * 35.0)
    ahead = held_acceleration(boat, np.array([[pace.speed, 0.0, 0.0]]), np.zeros(1), commands)
    assert abs(ahead[0, 0]) < 1e-3
    velocity = np.array([[pace.speed, 0.0, pace.turn_rate]])
    turning = held_acceleration(boat, velocity, np.zeros(1), commands * [1.0, -1.0])
    assert abs(turning[0, 2]) < 1e-3


def test_a_boat_that_cannot_turn_is_refused():
    boat = load_vehicle("blueboat").with_values({"arm_scale": 0.0})
    with pytest.raises(RequestError, match="cannot both push it ahead and turn it"):
        pace_of(boat)


def test_an_unknown_track_names_the_nearest():
    with pytest.raises(RequestError, match="unknown track 'sqare': did you mean 'square'"):
        track_named("sqare", PACE)
