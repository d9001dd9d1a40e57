"""The lawful pysindy optimizer, alone in `pysindy.SINDy`."""

import numpy as np
import pysindy
import pytest

from undertow.discovery.candidates.unnamed_terms import TermLibrary
from undertow.discovery.lawful.certify import certify
from undertow.discovery.lawful.sindy_optimizer import LawfulOptimizer
from undertow.physics.errors import RequestError
from undertow.physics.laws.damping_power import Envelope, worst_dissipation
from undertow.physics.vehicle import Vehicle, load_vehicle

HULL = load_vehicle("blueboat")
BOX = Envelope((-1.0, -0.5, -0.8), (2.0, 0.6, 0.8))
BARE = HULL.with_values(dict.fromkeys(("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr"), 0.0))


def forces(drive: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    state = rng.uniform(BOX.lower, BOX.upper, (500, 3))
    u, v, r = state.T
    force = [-9 * u - 3 * u * abs(u) + 2 * v * r, -28 * v + 5 * u * r, -7 * r - 7 * u * v + drive * v]
    return state, np.column_stack(force) + rng.normal(size=(500, 3)) * 0.1


def fitted(optimizer: pysindy.BaseOptimizer, drive: float = 0.0, degree: int = 2) -> dict[tuple[int, str], float]:
    state, force = forces(drive)
    model = pysindy.SINDy(feature_library=TermLibrary(degree), optimizer=optimizer)
    model.fit(state, t=0.1, x_dot=force, feature_names=["u", "v", "r"])
    names = model.get_feature_names()
    return {(a, n): c for a, row in enumerate(model.coefficients()) for n, c in zip(names, row, strict=True) if c}


def as_vehicle(found: dict[tuple[int, str], float]) -> Vehicle:
    return BARE.with_values({f"{('surge', 'sway', 'yaw')[axis]}:{form}": c for (axis, form), c in found.items()})


def test_the_optimizer_finds_honest_forces_in_pysindy_alone():
    optimizer = LawfulOptimizer(BOX)
    found = fitted(optimizer)
    assert {key: round(c) for key, c in found.items()} == {
        (0, "u"): -9,
        (0, "u|u|"): -3,
        (0, "vr"): 2,
        (1, "v"): -28,
        (1, "ur"): 5,
        (2, "r"): -7,
        (2, "uv"): -7,
    }
    assert optimizer.price_ == 0.0


@pytest.mark.parametrize("degree", [2, 3])
def test_the_optimizer_keeps_the_law_where_the_data_break_it(degree: int):
    optimizer = LawfulOptimizer(BOX)
    lawless = as_vehicle(fitted(pysindy.STLSQ(threshold=0.3), drive=60.0, degree=2))
    assert worst_dissipation(lawless, BOX).power > 0.0
    vehicle = as_vehicle(fitted(optimizer, drive=60.0, degree=degree))
    assert worst_dissipation(vehicle, BOX).power == 0.0
    assert certify(vehicle, BOX).holds
    assert optimizer.price_ > 0.0


@pytest.mark.parametrize(("signs", "coefficient"), [(True, 0.0), (False, 2.0)])
def test_the_optimizer_holds_drag_to_its_sign(signs: bool, coefficient: float):
    state, _ = forces()
    force = state * [-9.0, -5.0, -5.0] + [2.0, 0.0, 0.0] * state * np.abs(state)  # lawful in the box: 9 > 2 u
    model = pysindy.SINDy(feature_library=TermLibrary(2), optimizer=LawfulOptimizer(BOX, signs=signs))
    model.fit(state, t=0.1, x_dot=force, feature_names=["u", "v", "r"])
    column = model.get_feature_names().index("u|u|")
    assert model.coefficients()[0, column] == pytest.approx(coefficient, abs=1e-5)


def test_the_optimizer_drops_everything_below_its_threshold():
    assert fitted(LawfulOptimizer(BOX, threshold=2.0)) == {}


def test_the_optimizer_refuses_what_it_cannot_constrain():
    state, force = forces()
    with pytest.raises(RequestError, match="expected the features of a TermLibrary"):
        LawfulOptimizer(BOX).fit(state[:, :2], force)
    with pytest.raises(RequestError, match="expected forces on surge, sway and yaw, got 2 targets"):
        LawfulOptimizer(BOX).fit(TermLibrary(1).fit(state).values(state), force[:, :2])
