"""The nearest lawful values are those that cvxpy finds, and values that keep the laws stay as they are."""

import numpy as np
import pytest

from undertow.discovery.lawful.convex_program import Shape, solve_refit
from undertow.discovery.lawful.laws_over import certify
from undertow.discovery.lawful.nearest_lawful import LawfulSet
from undertow.physics.laws.damping_power import Envelope, mass_margin
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle, load_vehicle

HULL = load_vehicle("blueboat")
SEA = Envelope((-0.5, -0.6, -1.0), (1.8, 0.6, 1.0))
UNITS = {"X_u": 5.0, "Y_v": 10.0, "Y_vv": 20.0, "N_r": 4.0, "Y_r": 4.0, "N_v": 4.0, "N_uv": 10.0, "X_udot": 3.0}
UNIT = np.array(list(UNITS.values()))


def limits_of(vehicle: Vehicle) -> tuple[Array, Array]:
    parameters = [vehicle.parameter(symbol) for symbol in UNITS]
    return np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters])


def set_of(vehicle: Vehicle) -> LawfulSet:
    return LawfulSet(vehicle, UNITS, limits_of(vehicle), SEA)


def test_it_is_the_point_that_cvxpy_finds():
    lawful = set_of(HULL)
    laws, rng = lawful._laws, np.random.default_rng(1)
    low, high = (limit / UNIT for limit in limits_of(HULL))
    below, above = (tuple(np.isfinite(x).tolist()) for x in (low, high))
    shape = Shape(below, above, len(laws.numbers.power), laws.degree, True)
    start, moved = np.array([HULL.value(s) for s in UNITS]) / UNIT, 0
    for _ in range(6):
        root = 0.2 * rng.standard_normal((UNIT.size, UNIT.size)) + np.diag(rng.uniform(1.0, 3.0, UNIT.size))
        guess = start + rng.standard_normal(UNIT.size) * [0.5, 1, 1, 1, 3, 3, 1, 1]
        found = lawful.nearest(guess * UNIT, root.T @ root / np.outer(UNIT, UNIT))
        wanted = solve_refit(shape, root, root @ guess, (low, high), laws.numbers)
        assert wanted is not None
        assert found / UNIT == pytest.approx(wanted.values, abs=1e-6)
        vehicle = HULL.with_values(dict(zip(UNITS, found.tolist(), strict=True)))
        assert certify(vehicle, SEA).holds
        assert mass_margin(vehicle) > 0.0
        moved += not np.allclose(wanted.values, guess, atol=1e-3)
    assert moved >= 3, "a guess that is lawful tells little"


def test_what_keeps_the_laws_stays_to_the_bit():
    values = np.array([HULL.value(s) for s in UNITS]) + np.array([-1.0, -3.0, 0.0, -1.0, 0.5, -0.5, 0.1, -1.0])
    assert np.array_equal(set_of(HULL).nearest(values, np.diag(UNIT**-2.0)), values)


def test_a_vehicle_that_breaks_the_law_is_asked_for_no_more_than_it_has():
    broken = HULL.with_values({"Y_v": -1.0, "Y_vv": 0.0, "N_r": -1.0, "N_rr": 0.0, "Y_r": 20.0, "N_v": 20.0})
    assert not certify(broken, SEA).holds
    values = np.array([broken.value(s) for s in UNITS])
    lawful = set_of(broken)
    assert lawful.nearest(values, np.diag(UNIT**-2.0)) == pytest.approx(values, abs=2e-3)
    worse = values + np.array([0.0, 0.0, 0.0, 0.0, 20.0, 20.0, 0.0, 0.0])
    found = broken.with_values(dict(zip(UNITS, lawful.nearest(worse, np.diag(UNIT**-2.0)).tolist(), strict=True)))
    assert certify(found, SEA).short <= 1.001 * certify(broken, SEA).short


def test_three_numbers_of_which_one_is_a_mass_are_no_special_case():
    """Their slopes are as many as the axes: three by three by three numbers, of which no two axes may be taken."""
    units = {"Y_vdot": 5.0, "Y_r": 4.0, "N_v": 4.0}
    lawful = LawfulSet(HULL, units, (np.full(3, -np.inf), np.full(3, np.inf)), SEA)
    found = lawful.nearest(np.array([HULL.value("Y_vdot"), 300.0, 300.0]), np.eye(3))
    assert certify(HULL.with_values(dict(zip(units, found.tolist(), strict=True))), SEA).holds
