"""Errors of sensors of which only forces tell: found at their size, with the right names beside them, or not found."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from undertow.discovery import selection
from undertow.discovery.discover import find_missing
from undertow.discovery.sensor_error_search import HiddenErrors
from undertow.measurements.log import read_log
from undertow.physics.motion import Motion, body_to_earth, earth_to_body
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull, typical_effect
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import read_inputs

HULL = load_vehicle("blueboat")
RIGHT = HiddenErrors(0.0, 0.0, 0.0)


def sailed(effects: dict[str, float] | None = None, seed: int = 3, noise: str = "clean") -> Motion:
    return simulate_world(HULL, effects or {}, duration=200.0, noise=noise, seed=seed).motion(0.05)


def measured(motion: Motion, errors: HiddenErrors) -> Motion:
    """The motion as sensors with these errors record it: first where they stand, then along their heading."""
    arm = replace(errors, arm_x=-errors.arm_x, arm_y=-errors.arm_y, compass=0.0)
    return replace(RIGHT, compass=-errors.compass).corrected(arm.corrected(motion))


def test_what_is_measured_wrong_is_corrected():
    motion, errors = sailed(), HiddenErrors(0.4, -0.3, 0.1)
    turned = replace(RIGHT, compass=errors.compass).corrected(measured(motion, errors))
    mended = replace(errors, compass=0.0).corrected(turned)
    np.testing.assert_allclose(mended.velocity, motion.velocity, atol=1e-12)
    np.testing.assert_allclose(mended.heading, motion.heading, atol=1e-12)


@pytest.mark.parametrize("hidden", [{}, {"surge_quadratic_damping": -8.0}], ids=["nothing", "drag"])
@pytest.mark.parametrize(
    "errors",
    [HiddenErrors(0.6, 0.0, 0.0), HiddenErrors(0.0, -0.4, 0.0), HiddenErrors(0.0, 0.0, 0.1)],
    ids=["ahead", "aside", "compass"],
)
def test_an_error_that_only_forces_show_is_found_and_blamed_on_no_effect(
    errors: HiddenErrors, hidden: dict[str, float]
):
    found = find_missing([measured(sailed(hidden), errors)], HULL).findings
    assert set(found.missing) <= set(hidden)
    told = {term.symbol: term.value for sensor in found.sensors for term in sensor.terms if sensor.verdict == "present"}
    told["compass"] = told.get("misalignment", 0.0) + told.get("constant", 0.0)
    wanted = {"arm_x": errors.arm_x, "arm_y": errors.arm_y, "compass": float(np.degrees(errors.compass))}
    for symbol, value in wanted.items():
        assert told.get(symbol, 0.0) == pytest.approx(value, abs=0.02 + 0.06 * abs(value))


def test_a_lever_arm_is_found_under_noise_where_no_effect_leaves_it_white(monkeypatch: pytest.MonkeyPatch):
    """Where it is not looked for, rollouts judge, and a part of the force has no name; they are not asked for it."""
    monkeypatch.setattr(selection, "search_on_rollouts", None)
    found = find_missing([measured(sailed(noise="field"), HiddenErrors(0.0, 0.5, 0.0))], HULL).findings
    assert found.verdict == "nothing missing"
    (arm,) = [s for s in found.sensors if s.error == "antenna_arm"]
    assert {term.symbol: term.value for term in arm.terms} == pytest.approx({"arm_x": 0.0, "arm_y": 0.5}, abs=0.05)


def test_rollouts_are_not_asked_for_an_arm_beside_two_effects(monkeypatch: pytest.MonkeyPatch):
    """A first search does not explain these by one effect, so that the arm is tried again beside its end."""
    monkeypatch.setattr(selection, "search_on_rollouts", None)
    hidden = {"surge_quadratic_damping": -8.0, "yaw_trim": -1.0}
    found = find_missing([measured(sailed(hidden, noise="field"), HiddenErrors(0.0, 0.5, 0.0))], HULL).findings
    assert set(found.missing) <= set(hidden)
    assert [s.error for s in found.sensors if s.verdict == "present"] == ["antenna_arm"]


@pytest.mark.parametrize(
    ("seed", "effect"), [(9206, "sway_lift"), (9208, None), (9107, "cg_offset")], ids=["lift", "nothing", "balance"]
)
def test_a_lever_arm_is_found_where_a_dozen_effects_explain_it_to_white_noise(seed: int, effect: str | None):
    """The errors earn little beside so many effects, and rollouts may judge what is left: forces compare the two."""
    rng = np.random.default_rng([seed, 9])
    hull = random_hull(HULL, rng)
    effects = {} if effect is None else typical_effect(effect, hull, rng)
    programme = {9206: "zigzag", 9208: "gentle", 9107: "gentle"}[seed]
    world = simulate_world(hull, effects, programme=programme, duration=240.0, noise="field", seed=seed)
    found = find_missing([measured(world.motion(0.05), HiddenErrors(0.6, 0.0, 0.0))], hull).findings
    assert found.missing == (() if effect is None else (effect,))
    (arm,) = [s for s in found.sensors if s.error == "antenna_arm"]
    assert {term.symbol: term.value for term in arm.terms} == pytest.approx({"arm_x": 0.6, "arm_y": 0.0}, abs=0.05)


def test_no_lever_arm_is_made_of_what_is_left_of_a_bad_compass(tmp_path: Path):
    """The gyro tells of a deviation to half a degree; seven effects and an arm that is not there explained the rest."""
    rng = np.random.default_rng([9209, 9])
    hull = random_hull(HULL, rng)
    effects = typical_effect("cg_offset", hull, rng)
    world = simulate_world(hull, effects, programme="gentle", duration=240.0, noise="clean", seed=9209)
    table = pd.read_csv(world.write(tmp_path / "log.csv"))
    u, v, psi = (table.value[table.field == name].to_numpy() for name in ("u", "v", "psi"))
    off = np.radians(8.0 * np.sin(psi - 0.7))
    for name, values in zip(("u", "v", "psi"), (*earth_to_body(off, u, v), psi + off), strict=True):
        table.loc[table.field == name, "value"] = values
    table.to_csv(tmp_path / "log.csv", index=False)
    inputs = read_inputs(tmp_path / "log.csv", hull)
    found = find_missing(inputs.fitting, inputs.vehicle).findings
    assert set(found.missing) <= {"cg_offset"}
    assert not [s for s in found.sensors if s.error == "antenna_arm"]


@pytest.mark.parametrize("effect", ["cg_offset", "sway_yaw_coupling", "yaw_added_mass"])
def test_effects_that_look_like_a_lever_arm_are_named_where_there_is_none(effect: str):
    symbols = {"cg_offset": {"cg_offset": 0.05}, "sway_yaw_coupling": {"sway_yaw_coupling": (8.0, 8.0)}}
    found = find_missing([sailed(symbols.get(effect, {effect: -4.0}))], HULL).findings
    assert found.missing == (effect,)
    assert not any(s.error in ("antenna_arm", "compass_deviation") for s in found.sensors)


@pytest.mark.parametrize(
    ("seed", "programme", "noise", "effect", "arm"),
    [
        (9204, "rich", "clean", None, (0.0, 0.5)),
        (9104, "zigzag", "field", "sway_lift", (0.6, 0.0)),
        (9109, "rich", "field", "surge_quadratic_damping", (0.6, 0.0)),
    ],
    ids=["nothing", "lift", "drag"],
)
def test_an_arm_is_told_though_the_record_of_the_commands_leaves_a_little(
    seed: int, programme: str, noise: str, effect: str | None, arm: tuple[float, float], tmp_path: Path
):
    """Switches between records leave more in yaw than is immaterial, with and without the arm; rollouts may judge."""
    rng = np.random.default_rng([seed, 9])
    hull = random_hull(HULL, rng)
    effects = {} if effect is None else typical_effect(effect, hull, rng)
    world = simulate_world(hull, effects, programme=programme, duration=240.0, noise=noise, seed=seed)
    channels = read_log(world.write(tmp_path / "log.csv")).channels
    table = {"t": channels["u"].time, **{name: channels[name].value for name in ("x", "y", "psi", "u", "v", "r")}}
    table["u"], table["v"] = table["u"] - arm[1] * table["r"], table["v"] + arm[0] * table["r"]
    north, east = body_to_earth(table["psi"], *(np.full_like(table["t"], way) for way in arm))
    table["x"], table["y"] = table["x"] + north, table["y"] + east
    for name in ("newton_port", "newton_stbd"):  # the nearest that was recorded
        nearest = np.abs(channels[name].time[:, None] - table["t"]).argmin(axis=0)
        table[name] = channels[name].value[nearest]
    pd.DataFrame(table).round(9).to_csv(tmp_path / "log.csv", index=False)
    inputs = read_inputs(tmp_path / "log.csv", hull)
    found = find_missing(inputs.fitting, inputs.vehicle).findings
    assert found.missing == (() if effect is None else (effect,))
    (told,) = [s for s in found.sensors if s.error == "antenna_arm"]
    assert [term.value for term in told.terms] == pytest.approx(arm, abs=0.02)
