"""Line of sight, against geometry."""

import numpy as np
import pytest

from undertow.steering.controllers import LOOKAHEAD, line_of_sight
from undertow.steering.tracks import Pace

PACE = Pace(1.5, 0.4)
NORTHWARD = np.array([10.0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0])
STANDING = np.array([10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_on_the_track_it_goes_along():
    found = line_of_sight(NORTHWARD, np.array([10.0, 0.0]), 0.0, PACE)
    assert (found.speed, found.course) == (1.5, 0.0)


def test_a_lookahead_to_starboard_it_steers_45_degrees_to_port():
    found = line_of_sight(NORTHWARD, np.array([10.0, LOOKAHEAD * PACE.speed]), 0.0, PACE)
    assert np.degrees(found.course) == pytest.approx(-45.0)
    assert found.speed == pytest.approx(1.5)


def test_behind_its_point_it_goes_faster_and_ahead_of_it_slower():
    slow, fast = (line_of_sight(NORTHWARD, np.array([north, 0.0]), 0.0, PACE).speed for north in (10.9, 9.1))
    assert slow < 1.5 < fast


def test_astern_it_steers_the_other_way():
    back = NORTHWARD.copy()
    back[3] = -0.5
    found = line_of_sight(back, np.array([10.0, 1.0]), 0.0, PACE)
    assert found.way == -1.0
    assert found.speed < 0.0
    # Stern first, a bow that points to starboard brings the boat to port.
    assert found.course > 0.0


@pytest.mark.parametrize(("speed", "ahead", "wanted"), [(0.4, 3.0, -0.6), (-0.4, -3.0, 0.6)])
def test_a_boat_that_comes_back_to_its_point_nears_the_line(speed: float, ahead: float, wanted: float):
    """Past its point by 3 m and 1 m to starboard: it turns round on the line by the way it goes, not by the point's."""
    point = NORTHWARD.copy()
    point[3] = speed
    found = line_of_sight(point, np.array([10.0 + ahead, 1.0]), 0.0, PACE)
    assert found.speed == pytest.approx(wanted)
    assert found.course == pytest.approx(-np.sign(wanted) * np.arctan2(1.0, LOOKAHEAD * PACE.speed))
    assert found.speed * np.sin(found.course) < 0.0


def test_where_it_changes_to_astern_its_course_does_not_jump():
    point = NORTHWARD.copy()
    point[3] = 0.4
    rest = 10.0 + 3.0 * 0.4  # where what is left to catch up takes the point's own speed away
    before, after = (line_of_sight(point, np.array([rest + off, 1.0]), 0.0, PACE) for off in (-0.01, 0.01))
    assert before.speed > 0.0 > after.speed
    assert before.course == pytest.approx(after.course, abs=0.01)


@pytest.mark.parametrize(("north", "speed"), [(8.0, 1.0), (12.0, -1.0)])
def test_a_place_is_reached_bow_or_stern_first(north: float, speed: float):
    found = line_of_sight(STANDING, np.array([north, 0.0]), 0.0, PACE)
    assert np.sign(found.speed) == speed
    assert np.cos(found.course) == pytest.approx(1.0)


def test_at_its_place_it_rests():
    found = line_of_sight(STANDING, np.array([10.1, 0.1]), 0.7, PACE)
    assert (found.speed, found.course) == (0.0, 0.7)
