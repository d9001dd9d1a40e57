"""The law of dissipation: envelopes, proofs on the knife edge, and the independent search for a violation."""

from dataclasses import replace

import numpy as np
import pytest
from envelopes import encloses

from undertow.discovery.lawful.laws_over import certify
from undertow.physics.effects import monomials
from undertow.physics.errors import RequestError
from undertow.physics.laws.damping_power import (
    Envelope,
    basis,
    control_matrices,
    damping_power,
    envelope_of,
    mass_margin,
    vehicle_degree,
    vehicle_power,
    worst_dissipation,
)
from undertow.physics.momentum_balance import damping_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Hull, Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
SHIP = load_vehicle("cybership2")
BOX = Envelope((-1.0, -0.5, -0.8), (2.0, 0.6, 0.8))
BARE = HULL.with_values(dict.fromkeys(("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr"), 0.0))
EDGE = 1e-6


def hull(**values: float) -> Vehicle:
    return BARE.with_values(values)


def log_of(vehicle: Vehicle, seed: int, hidden: dict[str, float] | None = None, seconds: float = 60.0) -> Motion:
    return simulate_world(vehicle, hidden or {}, duration=seconds, noise="field", seed=seed).motion(0.05)


# The envelope


def test_an_envelope_reaches_from_rest_to_the_extremes_and_a_little_to_the_other_side():
    motion = log_of(HULL, 3)
    ahead = replace(motion, velocity=np.abs(motion.velocity))
    box = envelope_of([ahead], HULL)
    assert encloses(box, ahead.velocity)
    assert box.upper == pytest.approx(ahead.velocity.max(axis=0), abs=1e-3)
    assert box.lower == pytest.approx(-0.05 * ahead.velocity.max(axis=0), abs=1e-3)
    assert len(box.orthants) == 8
    assert envelope_of([ahead], HULL, share=0.5).upper == pytest.approx(0.5 * np.array(box.upper), abs=1e-3)
    assert box.to_dict()["u"] == [box.lower[0], box.upper[0]]


def test_an_envelope_is_about_the_water():
    motion = log_of(HULL, 3)
    drifting = HULL.with_values({"current_north": 3.0})
    assert envelope_of([motion], drifting) != envelope_of([motion], HULL)


@pytest.mark.parametrize(
    ("low", "high"), [((0.1, -1, -1), (2, 1, 1)), ((0, -1, -1), (0, 1, 1)), ((-1, -1, -1), (1, 1, float("nan")))]
)
def test_an_envelope_without_rest_is_refused(low: tuple[float, float, float], high: tuple[float, float, float]):
    with pytest.raises(RequestError, match="expected lower <= 0 <= upper"):
        Envelope(low, high)


def test_no_motion_has_no_envelope():
    with pytest.raises(RequestError, match="at least one motion"):
        envelope_of([], HULL)


# The proof


@pytest.mark.parametrize("extra", [{}, {"surge:u^3": -2.0, "yaw:v^2r": -3.0, "sway:|u||v|": 1.0, "yaw:uv|r|": 0.7}])
def test_the_proof_is_about_the_power_of_the_force_equation(extra: dict[str, float]):
    vehicle = SHIP.with_values({"Y_ur": 3.0, "N_uv": -1.0, **extra})
    degree = vehicle_degree(vehicle)
    b, power = basis(degree), vehicle_power(vehicle, BOX, degree)
    rng = np.random.default_rng(0)
    p = rng.random((50, 3))
    for orthant, far in enumerate(BOX.orthants):
        value = sum(c * np.prod(p ** np.array(e), axis=1) for c, e in zip(power[orthant], b.monomials, strict=True))
        np.testing.assert_allclose(value, damping_power(vehicle, p * np.array(far)), atol=1e-9)
    slack = rng.normal(size=(8, b.slack.shape[-1]))
    corners = np.flatnonzero(np.isin(b.points, (0.0, 1.0)).all(axis=1))
    at = b.points[corners]
    for matrices in (control_matrices(power, None, degree), control_matrices(power, slack, degree)):
        found = -np.einsum("ki,okij,kj->ok", at, matrices[:, corners], at)
        wanted = np.array([damping_power(vehicle, at * np.array(far)) for far in BOX.orthants])
        np.testing.assert_allclose(found, wanted, atol=1e-9)


@pytest.mark.parametrize("axis", ["surge", "sway", "yaw"])
def test_every_monomial_has_its_place_in_the_proof(axis: str):
    rng = np.random.default_rng(1)
    p = rng.random((20, 3))
    for form in monomials(3):
        vehicle = BARE.with_values({f"{axis}:{form.text}": 1.7})
        degree = vehicle_degree(vehicle)
        power = vehicle_power(vehicle, BOX, degree)
        for orthant, far in enumerate(BOX.orthants):
            terms = zip(power[orthant], basis(degree).monomials, strict=True)
            value = sum(c * np.prod(p ** np.array(e), axis=1) for c, e in terms)
            np.testing.assert_allclose(value, damping_power(vehicle, p * np.array(far)), atol=1e-12)


@pytest.mark.parametrize(
    ("vehicle", "symbol", "edge", "drives"),
    [
        (hull(Y_v=-4.0, N_r=-9.0), "X_u", 0.0, 1.0),
        (hull(X_u=-2.0, Y_v=-4.0, N_r=-9.0), "X_uu", 1.0, 1.0),  # at u = 2: -2 + 2 X_uu
        (hull(X_u=-1.0, Y_v=-4.0, N_r=-9.0), "N_v", 12.0, 1.0),  # (N_v + Y_r)^2 = 4 Y_v N_r
        (hull(X_u=-1.0, Y_v=-4.0, N_r=-9.0, Y_r=5.0), "N_v", -17.0, -1.0),
        (hull(X_u=-1.0, Y_v=-4.0, N_r=-9.0), "Y_ur", 18.0, 1.0),  # u v r at (1, 1/2, 1/3), 1 W on each axis
    ],
)
def test_a_proof_stands_on_the_knife_edge(vehicle: Vehicle, symbol: str, edge: float, drives: float):
    box = (
        Envelope((-1.0, -0.5, -1 / 3), (1.0, 0.5, 1 / 3))
        if symbol == "Y_ur"
        else Envelope((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))
    )
    inside, outside = (vehicle.with_values({symbol: edge + side * drives * EDGE}) for side in (-1.0, 1.0))
    assert certify(inside, box).holds
    assert not certify(outside, box).holds
    assert certify(outside, box).short > 0.0
    assert worst_dissipation(inside, box).power == 0.0
    assert worst_dissipation(outside.with_values({symbol: edge + 1e-2 * drives}), box).power > 0.0


def test_couplings_that_do_no_work_are_never_rejected():
    vehicle = HULL.with_values({"Y_ur": 900.0, "N_uv": -700.0, "X_vr": -200.0})
    matrix = damping_matrix(vehicle, np.array([BOX.upper]))[0]
    assert np.linalg.eigvalsh(matrix + matrix.T)[0] < -100.0  # as D stands, the corners would reject it
    assert certify(vehicle, BOX).holds
    assert worst_dissipation(vehicle, BOX).power == 0.0


def test_honest_cross_flow_is_proved_and_a_drive_is_not():
    assert certify(HULL.with_values({"yaw:u^2r": -5.0, "sway:v^3": -9.0, "surge:u|v|": -4.0}), BOX).holds
    assert not certify(HULL.with_values({"sway:v^3": 900.0}), BOX).holds


def test_strips_of_the_hull_need_no_matrices_and_a_negative_coefficient_drives():
    """Each strip loses energy by itself, at every state: no envelope is too large for the proof."""
    strips = BARE.model_copy(update={"hull": Hull(length=1.4, draught=0.12)})
    far = Envelope((-50.0, -50.0, -50.0), (50.0, 50.0, 50.0))
    for vehicle in (strips.with_values({"cross_flow": 0.9}), strips.with_values({"cross_flow": 40.0, "Y_r": 3.0})):
        proved = certify(vehicle, far)
        assert proved.holds == (vehicle.value("Y_r") == 0.0)
        assert (worst_dissipation(vehicle, far).power > 0.0) == (not proved.holds)
    found = certify(strips.with_values({"cross_flow": -EDGE, "Y_v": -9.0}), BOX)
    assert not found.holds
    drives = strips.with_values({"cross_flow": -0.9})
    found = certify(drives, BOX)
    assert not found.holds
    assert found.short == pytest.approx(damping_power(drives, np.array(found.state)))
    assert worst_dissipation(drives, BOX).power == pytest.approx(found.short, rel=0.02)


def test_the_search_finds_a_small_pocket():
    vehicle = HULL.with_values({"Y_r": 40.0})
    worst = worst_dissipation(vehicle, BOX)
    assert worst.power > 0.0
    assert damping_power(vehicle, np.array(worst.state)) == pytest.approx(worst.power)
    assert worst == worst_dissipation(vehicle, BOX)
    assert worst_dissipation(vehicle, BOX, seed=1).power == pytest.approx(worst.power, rel=1e-2)


def test_the_towing_tank_ship_is_not_dissipative():
    found = certify(SHIP, BOX)
    assert not found.holds
    assert worst_dissipation(SHIP, BOX).power > 0.01
    assert mass_margin(SHIP) > 0.9
