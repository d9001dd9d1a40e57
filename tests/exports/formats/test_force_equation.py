"""The force equation in JavaScript gives the rollouts of the one in Python, for every effect and kind of curve."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from node import run_script

from undertow.exports.formats.to_javascript import FUNCTION, force_equation, vehicle_data
from undertow.physics.effects import EFFECTS
from undertow.physics.integration import rollout
from undertow.physics.motion import Motion
from undertow.physics.thrusters import neutral_command
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects, typical_effect, with_hull
from undertow.physics.worlds.world import simulate_world

EVERY = 100
"""Rows after which a rollout begins anew."""
NAMES = ("north", "east", "psi", "u", "v", "r")


def logged(motion: Motion) -> dict[str, Any]:
    """A motion as the JavaScript function takes it."""
    columns = np.column_stack([motion.position, motion.heading, motion.velocity])
    return {
        "step": motion.time_step,
        "minutes": motion.minutes.tolist(),
        **{name: column.tolist() for name, column in zip(NAMES, columns.T, strict=True)},
        "commands": motion.commands.T.tolist(),
    }


def in_python(vehicle: Vehicle, motion: Motion) -> np.ndarray:
    """Rollouts put back on the measurement every so often, (6, rows)."""
    starts = np.arange(0, motion.time.size - EVERY, EVERY)
    states = rollout(vehicle, motion, starts, EVERY).states[:, :EVERY]
    return states.reshape(-1, 6).T


def in_javascript(cases: dict[str, tuple[Vehicle, dict[str, float]]], motion: Motion) -> dict[str, np.ndarray]:
    """The same by node, for vehicles with some of their values set."""
    told = {name: [vehicle_data(vehicle), values] for name, (vehicle, values) in cases.items()}
    script = f"""
        {force_equation()}
        const log = {json.dumps(logged(motion))}, cases = {json.dumps(told)}, found = {{}};
        for (const [name, [data, values]] of Object.entries(cases)) {{
          const boat = {FUNCTION}(data);
          for (const [symbol, value] of Object.entries(values)) boat.set(symbol, value);
          const rolled = boat.rollouts(log, {EVERY});
          found[name] = {json.dumps(NAMES)}.map((column) => Array.from(rolled[column]));
        }}
        console.log(JSON.stringify(found));
    """
    rows = (motion.time.size - 1) // EVERY * EVERY
    return {name: np.array(columns)[:, :rows] for name, columns in run_script(script).items()}


@pytest.fixture(scope="module", params=["blueboat", "blueboat_paper", "otter", "cybership2"])
def boat(request: pytest.FixtureRequest) -> Vehicle:
    return with_hull(load_vehicle(request.param), np.random.default_rng(1))


@pytest.fixture(scope="module")
def motion(boat: Vehicle) -> Motion:
    """Ahead, then as if the same had been commanded astern, and hardly at all in the end."""
    ahead = simulate_world(boat, {}, duration=40.0, seed=4, noise="clean").motion()
    neutral, half = np.array([neutral_command(t) for t in boat.thrusters]), ahead.time.size // 2
    commands = ahead.commands.copy()
    commands[half:] = 2.0 * neutral - commands[half:]
    commands[3 * half // 2 :] = neutral + 0.1 * (commands[3 * half // 2 :] - neutral)
    return replace(ahead, commands=commands)


def close(found: np.ndarray, expected: np.ndarray) -> None:
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_every_effect_of_the_catalogue_is_the_same_in_both(boat: Vehicle, motion: Motion):
    """Set one by one from outside, as the sliders of the page do."""
    rng, changed = np.random.default_rng(3), {}
    for effect in EFFECTS:
        if not effect.channels:
            changed[effect.name] = apply_effects(boat, typical_effect(effect.name, boat, rng))
    asked = {n: {s: x for s, x in v.values.items() if x != boat.value(s)} for n, v in changed.items()}
    found = in_javascript({name: (boat, values) for name, values in asked.items()}, motion)
    still = in_python(boat, motion)
    for name, vehicle in changed.items():
        expected = in_python(vehicle, motion)
        assert np.abs(expected - still).max() > 1e-6, f"{name} changes nothing in this motion"
        close(found[name], expected)


def test_all_at_once_and_terms_without_a_name(boat: Vehicle, motion: Motion):
    every = {
        "fouling_rate": 0.02,
        "thrust_rate": -0.05,
        "current_north": 0.1,
        "current_rate_east": 0.05,
        "thruster_lag": 0.0,
        "lag": 0.3,
        "delay": 0.17,
        "dead_zone": 0.05,
        "thrust_exponent": 1.3,
        "gain_ahead_67": 0.7,
        "gain_astern_33": 1.4,
        "reverse_scale": 0.6,
        "advance_loss": 0.4,
        "y_g": 0.01,
        "memory_sway": 3.0,
        "memory_yaw": 0.4,
        "memory_time": 1.7,
        "yaw:u|v|": 0.3,
        "surge:vr": -0.4,
    }
    values = {s: v for s, v in every.items() if s in boat.values or ":" in s}
    changed = boat.with_values(values)
    close(in_javascript({"all": (changed, {})}, motion)["all"], in_python(changed, motion))


def test_an_unknown_symbol_is_refused():
    data = json.dumps(vehicle_data(load_vehicle("otter")))
    script = f"""{force_equation()}
        const vehicle = {FUNCTION}({data});
        try {{ vehicle.set("X_nothing", 1); }} catch (error) {{ console.log(JSON.stringify(error.message)); }}"""
    assert run_script(script) == "no parameter X_nothing"
