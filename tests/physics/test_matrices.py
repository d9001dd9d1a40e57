"""The matrices of the model: symmetry, skew-symmetry, power, and agreement with the force equation."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from undertow.physics.effects import canonical, monomials, parse_form
from undertow.physics.errors import VehicleError
from undertow.physics.forces import ForceEquation, modelled_force
from undertow.physics.momentum_balance import coriolis_matrix, damping_matrix, mass_matrix, thruster_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle, shipped_vehicles, vehicle_from_dict

SETTINGS = settings(max_examples=60, deadline=None, derandomize=True, database=None)


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


def thruster(name: str, y: float, angle: float = 0.0) -> dict[str, Any]:
    curve = {"kind": "table", "command": [-50.0, 50.0], "force": [-50.0, 50.0]}
    return {"name": name, "x": -0.5, "y": y, "angle": angle, "command": "newton", "curve": curve}


@st.composite
def vehicles(draw: st.DrawFn) -> Vehicle:
    mass, inertia = draw(number(5, 500)), draw(number(5, 500))
    # |m23| below the geometric mean of the two masses on its rows keeps M positive definite.
    x_g = draw(number(-0.9, 0.9)) * np.sqrt(inertia / mass)
    return vehicle_from_dict(
        {
            "mass": mass,
            "inertia_z": inertia,
            "x_g": x_g,
            "added_mass": {s: draw(number(-100, 0)) for s in ("X_udot", "Y_vdot", "N_rdot")},
            "damping": {s: draw(number(-80, 0)) for s in ("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr", "N_ur")}
            | {s: draw(number(-20, 20)) for s in ("Y_r", "N_v")},
            "coupling": {s: draw(number(-20, 20)) for s in ("N_uv", "Y_ur", "X_vr")},
            "terms": [{"axis": "yaw", "form": "u|r|", "value": draw(number(-5, 5))}],
            "thrusters": [thruster("port", -0.3), thruster("stbd", 0.3)],
        },
        "drawn",
    )


velocities = st.tuples(number(-3, 3), number(-2, 2), number(-2, 2)).map(np.array)


@SETTINGS
@given(vehicles())
def test_mass_matrix_is_symmetric_and_positive_definite(vehicle: Vehicle) -> None:
    m = mass_matrix(vehicle)
    assert np.array_equal(m, m.T)
    assert np.linalg.eigvalsh(m).min() > 0


@SETTINGS
@given(vehicles(), velocities)
def test_coriolis_is_skew_symmetric_and_does_no_work(vehicle: Vehicle, velocity: np.ndarray) -> None:
    c = coriolis_matrix(vehicle, velocity)
    assert np.array_equal(c, -c.T)
    force = c @ velocity
    scale = max(1.0, float(np.abs(c).max() * (velocity @ velocity)))
    assert abs(velocity @ force) <= 1e-12 * scale


@SETTINGS
@given(vehicles(), velocities)
def test_force_equation_is_coriolis_plus_damping(vehicle: Vehicle, velocity: np.ndarray) -> None:
    n = 3
    motion = Motion(
        0.1 * np.arange(n, dtype=float),
        np.zeros((n, 2)),
        np.zeros(n),
        np.tile(velocity, (n, 1)),
        np.zeros((n, 2)),
        ("port", "stbd"),
    )
    expected = -(coriolis_matrix(vehicle, velocity) + damping_matrix(vehicle, velocity)) @ velocity
    np.testing.assert_allclose(modelled_force(vehicle, motion), np.tile(expected, (n, 1)), rtol=1e-10, atol=1e-9)


def test_coriolis_of_known_numbers() -> None:
    """Fossen (2021), theorem 3.2 by hand: m11 = 25, m22 = 40, m23 = 2 at nu = (2, 0.5, 0.3)."""
    vehicle = vehicle_from_dict(
        {
            "mass": 20.0,
            "inertia_z": 4.0,
            "x_g": 0.1,
            "added_mass": {"X_udot": -5.0, "Y_vdot": -20.0},
            "thrusters": [thruster("one", 0.0)],
        },
        "hand",
    )
    c = coriolis_matrix(vehicle, np.array([2.0, 0.5, 0.3]))
    np.testing.assert_allclose(c[0, 2], -(40.0 * 0.5 + 2.0 * 0.3))
    np.testing.assert_allclose(c[1, 2], 25.0 * 2.0)
    assert np.all(c[:2, :2] == 0)


def test_mass_matrix_of_known_numbers() -> None:
    """Fossen (2021), eqs. 3.63 and 6.105: m - X_udot, m - Y_vdot, I_z - N_rdot and m x_g - Y_rdot."""
    vehicle = vehicle_from_dict(
        {
            "mass": 20.0,
            "inertia_z": 4.0,
            "x_g": 0.1,
            "added_mass": {"X_udot": -5.0, "Y_vdot": -20.0, "N_rdot": -2.0, "Y_rdot": -1.5},
            "thrusters": [thruster("one", 0.0)],
        },
        "hand",
    )
    np.testing.assert_allclose(mass_matrix(vehicle), [[25.0, 0.0, 0.0], [0.0, 40.0, 3.5], [0.0, 3.5, 6.0]])


def test_damping_matrix_takes_a_batch_of_velocities() -> None:
    vehicle = load_vehicle("blueboat")
    velocity = np.array([[[1.0, 0.2, -0.3], [-1.0, 0.0, 0.0]]])
    d = damping_matrix(vehicle, velocity)
    assert d.shape == (1, 2, 3, 3)
    np.testing.assert_allclose(d[0, 1].diagonal(), [15.0 + 8.0, 40.0, 6.0])
    np.testing.assert_array_equal(coriolis_matrix(vehicle, velocity).shape, (1, 2, 3, 3))


def test_thruster_matrix_by_hand() -> None:
    data = {"mass": 1.0, "inertia_z": 1.0, "thrusters": [thruster("stbd", 0.3), thruster("bow", 0.0, np.pi / 2)]}
    b = thruster_matrix(vehicle_from_dict(data, "hand"))
    np.testing.assert_allclose(b, [[1.0, 0.0], [0.0, 1.0], [-0.3, -0.5]], atol=1e-15)


@pytest.mark.parametrize("name", shipped_vehicles())
def test_shipped_vehicles_are_sound(name: str) -> None:
    vehicle = load_vehicle(name)
    assert np.linalg.eigvalsh(mass_matrix(vehicle)).min() > 0
    d = damping_matrix(vehicle, np.array([0.5, 0.0, 0.0]))
    assert np.all(np.diag(d) > 0)
    np.testing.assert_allclose(ForceEquation(vehicle).inverse_mass @ mass_matrix(vehicle), np.eye(3), atol=1e-12)
    assert "sources" in vehicle.model_dump()
    assert vehicle.sources


def test_monomials_are_distinct_functions() -> None:
    rng = np.random.default_rng(0)
    forms = monomials(3)
    u, v, r = rng.uniform(-1, 1, (3, 2000))
    columns = np.column_stack([f(u, v, r) for f in forms])
    assert np.linalg.matrix_rank(columns) == len(forms)
    assert len(forms) == len({f.text for f in forms})
    assert all(canonical(f.factors) == f.text for f in forms)


@pytest.mark.parametrize(
    ("text", "value", "odd", "column"),
    [
        ("u|u|", -4.0, True, 0),
        ("|v|r", 1.5, True, 2),
        ("u r", -1.0, False, 2),
        ("u^3", -8.0, True, 0),
        ("|u|", 2.0, False, None),
    ],
)
def test_form_values(text: str, value: float, odd: bool, column: int | None) -> None:
    form = parse_form(text)
    assert float(form(np.array(-2.0), np.array(3.0), np.array(0.5))) == value
    assert form.odd is odd
    assert form.column == column


@pytest.mark.parametrize("text", ["", "w", "u+v", "uuvv", "u^4", "|u"])
def test_unreadable_form_is_refused(text: str) -> None:
    with pytest.raises(VehicleError, match=r"expected a product of one to three of u, v, r"):
        parse_form(text)
