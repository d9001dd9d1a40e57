"""Cross-flow drag by strip theory: closed forms, its column, its power, its symmetry, and what a file must state."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from undertow.discovery.candidates.candidate import candidates
from undertow.physics.effects import BY_NAME
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.forces import modelled_force
from undertow.physics.integration import simulate_motion
from undertow.physics.laws.damping_power import damping_power
from undertow.physics.momentum_balance import (
    DENSITY,
    STRIPS,
    cross_flow_forces,
    cross_flow_matrix,
    damping_matrix,
    power_bounds,
)
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, hull_of, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import apply_effects, typical_effect, with_hull

LENGTH, DRAUGHT, C_D = 1.4, 0.12, 0.9
SIZE = {"length": LENGTH, "draught": DRAUGHT}


def boat(coefficient: float = C_D) -> Vehicle:
    """The BlueBoat with a hull and cross-flow drag."""
    data = load_vehicle("blueboat").to_dict() | {"hull": SIZE}
    return vehicle_from_dict(data | {"damping": data["damping"] | {"cross_flow": coefficient}}, "boat")


def states(n: int = 400) -> np.ndarray:
    """Velocities in all directions, among them some at which strips near the middle rest."""
    return np.random.default_rng(2).uniform(-1.0, 1.0, (n, 3)) * [2.0, 0.6, 1.2]


def along(velocity: np.ndarray) -> Motion:
    """A motion (not a simulated one) with given velocities and no thrust."""
    n = len(velocity)
    still = np.zeros((n, 2))
    return Motion(0.1 * np.arange(n, dtype=float), still, np.zeros(n), velocity, still, ("port", "stbd"))


def of_it(velocity: np.ndarray, coefficient: float = C_D) -> np.ndarray:
    """What cross-flow drag adds to the force equation, (n, 3)."""
    motion = along(velocity)
    return modelled_force(boat(coefficient), motion) - modelled_force(boat(0.0), motion)


def by_hand(velocity: np.ndarray) -> np.ndarray:
    """The twenty strips written out, (n, 3), for a drag coefficient of one."""
    force = np.zeros_like(velocity)
    width = LENGTH / 20
    for k in range(20):
        x = -LENGTH / 2 + (k + 0.5) * width
        w = velocity[:, 1] + x * velocity[:, 2]
        force[:, 1] -= 0.5 * 1025.0 * DRAUGHT * np.abs(w) * w * width
        force[:, 2] -= 0.5 * 1025.0 * DRAUGHT * x * np.abs(w) * w * width
    return force


def test_it_is_the_sum_over_twenty_strips() -> None:
    assert (STRIPS, DENSITY) == (20, 1025.0)
    np.testing.assert_allclose(of_it(states()), C_D * by_hand(states()), rtol=1e-10, atol=1e-9)


def test_pure_sway_is_the_closed_form() -> None:
    v = np.array([-0.7, -0.1, 0.0, 0.3, 1.1])
    added = of_it(np.column_stack([0.4 + 0.0 * v, v, 0.0 * v]))
    np.testing.assert_allclose(added[:, 1], -0.5 * 1025.0 * C_D * DRAUGHT * LENGTH * v * np.abs(v), atol=1e-10)
    np.testing.assert_array_equal(added[:, [0, 2]], 0.0)


def test_pure_yaw_is_the_closed_form_but_for_half_a_per_cent() -> None:
    """N = -1/2 rho C_d T r|r| L^4 / 32; by the midpoint rule of n strips it is 1 - 2 / n^2 of that."""
    r = np.array([-1.3, -0.2, 0.5, 0.9])
    added = of_it(np.column_stack([0.0 * r, 0.0 * r, r]))
    exact = -0.5 * 1025.0 * C_D * DRAUGHT * r * np.abs(r) * LENGTH**4 / 32.0
    np.testing.assert_allclose(added[:, 2], (1.0 - 2.0 / 20**2) * exact, rtol=1e-10)
    np.testing.assert_array_equal(added[:, :2], 0.0)


def test_the_column_is_the_difference_of_forces_at_any_amount() -> None:
    for amount in (0.3, 2.0):
        np.testing.assert_allclose(of_it(states(), amount), amount * of_it(states(), 1.0), rtol=1e-10, atol=1e-9)


def test_fouling_grows_it_like_all_damping() -> None:
    motion = replace(along(states(50)), minutes=np.full(50, 4.0))
    bare = boat().with_values(dict.fromkeys(load_vehicle("blueboat").damping, 0.0))
    grown = modelled_force(bare.with_values({"fouling_rate": 0.1}), motion) - modelled_force(boat(0.0), motion)
    fresh = modelled_force(bare, motion) - modelled_force(boat(0.0), motion)
    own = modelled_force(bare.with_values({"cross_flow": 0.0}), motion) - modelled_force(boat(0.0), motion)
    np.testing.assert_allclose(grown - own, 1.4 * (fresh - own), rtol=1e-9, atol=1e-9)


def test_it_is_of_the_velocity_through_the_water() -> None:
    velocity = states(40)
    drifting = velocity + np.array([0.0, 0.3, 0.0])  # heading north, a current to the east
    both = [modelled_force(boat(x).with_values({"current_east": 0.3}), along(drifting)) for x in (C_D, 0.0)]
    np.testing.assert_allclose(both[0] - both[1], of_it(velocity), rtol=1e-9, atol=1e-9)


def test_port_and_starboard_are_alike_to_the_bit() -> None:
    mirrored = of_it(states() * [1.0, -1.0, -1.0])
    force = np.column_stack(cross_flow_forces(LENGTH, DRAUGHT, *states().T[1:]))
    other = np.column_stack(cross_flow_forces(LENGTH, DRAUGHT, *(-states().T[1:])))
    np.testing.assert_array_equal(other, -force)
    np.testing.assert_allclose(mirrored, of_it(states()) * [1.0, -1.0, -1.0], atol=1e-12)


def test_its_power_is_never_positive_and_is_that_of_the_strips() -> None:
    velocity = states(2000)
    power = damping_power(boat(), velocity) - damping_power(boat(0.0), velocity)
    np.testing.assert_allclose(power, (velocity * of_it(velocity)).sum(axis=1), rtol=1e-8, atol=1e-8)
    assert power.max() < 0.0
    width = LENGTH / 20
    places = -LENGTH / 2 + (np.arange(20) + 0.5) * width
    strips = -0.5 * 1025.0 * C_D * DRAUGHT * width * np.abs(velocity[:, 1:2] + places * velocity[:, 2:]) ** 3
    np.testing.assert_allclose(power, strips.sum(axis=1), rtol=1e-8, atol=1e-8)


def test_its_damping_matrix_gives_its_force_and_is_positive_semidefinite() -> None:
    velocity = states()
    matrix = cross_flow_matrix(LENGTH, DRAUGHT, velocity[:, 1], velocity[:, 2])
    np.testing.assert_allclose((matrix @ velocity[..., None])[..., 0], -by_hand(velocity), rtol=1e-10, atol=1e-10)
    assert np.linalg.eigvalsh(matrix).min() > -1e-12
    whole = damping_matrix(boat(), velocity) - damping_matrix(boat(0.0), velocity)
    np.testing.assert_allclose(whole, C_D * matrix, atol=1e-9)


def test_bounds_on_its_power_hold_in_boxes() -> None:
    rng = np.random.default_rng(3)
    middle, half = rng.uniform(-1.0, 1.0, (60, 3)), rng.uniform(0.0, 0.4, (60, 3))
    least, most = power_bounds(LENGTH, DRAUGHT, middle, half)
    for share in rng.uniform(-1.0, 1.0, (200, 60, 3)):
        inside = middle + share * half
        taken = -(inside * by_hand(inside)).sum(axis=1)
        assert (taken >= least - 1e-9).all()
        assert (taken <= most + 1e-9).all()
    here, same = power_bounds(LENGTH, DRAUGHT, middle, 0.0 * half)
    np.testing.assert_allclose(here, -(middle * by_hand(middle)).sum(axis=1), rtol=1e-9)
    np.testing.assert_array_equal(here, same)


def test_a_drifting_boat_slows_as_the_equation_says() -> None:
    """In pure sway v' = -k v|v| / m22 has the solution v0 / (1 + k v0 t / m22)."""
    free = dict.fromkeys(load_vehicle("blueboat").damping, 0.0) | {"x_g": 0.0}
    vehicle = boat().with_values(free | {"cross_flow": C_D})
    rows = 401
    motion = along(np.tile([0.0, 0.8, 0.0], (rows, 1)))
    motion = replace(motion, time=0.02 * np.arange(rows, dtype=float))
    found = simulate_motion(vehicle, motion).velocity
    k = 0.5 * 1025.0 * C_D * DRAUGHT * LENGTH / (vehicle.mass - vehicle.value("Y_vdot"))
    np.testing.assert_allclose(found[:, 1], 0.8 / (1.0 + k * 0.8 * motion.time), rtol=1e-7)
    np.testing.assert_array_equal(found[:, [0, 2]], 0.0)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"hull": {"length": 1.2}}, r"hull\.draught missing, metres of hull below the waterline"),
        ({"hull": {"length": 1.2, "draft": 0.1}}, "unknown key 'draft' in hull: did you mean 'draught'"),
        ({"hull": {"length": 0.0, "draught": 0.1}}, r"hull\.length: expected a number above 0, got 0"),
        ({"hull": {"length": 1.2, "draught": -0.1}}, r"hull\.draught: expected a number above 0, got -0\.1"),
        ({"hul": SIZE}, "unknown key 'hul' in the vehicle file: did you mean 'hull'"),
        (
            {"damping": {"cross_flow": 0.9}},
            r"cross_flow = 0\.9 needs the size of the hull: give hull: \{length",
        ),
        (
            {"damping": {"crossflow": 0.9}, "hull": SIZE},
            "unknown key 'crossflow' in damping: did you mean 'cross_f",
        ),
        ({"damping": {"cross_flow": -0.9}, "hull": SIZE}, r"cross_flow = -0\.9 would drive the boat; .* write 0\.9"),
        (
            {"damping": {"cross_flow": 6.5}, "hull": SIZE},
            r"cross_flow = 6\.5 is more than any hull has: at most 5 was exp",
        ),
    ],
)
def test_what_a_file_may_not_say(changed: dict[str, object], message: str) -> None:
    with pytest.raises(VehicleError, match=message):
        vehicle_from_dict(load_vehicle("blueboat").to_dict() | changed, "vehicle file")


def test_it_lives_in_the_vehicle_file_with_the_hull(tmp_path: Path) -> None:
    boat().save(tmp_path / "boat.yaml")
    written = yaml.safe_load((tmp_path / "boat.yaml").read_text("utf-8"))
    assert (written["hull"], written["damping"]["cross_flow"]) == (SIZE, C_D)
    assert load_vehicle(tmp_path / "boat.yaml") == boat()
    assert "hull" not in load_vehicle("blueboat").to_dict()


def test_a_file_without_a_hull_keeps_its_digest() -> None:
    """Run folders and caches know a vehicle by it."""
    bare = load_vehicle("blueboat")
    content = bare.model_dump_json(exclude={"about", "hull"}).encode()
    assert bare.digest == hashlib.sha256(content).hexdigest()[:16]
    assert boat(0.0).digest != bare.digest


def test_without_a_hull_there_is_no_such_force() -> None:
    bare = load_vehicle("blueboat")
    with pytest.raises(VehicleError, match=r"expected hull: \{length, draught\}, in metres, in the vehicle file"):
        modelled_force(bare.with_values({"cross_flow": 0.9}), along(states(3)))
    for asked in ("cross_flow_drag", "cross_flow"):
        with pytest.raises(RequestError, match=r"effect cross_flow_drag needs the size of the hull: give hull"):
            apply_effects(bare, {asked: 0.9})
    with pytest.raises(RequestError, match="cross_flow_drag needs the size of the hull"):
        typical_effect("cross_flow_drag", bare, np.random.default_rng(0))
    with pytest.raises(RequestError, match=r"cross_flow would be -0\.1 .* expected at least 0"):
        apply_effects(boat(0.2), {"cross_flow_drag": -0.3})


def test_hulls_and_coefficients_are_drawn_of_a_plausible_size() -> None:
    for name in ("blueboat", "cybership2", "otter"):
        rng = np.random.default_rng(4)
        vehicle = with_hull(load_vehicle(name), rng)
        hull = hull_of(vehicle)
        assert 1.0 < hull.length < 2.2
        assert 0.05 < hull.draught / hull.length < 0.13
        assert with_hull(vehicle, rng) is vehicle
        assert 0.5 <= typical_effect("cross_flow_drag", vehicle, rng)["cross_flow"] <= 1.2
    assert hull_of(load_vehicle("otter")).draught == pytest.approx(80.0 / 1025.0 / (2.0 * 0.4 * 0.25 * 2.0), abs=1e-4)


def test_the_catalogue_says_what_it_needs() -> None:
    effect = BY_NAME["cross_flow_drag"]
    assert (effect.requires, effect.added) == (("hull",), True)
    (parameter,) = effect.parameters
    said = boat(0.0).to_dict() | {"damping": {"cross_flow": 6.5}, "insist": ["cross_flow"]}
    insisted = vehicle_from_dict(said, "insisted")
    (own,) = (c for c in candidates(insisted) if c.key == "cross_flow_drag")
    assert own.parameters[0].upper == 6.5, "what a file insists on is its own limit"
    assert (parameter.null, parameter.lower, parameter.upper) == (0.0, 0.0, 5.0)
