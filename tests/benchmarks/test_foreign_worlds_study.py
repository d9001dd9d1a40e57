"""The study of foreign worlds: its simulator knows the same plane as undertow, and no world gets a false name."""

import importlib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import get_args, get_type_hints

import numpy as np
import pytest
from places import ROOT

from undertow.discovery.findings import SensorError
from undertow.physics.effects import BY_NAME, COMMAND_OFFSET
from undertow.physics.forces import ForceEquation, relative_velocity
from undertow.physics.momentum_balance import thruster_matrix
from undertow.physics.vehicle import load_vehicle


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("study.foreign_logs")


@pytest.fixture(scope="module")
def boats(study: ModuleType) -> ModuleType:
    return importlib.import_module("study.foreign_boats")


@pytest.mark.parametrize("name", ["blueboat", "otter"])
@pytest.mark.parametrize("currents", [False, True])
def test_the_plane_is_that_of_the_force_equation(boats: ModuleType, name: str, currents: bool):
    rng = np.random.default_rng(len(name))
    symbols = ("Y_r", "N_v", "N_uv", "Y_ur", "X_vr", "N_ur", "wind_force_north", "wind_force_east")
    more = {symbol: float(value) for symbol, value in zip(symbols, rng.uniform(-5.0, 5.0, len(symbols)), strict=True)}
    more |= {"surge_trim": 1.0, "sway_trim": -2.0, "yaw_trim": 0.5, "y_g": 0.03, "x_g": 0.07}
    water = {"current_north": 0.3, "current_east": -0.2, "current_rate_north": 0.05, "current_rate_east": 0.1}
    vehicle = load_vehicle(name).with_values(more | (water if currents else {}))
    equation, matrix = ForceEquation(vehicle), thruster_matrix(vehicle)
    minute = 1.5

    def current(t: float) -> tuple[float, float, float, float]:
        rates = (water["current_rate_north"] / 60.0, water["current_rate_east"] / 60.0)
        return water["current_north"] + rates[0] * t, water["current_east"] + rates[1] * t, *rates

    for _ in range(20):
        state = rng.uniform(-1.5, 1.5, 6)
        push = rng.uniform(-30.0, 30.0, len(vehicle.thrusters))
        rates = boats.planar(vehicle.values, [(matrix @ push).tolist()], current=current if currents else None)
        own = rates(0, 60.0 * minute, state.tolist())
        heading, velocity = state[2:3], tuple(state[3:, None])
        relative = relative_velocity(vehicle, heading, velocity, minute)
        force = equation.force(relative, heading, push[:, None], minutes=minute)
        other = equation.acceleration(force, relative, velocity, heading)
        np.testing.assert_allclose(own[3:], np.concatenate(other), atol=1e-9, rtol=0.0)


def test_a_boat_that_stands_upright_is_one_in_the_plane(boats: ModuleType):
    values = load_vehicle("blueboat").values
    body = boats.Body(0.0, 5.0, 5.0, 5.0, (0.1, 0.3, 0.4), 2.0, 4.0, 0.0, 0.0)
    flat, full = boats.planar(values, [(10.0, 0.0, 2.0)]), boats.spatial(values, [(10.0, 0.0, 2.0)], body)
    own = flat(0, 0.0, [0.0, 0.0, 0.3, 1.2, -0.2, 0.5])
    other = full(0, 0.0, [0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 1.2, -0.2, 0.0, 0.0, 0.0, 0.5])
    np.testing.assert_allclose([other[k] for k in (0, 1, 5, 6, 7, 11)], own, atol=1e-12)


@pytest.mark.parametrize("steps", [("rk4", 0.05, 1e-6), ("euler", 0.001, 2e-3), ("semi-implicit", 0.001, 2e-3)])
def test_integrators_agree(boats: ModuleType, steps: tuple[str, float, float]):
    name, h, error = steps
    rates = boats.planar(load_vehicle("otter").values, [(20.0, 0.0, 3.0)] * 4000)
    exact = boats.driven(rates, [0.0] * 6, 300, 0.01)[-1]
    found = boats.driven(rates, [0.0] * 6, round(3.0 / h), h, name)[-1]
    np.testing.assert_allclose(found, exact, atol=error)


def test_kinds_speak_of_effects_and_sensors_that_there_are(study: ModuleType):
    offsets = (COMMAND_OFFSET.symbol, "gyro_latency", "position_latency")
    errors = (*get_args(get_type_hints(SensorError)["error"]), *offsets)
    for name, kind in study.KINDS.items():
        assert {*kind.true, *kind.part} <= set(BY_NAME), name
        assert set(kind.sensors) <= set(errors), name
        assert kind.honest, name


def test_the_same_seed_gives_the_same_log(study: ModuleType, tmp_path: Path):
    first, second = (study.world_of("short log", 300_001) for _ in range(2))
    texts = [w.log(w.drive(), tmp_path / f"{k}.csv").read_text() for k, w in enumerate((first, second))]
    assert texts[0] == texts[1]
    assert texts[0].startswith("t,x,y,psi,u,v,r,")


def test_a_boat_on_straight_runs_keeps_its_course(study: ModuleType):
    world = study.world_of("heavier on straight runs", 300_000)
    world.seconds = 60.0
    truth = world.drive()
    assert np.ptp(truth["u"]) > 0.5
    assert not truth["v"].any()
    assert not truth["r"].any()


def test_noise_with_a_memory_is_as_large_at_first_as_later(boats: ModuleType):
    drawn = boats.wandering(np.random.default_rng(3), 200_000, 5.0, 0.01)
    assert abs(drawn[0]) < 5.0
    assert np.std(drawn) == pytest.approx(1.0, rel=0.15)


def test_the_true_effect_makes_the_error_of_a_file_that_is_wrong(study: ModuleType):
    logged = study.foreign("arm 5 % wrong", 300_001)
    assert logged.dominant == "thruster_arm"
    assert logged.true == {"thruster_arm"}
    assert logged.known["arm_scale"] in (pytest.approx(0.95), pytest.approx(1.05))


def test_another_day_has_other_orders_and_the_same_boat(study: ModuleType, tmp_path: Path):
    logged = study.foreign("arm 5 % wrong", 300_001)
    assert logged.fresh is not None
    first, again, other = (
        logged.write(tmp_path / "a.csv"),
        logged.write(tmp_path / "b.csv"),
        logged.fresh(tmp_path / "c.csv", 1),
    )
    assert first.read_bytes() == again.read_bytes() != other.read_bytes()


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        ("propeller in its own advance", 300_000),
        ("gyro with a low-pass", 300_001),
        ("thrust curve wrong", 300_001),
        ("bank", 310_001),
        ("antenna off the origin", 310_003),
    ],
)
def test_a_world_that_got_a_false_name_gets_none(study: ModuleType, kind: str, seed: int):
    record = importlib.import_module("study.verb").answer(study.foreign(kind, seed))
    assert importlib.import_module("study.scoring").false_names(record) == [], record["headline"]
