"""Latitude and longitude in local metres, against arcs of the ellipsoid."""

import numpy as np
import pytest

from undertow.measurements.canonical import FLATTENING, SEMI_MAJOR_AXIS, local_metres


@pytest.mark.parametrize("latitude", [-63.4, 0.0, 59.9, 89.0])
def test_small_steps_are_the_radii_of_curvature(latitude):
    squared = FLATTENING * (2.0 - FLATTENING)
    sine = np.sin(np.radians(latitude))
    meridional = SEMI_MAJOR_AXIS * (1.0 - squared) / (1.0 - squared * sine**2) ** 1.5
    normal = SEMI_MAJOR_AXIS / np.sqrt(1.0 - squared * sine**2)
    step = 1e-4
    north, east, _ = local_metres(np.array([latitude, latitude + step]), np.array([10.0, 10.0 + step]))
    assert north[1] == pytest.approx(meridional * np.radians(step), rel=1e-4)
    assert east[1] == pytest.approx(normal * np.cos(np.radians(latitude)) * np.radians(step), rel=2e-4)


def test_north_and_east_are_positive_and_the_date_line_is_no_wall():
    north, east, origin = local_metres(np.array([60.0, 60.001]), np.array([179.9999, -179.9999]))
    assert north[1] == pytest.approx(111.4, abs=0.1)
    assert east[1] == pytest.approx(11.16, abs=0.01)
    assert origin == (60.0, 179.9999)


def test_a_distance_of_ten_kilometres_is_millimetres_short():
    radius = SEMI_MAJOR_AXIS  # along the equator the ellipsoid is a circle
    angle = 10_000.0 / radius
    _, east, _ = local_metres(np.array([0.0, 0.0]), np.array([5.0, 5.0 + np.degrees(angle)]))
    assert 10_000.0 - east[1] == pytest.approx(10_000.0**3 / (6.0 * radius**2), rel=1e-3)
    assert 10_000.0 - east[1] < 0.005


def test_a_missing_fix_stays_missing_and_does_not_become_the_origin():
    north, east, origin = local_metres(np.array([np.nan, 60.0, 60.0]), np.array([10.0, 10.0, 10.0]))
    assert np.isnan(north[0])
    assert north[1] == east[1] == 0.0
    assert origin == (60.0, 10.0)
    _, _, nowhere = local_metres(np.array([np.nan]), np.array([10.0]))
    assert np.isnan(nowhere[0])
