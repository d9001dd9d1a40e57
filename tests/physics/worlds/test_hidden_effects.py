"""Hidden effects: how one is asked for by name, and sizes drawn at random that matter."""

from collections.abc import Mapping

import numpy as np
import pytest

from undertow.physics import effects
from undertow.physics import momentum_balance as matrices
from undertow.physics.effects import EFFECTS, Effect, Parameter, parse_form
from undertow.physics.errors import RequestError
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle, shipped_vehicles
from undertow.physics.worlds import hidden_effects
from undertow.physics.worlds.hidden_effects import (
    apply_effects,
    commanded_motion,
    materiality,
    parse_effect,
    random_hull,
    typical_effect,
    with_hull,
)
from undertow.physics.worlds.manoeuvres import programme


@pytest.fixture(scope="module")
def boat() -> Vehicle:
    return with_hull(load_vehicle("blueboat"), np.random.default_rng(1))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("surge_quadratic_damping=-9", {"X_uu": -17.0}),
        ("X_uu=-9", {"X_uu": -17.0}),
        ("cg_offset=0.1", {"x_g": 0.1 - 0.05558}),
        ("surge_added_mass=-4", {"X_udot": -7.0}),
        ("yaw_trim = 1.5", {"yaw_trim": 1.5}),
        ("steady_current=0.3,-0.1", {"current_north": 0.3, "current_east": -0.1}),
        ("steady_current=0.3", {"current_north": 0.3, "current_east": 0.0}),
        ("sway_yaw_coupling=-6", {"Y_r": -6.0, "N_v": 0.0}),
        ("wake_memory=20", {"memory_sway": 20.0, "memory_yaw": 3.0, "memory_time": 1.0}),
        ("thruster_asymmetry=0.8", {"port_scale": 1.0, "stbd_scale": 0.8}),
        ("thruster_asymmetry=port:0.8", {"port_scale": 0.8, "stbd_scale": 1.0}),
        ("port_scale=0.7", {"port_scale": 0.7}),
        ("lag=0.4", {"lag": 0.4}),
        ("inertia_z=5", {"inertia_z": 5.0}),
        ("mass_offset=5", {"mass": 35.5}),
        ("mass=-2.5", {"mass": 28.0}),
        ("yaw:u|r|=-1.2", {"yaw:u|r|": -1.2}),
    ],
)
def test_effect_of_the_command_line(boat: Vehicle, text: str, expected: Mapping[str, float]) -> None:
    vehicle = apply_effects(boat, dict([parse_effect(text)]))
    for symbol, value in expected.items():
        assert vehicle.value(symbol) == pytest.approx(value, abs=1e-12)
    others = {s: x for s, x in vehicle.values.items() if s not in expected}
    assert others == {s: x for s, x in boat.values.items() if s not in expected}


def test_absolute_effects_replace_and_added_ones_add_up(boat: Vehicle) -> None:
    weak = apply_effects(boat, {"thrust_scale": 0.8, "surge_quadratic_damping": -4.0, "X_uu": -1.0})
    assert weak.value("X_uu") == -13.0
    again = apply_effects(weak, {"thrust_scale": 0.9, "surge_quadratic_damping": (-4.0,)})
    assert (again.value("thrust_scale"), again.value("X_uu")) == (0.9, -17.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("surge_quad=-9", "unknown effect 'surge_quad': did you mean 'surge_quadratic_damping'"),
        ("thruster_lagg=1", "unknown effect 'thruster_lagg': did you mean 'thruster_lag'"),
        ("X_uuu=-9", "unknown effect 'X_uuu': did you mean 'X_uu'"),
        ("X_uu", "expected name=value, for example"),
        ("=3", "expected name=value, for example"),
        ("X_uu=much", "expected a number after X_uu=, got 'much'"),
        ("X_uu=", "expected a number after X_uu=, got ''"),
        ("X_uu=inf", "expected a finite number, got 'inf'"),
        ("steady_current=1,2,3", r"expected at most 2 value\(s\) \(current_north, current_east\), got 3"),
        ("X_uu=1,2", r"expected at most 1 value\(s\) \(X_uu\), got 2"),
        ("thruster_asymmetry=prt:0.8", "unknown effect 'prt_scale': did you mean 'port_scale'"),
        ("X_u=80", r"X_u would be 65 N s/m \(the vehicle has -15\); expected at least -3050 and at most 0 N s/m"),
        ("dead_zone=0.9", r"dead_zone would be 0\.9 \(the vehicle has 0\); expected at least 0 and at most 0\.5"),
        ("input_delay=-0.1", r"delay would be -0\.1 s .*expected at least 0 and at most 2 s"),
        ("sway_added_mass=30", "Y_vdot would be 12 kg"),
        ("Y_rdot=40", "the vehicle would not be sound: .*not positive definite"),
        ("mass=-40", r"mass would be -9\.5 kg \(the vehicle has 30\.5\); expected at least 0 kg"),
        ("inertia_z=-3", "the vehicle would not be sound: .*inertia_z: expected a number above 0"),
        ("heave:u=1", "expected surge, sway or yaw before the colon"),
        ("yaw:uq=1", "expected a product of one to three of u, v, r"),
    ],
)
def test_wrong_effect_is_refused_in_words(boat: Vehicle, text: str, message: str) -> None:
    with pytest.raises(RequestError, match=message):
        apply_effects(boat, dict([parse_effect(text)]))


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        (
            {"thruster_asymmetry": 0.8, "stbd_scale": 0.7},
            "expected one value for stbd_scale, got 0.8 from thruster_asymmetry and 0.7 from stbd_scale; give it once",
        ),
        ({"lag": 0.4, "thruster_lag": 0.4}, "expected one value for lag, got 0.4 from lag and 0.4 from thruster_lag"),
        ({"steady_current": 0.3, "current_east": 0.1}, "expected one value for current_east, got 0 from"),
    ],
)
def test_two_values_for_what_is_replaced_are_refused(boat: Vehicle, effects: Mapping[str, float], message: str) -> None:
    with pytest.raises(RequestError, match=message):
        apply_effects(boat, effects)
    assert apply_effects(boat, {"thruster_asymmetry": 0.8, "port_scale": 0.7}).value("port_scale") == 0.7


def test_too_many_values_are_refused_without_the_command_line(boat: Vehicle) -> None:
    with pytest.raises(RequestError, match=r"effect steady_current: expected 2 value\(s\)"):
        apply_effects(boat, {"steady_current": (0.1, 0.2, 0.3)})


def test_random_hull_stays_within_its_spread(boat: Vehicle) -> None:
    rng = np.random.default_rng(0)
    symbols = ("mass", "inertia_z", "Y_vdot", "X_u", "N_rr")
    hulls = [random_hull(boat, rng, 0.25) for _ in range(40)]
    ratios = np.array([[hull.value(s) / boat.value(s) for s in symbols] for hull in hulls])
    assert ratios.min() >= 0.75
    assert ratios.max() <= 1.25
    assert (ratios.std(axis=0) > 0.08).all()
    assert random_hull(boat, rng).value("Y_r") == 0.0
    with pytest.raises(RequestError, match="no sound vehicle within 10%"):
        random_hull(boat.with_values({"Y_rdot": 1e4}), rng, 0.1)


@pytest.fixture(scope="module")
def rich_motion(boat: Vehicle) -> Motion:
    return commanded_motion(boat, programme(boat, "rich", 120.0, seed=3), 0.1)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_typical_effect_is_sound_and_material(boat: Vehicle, effect: Effect, rich_motion: Motion) -> None:
    """Judged on another programme than the one that it was sized on."""
    values = typical_effect(effect.name, boat, np.random.default_rng(7))
    share = materiality(boat, apply_effects(boat, values), rich_motion)
    assert 0.01 < share.max() < 3.0


@pytest.mark.parametrize("vehicle", shipped_vehicles())
def test_typical_effect_fits_every_vehicle(vehicle: str) -> None:
    one, two = (typical_effect("thruster_asymmetry", load_vehicle(vehicle), np.random.default_rng(1)) for _ in "ab")
    assert one == two
    assert set(one) < {"port_scale", "stbd_scale"}
    assert 0.6 <= next(iter(one.values())) <= 0.9
    dead = typical_effect("thrust_dead_zone", load_vehicle(vehicle), np.random.default_rng(1), floor=0.01)
    assert 0.06 <= dead["dead_zone"] <= 0.45


def test_materiality_of_nothing_is_zero(boat: Vehicle, rich_motion: Motion) -> None:
    np.testing.assert_array_equal(materiality(boat, boat, rich_motion), 0.0)


def test_typical_effect_that_cannot_matter_is_refused(boat: Vehicle) -> None:
    with pytest.raises(RequestError, match="thrust_dead_zone: no draw changes .* motion by 5000%"):
        typical_effect("thrust_dead_zone", boat, np.random.default_rng(0), floor=50.0)
    with pytest.raises(RequestError, match="unknown effect 'dragg'"):
        typical_effect("dragg", boat, np.random.default_rng(0))


MADE_UP = (
    Parameter("N_vr", "damping", "N s^2/rad", axis=2, form="|v|r", upper=0.0),
    Parameter("Y_vvv", "damping", "N s^3/m^3", axis=1, form="v^3", upper=0.0),
    Parameter("X_rr", "coupling", "N s^2/rad^2", axis=0, form="r^2"),
)


@pytest.mark.parametrize("vehicle", shipped_vehicles())
def test_a_new_entry_of_the_catalogue_has_a_typical_size(vehicle: str, monkeypatch: pytest.MonkeyPatch) -> None:
    effect = Effect("made_up", "hull", (*MADE_UP, EFFECTS[-1].parameters[0]), "...", "Made up.")
    monkeypatch.setitem(effects.BY_NAME, effect.name, effect)
    for p in MADE_UP:
        monkeypatch.setitem(effects.PARAMETERS, p.symbol, p)
    terms = [(p.symbol, p.axis, parse_form(p.form)) for p in MADE_UP]
    monkeypatch.setattr(matrices, "HYDRODYNAMIC", (*matrices.HYDRODYNAMIC, *terms))
    hull = load_vehicle(vehicle)
    values = typical_effect("made_up", hull, np.random.default_rng(4))
    assert list(values) == ["N_vr", "Y_vvv", "X_rr", EFFECTS[-1].symbols[0]]
    assert max(values["N_vr"], values["Y_vvv"]) < 0.0
    assert all(values.values())
    assert values == typical_effect("made_up", hull, np.random.default_rng(4))


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_default_sizes_serve_the_whole_catalogue(
    boat: Vehicle, effect: Effect, rich_motion: Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Factors, shapes, winds and masses too: what the catalogue says of a parameter is enough."""
    monkeypatch.setattr(hidden_effects, "_draws", lambda *_: {})
    values = typical_effect(effect.name, boat, np.random.default_rng(7))
    share = materiality(boat, apply_effects(boat, values), rich_motion)
    assert 0.01 < share.max() < 5.0
