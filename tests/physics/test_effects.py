"""The catalogue: every effect lives in the vehicle file, and its null value means "absent"."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from undertow.physics.effects import BY_NAME, EFFECTS, PARAMETERS, Effect, Parameter, effect_named, parse_form
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.forces import modelled_acceleration, modelled_force
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle, shipped_vehicles, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import with_hull


def lively(seed: int = 3, n: int = 60) -> Motion:
    """A motion (not a simulated one) in which every velocity and command takes both signs."""
    rng = np.random.default_rng(seed)
    t = 0.1 * np.arange(n, dtype=float)
    waves = np.sin(t[:, None] * rng.uniform(0.5, 3.0, 6) + rng.uniform(0, 6, 6))
    scale = np.array([1.5, 0.4, 0.8])
    return Motion(t, np.zeros((n, 2)), 2.0 * waves[:, 5], scale * waves[:, :3], 30.0 * waves[:, 3:5], ("port", "stbd"))


def sizes(effect: Effect, vehicle: Vehicle) -> dict[str, float]:
    """Plain absolute values, other than null, of an effect's parameters in a vehicle, by symbol."""
    found = {}
    for k, p in enumerate(effect.parameters):
        plain = 0.1 if p.unit == "m" else -1.0
        value = effect.default[k] if effect.default else p.grid[3] if p.grid else 0.7 if p.null else plain
        value = abs(value) if p.lower == 0.0 else value
        found[p.symbol.replace("{thruster}", vehicle.thrusters[-1].name)] = value
    return found


def absent(effect: Effect, vehicle: Vehicle) -> dict[str, float]:
    """The null values of an effect's parameters in a vehicle."""
    name = vehicle.thrusters[-1].name
    nulls = {p.symbol.replace("{thruster}", name): p.null for p in effect.parameters}
    return nulls | ({"mass": vehicle.mass} if "mass" in nulls else {})


def boat() -> Vehicle:
    """The BlueBoat with a hull of some size, which cross-flow drag asks for."""
    return with_hull(load_vehicle("blueboat"), np.random.default_rng(1))


def bare() -> Vehicle:
    """The BlueBoat without a damping, coupling, added mass or offset."""
    data = load_vehicle("blueboat").model_dump(mode="json") | {"added_mass": {}, "damping": {}, "x_g": 0.0}
    return vehicle_from_dict(data, "bare")


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_null_value_means_absent(effect: Effect) -> None:
    vehicle, motion = bare(), lively()
    same = vehicle.with_values(absent(effect, vehicle))
    np.testing.assert_array_equal(modelled_force(same, motion), modelled_force(vehicle, motion))
    np.testing.assert_array_equal(mass_matrix(same), mass_matrix(vehicle))


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_any_other_value_is_felt(effect: Effect) -> None:
    vehicle, motion = boat(), lively()
    before = modelled_acceleration(vehicle, motion)
    after = modelled_acceleration(vehicle.with_values(sizes(effect, vehicle)), motion)
    assert np.abs(after - before).max() > 1e-3


def test_a_body_without_hydrodynamics_does_not_feel_the_current() -> None:
    """Fossen (2021), property 10.1: in a constant irrotational current the rigid body's equations keep their form."""
    vehicle, motion = bare().with_values({"x_g": 0.3}), lively()
    drifting = vehicle.with_values({"current_north": 0.5, "current_east": -0.2})
    np.testing.assert_allclose(
        modelled_acceleration(drifting, motion), modelled_acceleration(vehicle, motion), atol=1e-12
    )
    assert np.abs(modelled_force(drifting, motion) - modelled_force(vehicle, motion)).max() > 1.0


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_parameters_live_in_the_vehicle_file(effect: Effect, tmp_path: Path) -> None:
    vehicle = boat()
    wanted = sizes(effect, vehicle)
    path = tmp_path / "vehicle.yaml"
    vehicle.with_values(wanted).save(path)
    again = load_vehicle(path)
    assert {symbol: again.value(symbol) for symbol in wanted} == wanted
    written = yaml.safe_load(path.read_text("utf-8"))
    for p in effect.parameters:
        key = "scale" if "{" in p.symbol else p.symbol
        places = {"top": written, "thrusters": written["thrusters"][-1]}
        assert key in places.get(p.section, written.get(p.section, {}))


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_entry_is_complete(effect: Effect) -> None:
    assert effect.meaning.endswith(".")
    assert effect.equation
    assert effect.default == () or len(effect.default) == len(effect.parameters)
    assert effect.fixed_amplitude == (not effect.amplitudes)
    for p in effect.parameters:
        assert p.unit
        assert p.lower <= p.null <= p.upper
        assert p.step > 0
        assert all(p.lower < x < p.upper for x in p.grid)
        assert p.axis is not None or p.form == ""
        if p.form:
            assert parse_form(p.form).text == p.form


def test_symbols_and_names_are_unique() -> None:
    symbols = [s for effect in EFFECTS for s in effect.symbols]
    assert len(set(symbols)) == len(symbols)
    assert len(BY_NAME) == len(EFFECTS)


@pytest.mark.parametrize("symbol", [p.symbol for p in PARAMETERS.values() if p.form])
def test_hydrodynamic_force_is_value_times_form(symbol: str) -> None:
    vehicle, motion, p = bare(), lively(), PARAMETERS[symbol]
    added = modelled_force(vehicle.with_values({symbol: -3.0}), motion) - modelled_force(vehicle, motion)
    expected = np.zeros_like(added)
    expected[:, p.axis or 0] = -3.0 * parse_form(p.form)(*motion.velocity.T)
    np.testing.assert_allclose(added, expected, atol=1e-12)


@pytest.mark.parametrize("p", [p for p in PARAMETERS.values() if p.upper == 0.0 and p.form], ids=lambda p: p.symbol)
def test_hull_damping_takes_energy_out_ahead_and_astern(p: Parameter) -> None:
    velocity = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 500))
    power = -1.0 * parse_form(p.form)(*velocity) * velocity[p.axis or 0]
    assert power.max() <= 0.0


def test_couplings_have_the_forms_of_the_literature() -> None:
    wanted = {"Y_r": (1, "r"), "N_v": (2, "v"), "N_uv": (2, "uv"), "Y_ur": (1, "ur"), "X_vr": (0, "vr")}
    assert {s: (PARAMETERS[s].axis, PARAMETERS[s].form) for s in wanted} == wanted


def test_unnamed_term_goes_through_the_same_door(tmp_path: Path) -> None:
    vehicle, motion = bare().with_values({"yaw:u|r|": -1.5}), lively()
    vehicle.save(tmp_path / "v.yaml")
    again = load_vehicle(tmp_path / "v.yaml")
    assert again.value("yaw:u|r|") == -1.5
    assert again.value("sway:u^2") == 0.0
    u, _, r = motion.velocity.T
    added = modelled_force(again, motion) - modelled_force(bare(), motion)
    np.testing.assert_allclose(added, np.column_stack([0 * u, 0 * u, -1.5 * u * np.abs(r)]), atol=1e-12)
    assert again.parameter("yaw:u|r|").unit == "N m (s/m)^1 (s/rad)^1"


@pytest.mark.parametrize("name", shipped_vehicles())
def test_shipped_vehicle_survives_its_file(name: str, tmp_path: Path) -> None:
    vehicle = load_vehicle(name)
    vehicle.save(tmp_path / "v.yaml")
    assert load_vehicle(tmp_path / "v.yaml") == vehicle
    assert vehicle.checked() == vehicle
    assert not list(tmp_path.glob(".*")), "no temporary file is left"


def test_with_values_leaves_the_original_alone() -> None:
    vehicle = load_vehicle("blueboat")
    new = vehicle.with_values({"X_u": -1.0, "stbd_scale": 0.5, "lag": 0.2, "mass": 31.0}, name="new")
    assert (vehicle.value("X_u"), vehicle.value("stbd_scale"), vehicle.value("lag"), vehicle.mass) == (-15, 1, 0, 30.5)
    assert (new.value("X_u"), new.value("stbd_scale"), new.value("port_scale"), new.mass) == (-1.0, 0.5, 1.0, 31.0)
    assert [t.lag for t in new.thrusters] == [0.2, 0.2]
    assert new.name == "new"


def data_with(path: str, value: object) -> dict[str, object]:
    """The BlueBoat's data with the entry at a dotted path replaced."""
    data = load_vehicle("blueboat").model_dump(mode="json")
    *parents, last = path.split(".")
    place: Any = data
    for key in parents:
        place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
    place[last] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("mas", 3.0, r"unknown key 'mas' in the vehicle file: did you mean 'mass'"),
        ("weight", 3.0, r"unknown key 'weight' in the vehicle file: did you mean 'mass'"),
        ("zzz", "red", r"unknown key 'zzz' in the vehicle file; there are about, added_mass, "),
        ("damping.X_uuu", -1.0, r"unknown key 'X_uuu' in damping: did you mean 'X_uu'"),
        ("added_mass.X_udott", -1.0, r"unknown key 'X_udott' in added_mass: did you mean 'X_udot'"),
        ("coupling.N_uvv", -1.0, r"unknown key 'N_uvv' in coupling: did you mean 'N_uv'"),
        ("environment.curent_north", 0.1, r"unknown key 'curent_north' in environment: did you mean 'current_north'"),
        ("memory.memory_tim", 1.0, r"unknown key 'memory_tim' in memory: did you mean 'memory_time'"),
        ("thrusters.1.dead_zon", 0.1, r"unknown key 'dead_zon' in thrusters\.1: did you mean 'dead_zone'"),
        ("terms", [{"axis": "yaw", "frm": "u", "value": 1.0}], r"unknown key 'frm' in terms\.0: did you mean 'form'"),
        ("terms", [{"axis": "yaw", "form": "uq", "value": 1.0}], r"expected a product of one to three"),
        ("mass", 0.0, r"mass: expected a number above 0, got 0\.0"),
        ("mass", -22.0, r"mass: expected a number above 0, got -22"),
        ("mass", "heavy", r"mass: .*expected a number.*, got 'heavy'"),
        ("inertia_z", -1.0, r"inertia_z: expected a number above 0"),
        ("mass", math.nan, r"mass: .*finite number"),
        ("added_mass.X_udot", 31.0, r"mass matrix M = M_RB \+ M_A is not positive definite: m11=-0\.5"),
        ("added_mass.Y_rdot", 40.0, r"not positive definite: .*m23=-41\.6952"),
        ("memory.memory_time", 0.0, r"memory_time must be positive, got 0 s"),
        ("thrusters.1.name", "port", r"thruster names must differ, got port, port"),
        ("thrusters.1.lag", -0.1, r"lag: expected at least 0, got -0.1"),
        ("thrusters", [], r"thrusters: .*a list of at least 1, got"),
        ("coupling", {"X_u": -2.0}, r"X_u stands twice, under damping and under coupling"),
    ],
)
def test_wrong_vehicle_is_refused_in_words(path: str, value: object, message: str) -> None:
    with pytest.raises(VehicleError, match=message):
        vehicle_from_dict(data_with(path, value), "boat.yaml")


def test_no_hull_has_twenty_times_its_mass_of_water_with_it() -> None:
    hull = load_vehicle("blueboat")
    assert hull.parameter("X_udot").lower == -20.0 * hull.mass
    assert hull.parameter("N_r").lower == -100.0 * hull.inertia_z
    assert hull.with_values({"N_rdot": -1e6}).parameter("N_rdot").lower == -1e6
    assert hull.parameter("X_uu").lower == -float("inf")


def test_missing_key_is_named() -> None:
    data = load_vehicle("blueboat").model_dump(mode="json")
    del data["mass"]
    with pytest.raises(VehicleError, match=r"boat\.yaml: mass missing, kg"):
        vehicle_from_dict(data, "boat.yaml")


def test_derivative_under_the_wrong_of_two_headings_is_put_right() -> None:
    vehicle = vehicle_from_dict(data_with("coupling", {"Y_r": 2.5}) | {"damping": {"N_uv": 4.0}}, "boat")
    assert vehicle.damping == {"Y_r": 2.5}
    assert vehicle.coupling == {"N_uv": 4.0}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"mass: [1, 2", "not readable as YAML"),
        (b"\xff\xfe\x00", "not readable as YAML"),
        (b"", "expected a mapping of vehicle keys .*, got NoneType"),
        (b"- 1\n- 2\n", "expected a mapping of vehicle keys .*, got list"),
    ],
)
def test_file_that_is_no_vehicle_is_refused(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "boat.yaml"
    path.write_bytes(content)
    with pytest.raises(VehicleError, match=message):
        load_vehicle(path)


def test_missing_file_names_the_shipped_vehicles() -> None:
    with pytest.raises(VehicleError, match=r"no such file; give a YAML file or one of .*blueboat.*otter"):
        load_vehicle("nowhere.yaml")


@pytest.mark.parametrize(
    ("asked", "near"), [("surge_quadratic_dampin", "surge_quadratic_damping"), ("thruster_lagg", "thruster_lag")]
)
def test_unknown_effect_names_the_nearest(asked: str, near: str) -> None:
    with pytest.raises(RequestError, match=f"unknown effect {asked!r}: did you mean {near!r}"):
        effect_named(asked)
    assert effect_named(near).name == near


def test_unknown_symbols_are_refused() -> None:
    vehicle = load_vehicle("blueboat")
    for ask in (vehicle.value, vehicle.parameter, lambda s: vehicle.with_values({s: 1.0})):
        with pytest.raises(VehicleError, match="unknown key 'X_uuu' .*did you mean 'X_uu'"):
            ask("X_uuu")
    for ask in (vehicle.parameter, lambda s: vehicle.with_values({s: 1.0})):
        with pytest.raises(VehicleError, match="term 'heave:u': expected surge, sway or yaw"):
            ask("heave:u")
    with pytest.raises(VehicleError, match="lag"):
        vehicle.with_values({"lag": -1.0}).checked()
